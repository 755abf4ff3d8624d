// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/ingest/block_part.h"

#include <algorithm>

namespace vestige {
namespace {

/// Samples past a part's face: interpolation needs one, gradients at samples a second one.
constexpr int kGhosts = 2;

/// Samples of a texture whose part has so many cells along each axis; no fewer than of either
/// location.
std::int64_t textureSamples(const std::array<int, 3>& cells) {
  std::int64_t samples = 1;
  for (const int count : cells) samples *= count + 1 + 2 * kGhosts;
  return samples;
}

/// Pieces along each axis.
std::array<int, 3> piecesOf(const std::array<int, 3>& cells, const TextureLimits& limits) {
  std::array<int, 3> pieces{1, 1, 1};
  const auto cellsOf = [&](std::size_t a) { return (cells[a] + pieces[a] - 1) / pieces[a]; };
  for (std::size_t a = 0; a < 3; ++a) {
    const int most = std::max(1, limits.side - 1 - 2 * kGhosts);
    pieces[a] = std::max(1, (cells[a] + most - 1) / most);
  }
  while (textureSamples({cellsOf(0), cellsOf(1), cellsOf(2)}) > limits.samples) {
    const std::array<int, 3> size{cellsOf(0), cellsOf(1), cellsOf(2)};
    const auto longest = std::size_t(std::max_element(size.begin(), size.end()) - size.begin());
    if (size[longest] <= 1) break;
    ++pieces[longest];
  }
  return pieces;
}

}  // namespace

std::vector<BlockPart> splitBlock(const BlockSet& blocks, int index, const TextureLimits& limits) {
  const GridDescription& grid = blocks.at(index).grid;
  BlockPart all{index, {}, {}, true};
  std::array<int, 3> cells{};
  std::int64_t samples = 1;
  bool fits = true;
  for (std::size_t a = 0; a < 3; ++a) {
    all.first[a] = grid.ghosts[2 * a];
    all.last[a] = grid.points[a] - 1 - grid.ghosts[2 * a + 1];
    cells[a] = all.last[a] - all.first[a];
    samples *= grid.points[a];
    fits = fits && grid.points[a] <= limits.side;
  }
  if (fits && samples <= limits.samples) return {all};
  const auto pieces = piecesOf(cells, limits);
  const auto face = [&](std::size_t a, int piece) {
    return all.first[a] + int(std::int64_t(cells[a]) * piece / pieces[a]);
  };
  std::vector<BlockPart> parts;
  for (int z = 0; z < pieces[2]; ++z) {
    for (int y = 0; y < pieces[1]; ++y) {
      for (int x = 0; x < pieces[0]; ++x) {
        parts.push_back({index,
                         {face(0, x), face(1, y), face(2, z)},
                         {face(0, x + 1), face(1, y + 1), face(2, z + 1)},
                         false});
      }
    }
  }
  return parts;
}

Box ownedBox(const BlockSet& blocks, const BlockPart& part) {
  // The block's own faces: a domain without extent is thicker than its points.
  Box box = blocks.owned(part.block);
  const Block& block = blocks.at(part.block);
  for (std::size_t a = 0; a < 3 && !part.whole; ++a) {
    const auto& points = block.points[a];
    const int lowest = block.grid.ghosts[2 * a];
    const int highest = block.grid.points[a] - 1 - block.grid.ghosts[2 * a + 1];
    if (part.first[a] > lowest) box.low[int(a)] = points[std::size_t(part.first[a])];
    if (part.last[a] < highest) box.high[int(a)] = points[std::size_t(part.last[a])];
  }
  return box;
}

SampleRange samplesOf(const BlockSet& blocks, const BlockPart& part, Location location) {
  const auto all = blocks.at(part.block).samples(location);
  SampleRange range{{0, 0, 0}, all};
  // Cell i lies between the points i and i + 1.
  const int past = location == Location::Point ? 1 : 0;
  for (std::size_t a = 0; a < 3 && !part.whole; ++a) {
    range.low[a] = std::clamp(part.first[a] - kGhosts, 0, all[a] - 1);
    range.high[a] = std::clamp(part.last[a] + past + kGhosts, range.low[a] + 1, all[a]);
  }
  return range;
}

BlockGrid marchGrid(const BlockSet& blocks, const BlockPart& part, Location location) {
  const auto nodes = blocks.at(part.block).nodes(location);
  const SampleRange range = samplesOf(blocks, part, location);
  BlockGrid grid;
  for (std::size_t a = 0; a < 3; ++a) {
    grid.nodes[a].assign(nodes[a].begin() + range.low[a], nodes[a].begin() + range.high[a]);
  }
  grid.owned = ownedBox(blocks, part);
  return grid;
}

}  // namespace vestige
