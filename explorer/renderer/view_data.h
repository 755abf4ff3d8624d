// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "explorer/layers/analytic_layer_pass.h"
#include "explorer/layers/depth_layer_pass.h"
#include "explorer/layers/layers.h"
#include "explorer/layers/virtual_pass.h"
#include "explorer/picture/look.h"
#include "explorer/recomposition/edit_pass.h"
#include "explorer/stacks/stack_runs.h"
#include "explorer/volume/field_source.h"
#include "proxy/archive/archive.h"

namespace vestige {

/// The decoded proxies of one cycle, view and field, made when first asked for. Its GL objects are
/// made and destroyed inside Device::run.
class ViewData {
 public:
  ViewData(const Archive& archive, long cycle, std::string view, std::string field);

  bool has(std::string_view proxy) const;
  /// Whether the run made that proxy, if it is there, with parameters that depend on the place.
  bool isCustomized(std::string_view proxy) const;
  /// Whether there are intervals to recompose: lengths, or attenuation under one base function
  /// everywhere.
  bool recomposes() const;
  /// The header of any proxy of the view.
  const ProxyHeader& header() const { return header_; }

  const SegmentTextures& segments(Via via, Order order);
  /// The layers, and which layer stands for each channel (all -1 without a partition).
  const LayerTextures& layers();
  const std::vector<int>& layerOf();
  /// The isovalues of the layers; empty when they come from lengths.
  const std::vector<double>& isovalues();
  const IntervalPartition* partition() const;
  const AnalyticLayerTextures& layered();
  /// The lengths of a multi-perspective view as virtual rays meet them.
  const SheetTextures& sheets();
  ProxyImage image(std::string_view proxy) const;
  FieldSource& field();
  /// The stack of the view, and its segments in channels of `parts` an interval.
  const SlicedStack& stack();
  const SegmentTextures& stackSegments(int parts, Uncertain way);

 private:
  const ArchiveRow& row(std::string_view proxy) const;
  const LengthPlanes& lengths();
  void makeLayers();

  const Archive& archive_;
  long cycle_;
  std::string view_, field_;
  ProxyHeader header_;
  std::optional<IntervalPartition> partition_;
  std::optional<LengthPlanes> lengths_;
  std::map<std::pair<Via, Order>, std::unique_ptr<SegmentTextures>> segments_;
  std::unique_ptr<LayerTextures> layers_;
  std::unique_ptr<AnalyticLayerTextures> layered_;
  std::unique_ptr<SheetTextures> sheets_;
  std::unique_ptr<FieldSource> fieldSource_;
  std::unique_ptr<SlicedStack> stack_;
  std::map<std::pair<int, Uncertain>, std::unique_ptr<SegmentTextures>> stackSegments_;
  std::vector<int> layerOf_;
  std::vector<double> isovalues_;
};

/// Where a view of a step looks from, and what of it can be seen from elsewhere.
struct ViewSummary {
  std::string name;
  Camera camera;
  bool depth = false, length = false, layered = false;
};

/// The few views that were asked for last. Who holds a view keeps it: it outlives its place here,
/// but not the archive.
class ViewCache {
 public:
  static constexpr std::size_t kKept = 4;

  explicit ViewCache(const Archive& archive) : archive_(archive) {}
  std::shared_ptr<ViewData> get(long cycle, const std::string& view, const std::string& field);
  /// The views of a step's field, from headers alone: choosing among
  /// many decodes none of them.
  std::shared_ptr<const std::vector<ViewSummary>> summaries(long cycle, const std::string& field);

 private:
  struct Entry {
    long cycle;
    std::string view, field;
    std::shared_ptr<ViewData> data;
  };
  const Archive& archive_;
  std::list<Entry> entries_;  ///< the latest first
  std::shared_ptr<const std::vector<ViewSummary>> summaries_;
  std::pair<long, std::string> summarised_;
};

}  // namespace vestige
