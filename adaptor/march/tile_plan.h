// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/vec4.hpp>
#include <optional>
#include <span>
#include <vector>

#include "adaptor/volume/brick_grid.h"
#include "adaptor/volume/march_setup.h"

namespace vestige {

/// The background of a block: what most of its bricks hold. Rays that meet nothing else need no
/// march. One channel, transparent, on one side of every isovalue.
struct Background {
  int channel;
  float high;  ///< largest value, normalised
};

/// The tiles of a picture, in rows from the top, by what is to be done in them.
struct TilePlan {
  static constexpr int kTile = 8;  ///< pixels a side

  /// How many rows of pixels to march and read back at once, whole tiles: 16 MiB at most, or one
  /// row of tiles. rowBytes: of all planes of a row.
  static int bandRows(int height, std::size_t rowBytes);

  std::optional<Background> background;
  /// (tile x, tile y, z, z): between these two depths of the frame rays of the tile may meet
  /// something other than the background; before and after they do not.
  std::vector<glm::vec4> marched;
  std::vector<glm::vec4> empty;  ///< nothing but the background, or nothing at all

  /// `texels`: the bricks as BrickGrid::texels makes them. Where fewer than one brick in twenty is
  /// of the commonest kind, or where rays in the background may still differ in the MIP that is
  /// requested, every tile is marched.
  TilePlan(const BrickGrid& bricks, std::span<const glm::vec4> texels, const BlockGrid& grid,
           const MarchFrame& frame, const MarchRequest& request);
};

}  // namespace vestige
