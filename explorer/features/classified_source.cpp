// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/features/classified_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "explorer/gpu/light.h"
#include "explorer/picture/trust.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

/// In cells: primitives are integrated along a step, gradients and the field's bends are not.
constexpr double kStep = 0.5;
constexpr double kOpaque = 1.0 / 512.0;
constexpr double kTolerance = 1.0 / 256.0;

}  // namespace

ClassifiedSource::ClassifiedSource(const Archive& archive, long cycle,
                                   const std::vector<std::string>& fields)
    : cycle_(cycle), bundle_(archive, cycle, fields) {}

void ClassifiedSource::prepareGrid(const Classifier& normalised) {
  const bool gradient = normalised.needsGradient();
  if (!grid_ || (gradient && !grid_->gradients)) {
    const std::vector<float> gradients = gradient ? bundle_.gradients() : std::vector<float>{};
    grid_.reset();
    grid_ = LookGrid::fields(bundle_.size, stretch_.sceneFromWorld() * bundle_.worldFromGrid,
                             bundle_.values, gradients, GridAxes(bundle_.nodes));
    grid_->low = bundle_.low;
    grid_->high = bundle_.high;
    key_.clear();
  }
}

void ClassifiedSource::findGradients(const ClassifiedLook& look) {
  const std::vector<double> density = look.classifier->densities();
  if (density.empty() && bundle_.fields.size() == 1) {
    // Surfaces of equal value, as smooth as the field where features are thinner than a cell.
    prepareFirst();
    first_->worldFromGrid = grid_->worldFromGrid;  // the painter places it for itself
    pass_.findGradients(*first_);
    first_->worldFromGrid = bundle_.worldFromGrid;
    grid_->gradient = std::move(first_->gradient);
    first_->gradient.reset();
    return;
  }
  ClassifiedLook densities = look;
  for (std::size_t i = 0; i < density.size(); ++i) densities.optics[i] = {density[i], {}};
  LookGrid grid = density.empty() ? std::move(*baked_) : pass_.baked(*grid_, densities);
  pass_.findGradients(grid);
  grid_->gradient = std::move(grid.gradient);
  if (density.empty()) baked_ = std::move(grid);
}

VolumeView ClassifiedSource::draw(const Look& look, const Classifier& classifier,
                                  double referenceLength, const Camera& camera, ImageSize size) {
  if (look.draw == Draw::Isosurface || look.draw == Draw::Mip) {
    throw Error(ErrorCode::Config,
                "look key 'draw': a classifier draws volume or slice; isosurfaces and MIP show one "
                "field");
  }
  const Stretch stretch(look.scale, bundle_.domain);
  if (stretch != stretch_) {
    stretch_ = stretch;
    grid_.reset();
  }
  const auto normalised = classifier.normalised(bundle_.domains);
  prepareGrid(*normalised);
  const std::string key = fmt::format("{} {}", classifier.json().dump(), referenceLength);
  if (key != key_) {
    VolumePass::findBricks(*grid_, *normalised);
    baked_.reset();
    occlusion_.reset();
    key_ = key;
  }
  const ClassifiedLook classified{normalised.get(), classifier.optics(referenceLength)};
  VolumeSetup setup;
  setup.camera = camera;
  setup.size = size;
  setup.mode = look.draw == Draw::Slice ? VolumeMode::Slice : VolumeMode::Compositing;
  setup.classified = &classified;
  setup.step = kStep;
  setup.opaque = kOpaque;
  setup.tolerance = kTolerance;
  // What stacks say ends at the domain.
  setup.clip = bundle_.domain;
  if (look.clip) {
    setup.clip->low = glm::max(bundle_.domain.low, look.clip->low);
    setup.clip->high = glm::max(setup.clip->low, glm::min(bundle_.domain.high, look.clip->high));
  }
  setup.clip = stretch.box(*setup.clip);
  setup.plane = look.slice
                    ? stretch.plane(*look.slice)
                    : glm::dvec4(camera.forward, glm::dot(camera.forward, bundle_.domain.center()));
  setup.sliceThickness = referenceLength;
  const LightSetup light = lightSetup(look, camera, camera, bundle_.domain);
  setup.light = &light;
  const bool volume = setup.mode == VolumeMode::Compositing;
  if (volume && (light.shade || look.ao.on) && !baked_) {
    baked_ = pass_.baked(*grid_, classified);
    findGradients(classified);
  }
  if (volume && look.ao.on) {
    const std::string radius = std::to_string(light.aoRadiusWorld);
    if (!occlusion_ || radius != occlusionKey_) {
      occlusion_ = pass_.occlusion(*baked_, light.aoRadiusWorld);
      occlusionKey_ = radius;
    }
    setup.occlusion = &*occlusion_;
  }
  CustomDrawing custom;
  if (look.isCustomized()) {
    if (look.customization->hasGamma() || !look.customization->functions().empty()) {
      throw Error(ErrorCode::Config,
                  "look key 'customization' changes gamma or blends to functions, which are of one "
                  "field: a classifier takes factors of opacity and shifts of colour");
    }
    if (!custom_ || !custom_->is(*look.customization, bundle_.domain))
      custom_.emplace(*look.customization, bundle_.domain);
    custom.textures = &*custom_;
    custom.worldFromScene = stretch.worldFromScene();
    setup.custom = &custom;
  }
  VolumeView view = pass_.render(*grid_, setup);
  if (look.trust && !bundle_.wrong.empty()) view.doubt = doubtOf(setup, view.picture);
  return view;
}

void ClassifiedSource::addDoubt(const Moved& moved, VolumeSetup setup, const Picture& likely,
                                std::vector<float>& doubt) {
  const bool gradient = setup.classified->classifier->needsGradient();
  std::vector<float> most(doubt.size(), 0.0f);
  for (const double way : {-1.0, 1.0}) {
    std::vector<float> values = bundle_.values, norms;
    if (gradient) norms = bundle_.gradients();
    moved(way, values, norms);
    LookGrid other = LookGrid::fields(bundle_.size, grid_->worldFromGrid, values, norms,
                                      GridAxes(bundle_.nodes));
    other.low = grid_->low;
    other.high = grid_->high;
    other.gradient = std::move(grid_->gradient);
    VolumePass::findBricks(other, *setup.classified->classifier);
    const Picture picture = pass_.render(other, setup).picture;
    grid_->gradient = std::move(other.gradient);
    raiseDoubt(most, likely, picture);
  }
  for (std::size_t i = 0; i < doubt.size(); ++i) doubt[i] += most[i];
}

std::vector<float> ClassifiedSource::doubtOf(const VolumeSetup& setup, const Picture& likely) {
  std::vector<float> doubt(likely.size.pixels(), 0.0f);
  for (std::size_t j = 0; j < bundle_.fields.size(); ++j) {
    addDoubt(
        [&](double way, std::vector<float>& values, std::vector<float>&) {
          for (std::size_t i = 0; i < values.size() / 4; ++i)
            values[4 * i + j] += float(way * bundle_.wrong[j].at(i));
        },
        setup, likely, doubt);
  }
  if (!setup.classified->classifier->needsGradient()) return doubt;
  const std::vector<float> far = bundle_.gradientsWrong();
  addDoubt(
      [&](double way, std::vector<float>&, std::vector<float>& norms) {
        for (std::size_t i = 0; i < norms.size(); ++i)
          norms[i] = std::max(norms[i] + float(way) * far[i], 0.0f);
      },
      setup, likely, doubt);
  return doubt;
}

void ClassifiedSource::prepareFirst() {
  if (first_) return;
  std::vector<float> values(bundle_.values.size() / 4);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = bundle_.values[4 * i];
  first_ = LookGrid::scalar(bundle_.size, bundle_.worldFromGrid, values, GridAxes(bundle_.nodes));
  first_->low = bundle_.low;
  first_->high = bundle_.high;
  const FieldDomain& domain = bundle_.domains.front();
  first_->valueZero = domain.low + first_->valueZero * domain.range();
  first_->valueUnit *= domain.range();
  if (bundle_.wrong.empty()) return;
  const FieldBundle::Wrong& wrong = bundle_.wrong.front();
  const double texels = wrong.unit * domain.range() / first_->valueUnit;
  wrong.share.empty() ? first_->setWrong(texels) : first_->setWrong(wrong.share, texels);
}

VolumeView ClassifiedSource::drawMaximum(const Look& look, const TransferFunction& function,
                                         const Camera& camera, ImageSize size) {
  prepareFirst();
  Look maximum = look;
  maximum.draw = Draw::Mip;
  return painter_.draw(*first_, maximum, function, nullptr, bundle_.domain, camera, size);
}

std::string ClassifiedSource::note() const {
  return fmt::format("uses the classifier on {} x {} x {} samples: {}", bundle_.size.x,
                     bundle_.size.y, bundle_.size.z, bundle_.note);
}

}  // namespace vestige
