// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "explorer/volume/look_grid.h"
#include "proxy/format/layout/feature_layout.h"

namespace vestige {

/// The weights of a classifier's channels on a grid, from stacks of one or more directions.
struct FeatureGrid {
  /// Most cells times channels.
  static constexpr std::size_t kMostWeights = std::size_t(1) << 26;

  glm::ivec3 size{0};
  glm::dmat4 worldFromGrid{1.0};
  std::size_t channels = 0;
  std::vector<float> weights;  ///< [cell][channel], x fastest; 0 outside of the domain
  /// [cell][channel] how far they may be wrong, 255 = 1: by as much as slabs beside each other
  /// differ in the stack that places them best.
  std::vector<std::uint8_t> wrong;

  /// The optics of the cells under a look, to be drawn, with weights moved by `doubt` times what
  /// they may be wrong by. [channel] optics.
  LookGrid optics(std::span<const ChannelOptics> optics, double doubt = 0.0) const;
};

/// Weights that agree with what every stack stores: starting from the first stack's slabs, each
/// channel is scaled, stack after stack, so that in every cell of a stack (pixel and slab) its mean
/// is the stored one (multiplicative reconstruction; Gordon, Bender and Herman 1970). Each stack is
/// coarse along its own rays only, so that three across one another place a feature to about a
/// pixel. The grid is the first stack's: its pixels, and cells about as deep as wide.
FeatureGrid fusedFeatures(std::span<const FeatureStack> stacks);

}  // namespace vestige
