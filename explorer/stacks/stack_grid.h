// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "explorer/stacks/stack_runs.h"
#include "explorer/volume/look_grid.h"
#include "proxy/format/image/proxy_image.h"

namespace vestige {

/// The field of a stack on a grid over its slabs: cells are pixels times equal depths, about cubic
/// as far as kMostCells allows.
struct StackSamples {
  /// Most cells of a grid; 4 bytes each here and on the GPU.
  static constexpr std::size_t kMostCells = std::size_t(1) << 25;

  glm::ivec3 size{0};
  glm::dmat4 worldFromGrid{1.0};
  double unit = 1.0, zero = 0.0;  ///< value = number * unit + zero
  std::vector<float> values;      ///< x fastest; NaN = no data, or outside of the domain
  /// How far each may be wrong, in kWrongUnit; empty = not at all. Of a stack: hypot(change, doubt)
  /// of fusedStacks. Of several: what it is of the surest, and how far they disagree, as hypot.
  std::vector<std::uint8_t> wrong;
  static constexpr float kWrongUnit = 1.0f / 512.0f;

  LookGrid upload() const;
};

/// Samples the profile (RunProfile) of every ray. Cells of rays that miss the domain, but are
/// neighbours of rays that do not, have their values, and rays go on as they enter and leave, so
/// that interpolation does not fade at the domain's faces; draw with the domain as clip box. Throws
/// InvalidArgument for a view of more pixels than kMostCells.
StackSamples sampledStack(const ProxyHeader& header, const RunLists& runs);

/// One field from several stacks of it, on the grid of the first. Each cell takes the median of the
/// stacks' values, weighted by 1 / (change^2 + doubt^2 + (1 / 128 of the range)^2) and interpolated
/// between them. Change: along its own rays a stack is uncertain by as much as its values change
/// within an eighth of a slab, so edges that one stack sees head on are placed by those that see
/// them from the side; doubt: how far a run says where in its interval the value is
/// (ProfileSegment::doubt). The same grid when there is one stack.
StackSamples fusedStacks(std::vector<StackSamples> stacks);

}  // namespace vestige
