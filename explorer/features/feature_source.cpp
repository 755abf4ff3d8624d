// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/features/feature_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "explorer/picture/trust.h"
#include "explorer/recomposition/decode.h"
#include "explorer/stacks/stack_source.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

bool equal(std::span<const ChannelOptics> a, std::span<const ChannelOptics> b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const ChannelOptics& x, const ChannelOptics& y) {
                      return x.extinction == y.extinction && x.emission == y.emission;
                    });
}

}  // namespace

bool FeatureSource::has(const Archive& archive, long cycle, const std::string& name) {
  const auto& views = archive.views();
  return std::any_of(views.begin(), views.end(), [&](const std::string& view) {
    return archive.find(cycle, view, name, kind::kFeatures) ||
           archive.find(cycle, view, name, kind::kSlicedFeatures);
  });
}

FeatureSource::FeatureSource(const Archive& archive, long cycle, std::string name)
    : archive_(archive), cycle_(cycle), name_(std::move(name)) {
  std::vector<glm::dvec3> ways;
  for (const std::string& view : archive.views()) {
    for (const std::string_view kind : {kind::kSlicedFeatures, kind::kFeatures}) {
      const ArchiveRow* row = archive.find(cycle, view, name_, kind);
      if (!row) continue;
      header_ = archive.open(*row).header();
      if (kind == kind::kFeatures) continue;
      stackViews_.push_back(view);
      ways.push_back(header_.camera.forward);
    }
  }
  if (!header_.features) {
    throw Error(ErrorCode::NotFound,
                fmt::format("cycle {} has no features called '{}'", cycle, name_));
  }
  if (ways.empty()) return;
  for (const std::size_t i : mostDifferent(ways)) fused_.push_back(stackViews_[i]);
}

bool FeatureSource::finds(const Classifier& classifier) const {
  const FeatureOrigin& own = origin();
  if (classifier.kind() != own.classifier->kind() ||
      classifier.fields() != own.classifier->fields() ||
      classifier.channels() != own.classifier->channels()) {
    return false;
  }
  // In the same normalised values, so that rounding of JSON does not tell.
  const auto mine = own.classifier->normalised(own.domains)->parameters();
  const auto theirs = classifier.normalised(own.domains)->parameters();
  return std::equal(mine.begin(), mine.end(), theirs.begin(), theirs.end(),
                    [](const glm::vec4& a, const glm::vec4& b) {
                      return glm::all(glm::lessThanEqual(
                          glm::abs(a - b), 1e-5f * glm::max(glm::abs(a), glm::vec4(1e-3f))));
                    });
}

std::shared_ptr<const FeatureStack> FeatureSource::stack(const std::string& view) {
  for (auto kept = stacks_.begin(); kept != stacks_.end(); ++kept) {
    if (kept->first != view) continue;
    stacks_.splice(stacks_.begin(), stacks_, kept);
    return stacks_.front().second;
  }
  const ArchiveRow* row = archive_.find(cycle_, view, name_, kind::kSlicedFeatures);
  auto made = std::make_shared<const FeatureStack>(readFeatureStack(archive_.open(*row)));
  if (stacks_.size() >= kKept) stacks_.pop_back();
  stacks_.emplace_front(view, made);
  return made;
}

FeatureSource::Drawn FeatureSource::draw(const Look& look, const std::string& view,
                                         bool atStoredView, std::span<const ChannelOptics> optics,
                                         const Camera& camera, ImageSize size) {
  const bool lit = look.isLit() || look.ao.on;
  const bool flat = atStoredView && !lit && !look.needsGrid();
  if (flat && std::count(stackViews_.begin(), stackViews_.end(), view)) {
    const std::shared_ptr<const FeatureStack> held = stack(view);
    const FeatureStack& own = *held;
    RecomposedFeatures made = recomposed(own, optics, look.trust);
    return {std::move(made.picture),
            {},
            std::move(made.doubt),
            {},
            fmt::format("sliced features answer: opacity is exact slab by slab, the order of {} "
                        "features within one of {} slabs is interpolated",
                        optics.size(), own.slabs.size()),
            true};
  }
  // Whole rays tell one feature exactly, the order of several by a guess that stacks need not make.
  const auto visible = std::count_if(optics.begin(), optics.end(), [](const ChannelOptics& each) {
    return each.extinction > 0.0;
  });
  if (flat && (visible <= 1 || stackViews_.empty())) {
    if (const ArchiveRow* row = archive_.find(cycle_, view, name_, kind::kFeatures)) {
      RecomposedFeatures made =
          recomposed(featureImage(readImage(archive_.open(*row))), optics, look.trust);
      return {std::move(made.picture),
              {},
              std::move(made.doubt),
              {},
              "features answer: the opacity of each is exact, they are ordered by mean depth",
              true};
    }
  }
  if (stackViews_.empty()) {
    throw Error(
        ErrorCode::NotFound,
        fmt::format("features '{}' of cycle {} are stored as whole rays of views only: they "
                    "can be recoloured there, not {}",
                    name_, cycle_, lit ? "lit" : "seen from elsewhere"));
  }
  return drawGrid(look, optics, camera, size);
}

FeatureSource::Drawn FeatureSource::drawGrid(const Look& look,
                                             std::span<const ChannelOptics> optics,
                                             const Camera& camera, ImageSize size) {
  if (!weights_) {
    std::vector<FeatureStack> stacks;
    for (const std::string& view : fused_) stacks.push_back(*stack(view));
    weights_ = fusedFeatures(stacks);
  }
  if (!grid_ || !equal(drawn_, optics)) {
    grid_.reset();
    grid_ = weights_->optics(optics);
    drawn_.assign(optics.begin(), optics.end());
    painter_.forget();
  }
  const Box& domain = header_.domain;
  Look clipped = look;
  clipped.clip = domain;
  if (look.clip) {
    clipped.clip->low = glm::max(domain.low, look.clip->low);
    clipped.clip->high = glm::max(clipped.clip->low, glm::min(domain.high, look.clip->high));
  }
  const TransferFunction length =
      TransferFunction::ramp(0.0, 1.0, origin().referenceLength);  // of a slice's opacity
  VolumeView view = painter_.draw(*grid_, clipped, length, nullptr, domain, camera, size);
  if (look.trust) {
    view.doubt.assign(view.picture.size.pixels(), 0.0f);
    for (const double way : {-1.0, 1.0}) {
      LookGrid other = weights_->optics(optics, way);
      GridPainter painter;
      const Picture moved =
          painter.draw(other, clipped, length, nullptr, domain, camera, size).picture;
      raiseDoubt(view.doubt, view.picture, moved);
    }
  }
  std::string names;
  for (const std::string& each : fused_) names += (names.empty() ? "'" : ", '") + each + "'";
  return {std::move(view.picture),
          std::move(view.depth),
          std::move(view.doubt),
          std::move(view.guess),
          fmt::format("sliced features answer: {} {} as a grid of {} x {} x {} cells",
                      fused_.size() == 1 ? "stack" : "stacks", names, weights_->size.x,
                      weights_->size.y, weights_->size.z),
          false};
}

}  // namespace vestige
