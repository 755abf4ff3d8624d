// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <list>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "explorer/features/feature_grid.h"
#include "explorer/features/feature_recomposition.h"
#include "explorer/volume/grid_painter.h"
#include "proxy/archive/archive.h"

namespace vestige {

/// The features that a run integrated by a classifier: stacks of them, drawn from anywhere, and
/// whole rays at stored views. Made, used and destroyed in Device::run.
class FeatureSource {
 public:
  /// Whether the step has features of that name.
  static bool has(const Archive& archive, long cycle, const std::string& name);

  /// Throws NotFound when it has none.
  FeatureSource(const Archive& archive, long cycle, std::string name);

  bool is(long cycle, const std::string& name) const { return cycle == cycle_ && name == name_; }
  /// Of any of its proxies.
  const ProxyHeader& header() const { return header_; }
  const FeatureOrigin& origin() const { return *header_.features; }
  /// Whether a classifier, resolved, finds the same features whatever their looks.
  bool finds(const Classifier& classifier) const;

  struct Drawn {
    Picture picture;
    std::vector<float> depth;  ///< of grids; else empty
    std::vector<float> doubt;  ///< RecomposedFeatures::doubt; of grids: RenderedView::doubt
    std::vector<float> guess;  ///< of grids
    std::string note;          ///< who answers and how true, a sentence
    bool stored = false;       ///< in the pixels of the stored view; else those of `size`
  };
  /// `view`: that of the camera, if it is stored. [channel] optics. Throws Config for what cannot
  /// be drawn, NotFound where only stored views are there.
  Drawn draw(const Look& look, const std::string& view, bool atStoredView,
             std::span<const ChannelOptics> optics, const Camera& camera, ImageSize size);

 private:
  std::shared_ptr<const FeatureStack> stack(const std::string& view);
  Drawn drawGrid(const Look& look, std::span<const ChannelOptics> optics, const Camera& camera,
                 ImageSize size);

  const Archive& archive_;
  long cycle_;
  std::string name_;
  ProxyHeader header_;
  std::vector<std::string> stackViews_;
  static constexpr std::size_t kKept = 4;
  /// The stacks that were asked for last, the latest first.
  std::list<std::pair<std::string, std::shared_ptr<const FeatureStack>>> stacks_;
  std::vector<std::string> fused_;  ///< views whose stacks the grid is made of
  std::optional<FeatureGrid> weights_;
  std::optional<LookGrid> grid_;
  std::vector<ChannelOptics> drawn_;  ///< the grid's
  GridPainter painter_;
};

}  // namespace vestige
