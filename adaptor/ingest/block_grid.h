// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "proxy/camera/box.h"

namespace vestige {

/// The samples of one block: where they stand and which part of the domain the block answers for.
/// Values between samples are trilinear; beyond the outermost samples they are clamped.
struct BlockGrid {
  std::array<std::vector<double>, 3> nodes;  ///< per axis, strictly increasing, ghosts included
  Box owned;  ///< world; the owned boxes of all blocks tile the domain

  std::array<int, 3> size() const {
    return {int(nodes[0].size()), int(nodes[1].size()), int(nodes[2].size())};
  }
  bool empty() const { return nodes[0].empty() || nodes[1].empty() || nodes[2].empty(); }
};

}  // namespace vestige
