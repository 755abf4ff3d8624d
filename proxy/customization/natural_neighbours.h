// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace vestige {

enum class SeedMetric { Euclidean, Manhattan };

/// A seed that stands on a node of the grid and the row of values that it carries. Seeds of equal
/// values should share a row: what is interpolated is summed row by row.
struct GridSeed {
  glm::ivec3 node{0};
  int row = 0;
  friend bool operator==(const GridSeed&, const GridSeed&) = default;
};

/// Numbers at a seed, finite, and interpolated ones at a node.
using NodeValues = std::array<float, 8>;

/// A stretch of nodes along x, [first, end), whose nearest seed is the same.
struct CellRun {
  int y = 0, z = 0, first = 0, end = 0;
  int seed = 0;
};

/// The discrete Voronoi cells of seeds on a grid [Brix 2015, §5.2, Alg. 1]:
/// runs that cover every node once, sorted by the seed's row, then z, y, x. Of seeds equally near
/// the first one counts. Distances are those of nodes' indices, squared if Euclidean: integers.
std::vector<CellRun> voronoiRuns(glm::ivec3 nodes, std::span<const GridSeed> seeds,
                                 SeedMetric metric, int threads = 0);

/// At most one seed a node. Throws InvalidArgument naming a grid of no node or more than
/// kMostNodes an axis, no seeds at all, a seed outside the grid, two on one node, a row outside the
/// `rows` that there are.
inline constexpr int kMostNodes = 128;
void requireSeeds(glm::ivec3 nodes, std::span<const GridSeed> seeds, std::size_t rows);

/// Discrete natural-neighbour [Sibson 1981] interpolation on every node of a grid, cells clipped to
/// it (§4.3-5.2): at a seed, its own values; elsewhere the mean over the nodes v with distance(q,
/// v) <= distance(v, its seed) of the values of v's seed. Returns [node], x fastest.
///
/// Faster than the paper's Alg. 2, in which every node looks at every node, O(n^6): a run of a cell
/// counts for one row of nodes at once, by a table of thresholds (cell_counts.h), and only for the
/// rows that the balls around its nodes through their seed reach: O(n^2 runs r^2) vectors, r the
/// mean radius of a cell and `runs` the cells that a line along x crosses. Counts are integers and
/// sums run in the order of the rows, so results do not depend on `threads` (0 = as many as there
/// are cores) nor on the processor, and equal those of a direct count bit for bit.
///
/// Throws as requireSeeds.
std::vector<NodeValues> naturalNeighbours(glm::ivec3 nodes, std::span<const GridSeed> seeds,
                                          std::span<const NodeValues> rows, SeedMetric metric,
                                          int threads = 0);

}  // namespace vestige
