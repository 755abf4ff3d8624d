// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/renderer/view_data.h"

#include <array>

#include "explorer/stacks/stack_segments.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

constexpr std::array kKinds{kind::kLength,    kind::kAttenuation,   kind::kSliced,  kind::kDepth,
                            kind::kReference, kind::kMip,           kind::kLayered, kind::kField,
                            kind::kFeatures,  kind::kSlicedFeatures};

}  // namespace

ViewData::ViewData(const Archive& archive, long cycle, std::string view, std::string field)
    : archive_(archive), cycle_(cycle), view_(std::move(view)), field_(std::move(field)) {
  bool found = false;
  for (std::string_view name : kKinds) {
    const ArchiveRow* row = archive_.find(cycle_, view_, field_, name);
    if (!row) continue;
    ProxyHeader header = archive_.open(*row).header();
    if (name == kind::kField) header.size = ImageSize{};  // its file's picture is a stream of bytes
    if (!found) header_ = header;
    found = true;
    if (header.partition) {
      partition_ = header.partition;
      return;
    }
  }
  if (!found) {
    throw Error(ErrorCode::NotFound, "cycle " + std::to_string(cycle_) +
                                         " has no proxy of field '" + field_ + "' in view '" +
                                         view_ + "'");
  }
}

bool ViewData::has(std::string_view proxy) const {
  return archive_.find(cycle_, view_, field_, proxy) != nullptr;
}

bool ViewData::isCustomized(std::string_view proxy) const {
  return has(proxy) && archive_.open(row(proxy)).header().customization.has_value();
}

bool ViewData::recomposes() const {
  return has(kind::kLength) || (has(kind::kAttenuation) && !isCustomized(kind::kAttenuation));
}

const ArchiveRow& ViewData::row(std::string_view proxy) const {
  const ArchiveRow* row = archive_.find(cycle_, view_, field_, proxy);
  if (!row) {
    throw Error(ErrorCode::NotFound, "cycle " + std::to_string(cycle_) + ", view '" + view_ +
                                         "', field '" + field_ + "' has no " + std::string(proxy) +
                                         " proxy");
  }
  return *row;
}

ProxyImage ViewData::image(std::string_view proxy) const {
  return readImage(archive_.open(row(proxy)));
}

const SlicedStack& ViewData::stack() {
  if (!stack_) {
    stack_ = std::make_unique<SlicedStack>(readStack(archive_.open(row(kind::kSliced))));
  }
  return *stack_;
}

const SegmentTextures& ViewData::stackSegments(int parts, Uncertain way) {
  auto& textures = stackSegments_[{parts, way}];
  if (textures) return *textures;
  const ProxyHeader& header = stack().header;
  const double diagonal = header.domain.diagonal();
  textures = std::make_unique<SegmentTextures>(
      segmentsOfRuns(runsOfStack(stack(), way), FineChannels(*header.partition, parts),
                     header.statistics, diagonal > 0.0 ? diagonal : 1.0));
  return *textures;
}

FieldSource& ViewData::field() {
  if (!fieldSource_) fieldSource_ = std::make_unique<FieldSource>(image(kind::kField));
  return *fieldSource_;
}

const IntervalPartition* ViewData::partition() const { return partition_ ? &*partition_ : nullptr; }

const AnalyticLayerTextures& ViewData::layered() {
  if (!layered_) {
    const ProxyImage stored = image(kind::kLayered);
    layered_ = std::make_unique<AnalyticLayerTextures>(stored.header, layeredPlanes(stored));
  }
  return *layered_;
}

const SheetTextures& ViewData::sheets() {
  if (!sheets_) sheets_ = std::make_unique<SheetTextures>(lengths());
  return *sheets_;
}

const LengthPlanes& ViewData::lengths() {
  if (!lengths_) lengths_ = readLengthPlanes(archive_.open(row(kind::kLength)));
  return *lengths_;
}

const SegmentTextures& ViewData::segments(Via via, Order order) {
  // Attenuation has one global order, whatever is asked for.
  const std::pair key{via,
                      via == Via::Attenuation ? Order::Mean : resolvedOrder(order, header_.size)};
  auto& textures = segments_[key];
  if (textures) return *textures;
  if (via == Via::Attenuation) {
    const AttenuationPlanes planes = attenuationPlanes(image(kind::kAttenuation));
    const std::vector<int> nested = nestedOrder(planes.partition());
    textures = std::make_unique<SegmentTextures>(segmentsFromAttenuation(planes, nested));
  } else {
    textures = std::make_unique<SegmentTextures>(segmentsFromLength(lengths(), order));
  }
  return *textures;
}

void ViewData::makeLayers() {
  if (layers_) return;
  if (has(kind::kDepth)) {
    DepthLayers decoded = depthLayers(image(kind::kDepth));
    isovalues_ = decoded.header.isovalues;
    layerOf_ = partition_ ? layerOfChannels(*partition_, isovalues_) : std::vector<int>{};
    const LengthPlanes* complete = has(kind::kLength) ? &lengths() : nullptr;
    layers_ =
        std::make_unique<LayerTextures>(completedLayers(std::move(decoded), complete, layerOf_));
  } else {
    layers_ = std::make_unique<LayerTextures>(layersFromLengths(lengths(), layerOf_));
  }
}

const LayerTextures& ViewData::layers() {
  makeLayers();
  return *layers_;
}

const std::vector<int>& ViewData::layerOf() {
  makeLayers();
  return layerOf_;
}

const std::vector<double>& ViewData::isovalues() {
  makeLayers();
  return isovalues_;
}

std::shared_ptr<ViewData> ViewCache::get(long cycle, const std::string& view,
                                         const std::string& field) {
  for (auto entry = entries_.begin(); entry != entries_.end(); ++entry) {
    if (entry->cycle == cycle && entry->view == view && entry->field == field) {
      entries_.splice(entries_.begin(), entries_, entry);
      return entries_.front().data;
    }
  }
  auto data = std::make_shared<ViewData>(archive_, cycle, view, field);
  if (entries_.size() >= kKept) entries_.pop_back();
  entries_.push_front({cycle, view, field, data});
  return data;
}

std::shared_ptr<const std::vector<ViewSummary>> ViewCache::summaries(long cycle,
                                                                     const std::string& field) {
  if (summaries_ && summarised_ == std::pair(cycle, field)) return summaries_;
  auto made = std::make_shared<std::vector<ViewSummary>>();
  for (const std::string& name : archive_.views()) {
    const auto stored = [&](std::string_view proxy) {
      return archive_.find(cycle, name, field, proxy);
    };
    const ArchiveRow *depth = stored(kind::kDepth), *length = stored(kind::kLength),
                     *layered = stored(kind::kLayered);
    const ArchiveRow* any = length ? length : depth ? depth : layered;
    for (const ArchiveRow& row : archive_.rows()) {
      if (any || name == kFieldView) break;
      if (row.cycle == cycle && row.view == name && row.field == field) any = &row;
    }
    if (!any) continue;
    made->push_back({name, archive_.open(*any).header().camera, depth != nullptr, length != nullptr,
                     layered != nullptr});
  }
  summaries_ = std::move(made);
  summarised_ = {cycle, field};
  return summaries_;
}

}  // namespace vestige
