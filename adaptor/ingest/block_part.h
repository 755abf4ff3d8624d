// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "adaptor/ingest/block_set.h"

namespace vestige {

/// What a device's texture can hold.
struct TextureLimits {
  int side = 2048;                               ///< samples along each axis
  std::int64_t samples = std::int64_t(1) << 28;  ///< in all: llvmpipe takes 1 GiB
};

/// A box of a block that fits in a texture, between two of its own points along each axis. Parts
/// are marched as blocks are; their ghosts are the block's own samples.
struct BlockPart {
  int block = 0;
  std::array<int, 3> first{}, last{};  ///< points
  bool whole = true;                   ///< all of the block, with the host's ghosts
  friend bool operator==(const BlockPart&, const BlockPart&) = default;
};

/// The parts of a block that is not empty: itself if it fits, else boxes of about equal size that
/// share faces.
std::vector<BlockPart> splitBlock(const BlockSet& blocks, int index, const TextureLimits& limits);
/// As BlockSet::owned.
Box ownedBox(const BlockSet& blocks, const BlockPart& part);
/// The block's samples that are in the part's texture, ghosts included.
SampleRange samplesOf(const BlockSet& blocks, const BlockPart& part, Location location);
/// The grid of these samples.
BlockGrid marchGrid(const BlockSet& blocks, const BlockPart& part, Location location);

}  // namespace vestige
