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

/// Numbers at a seed, and interpolated ones at a node.
using NodeValues = std::array<float, 8>;

/// A stretch of nodes along x, [first, end), whose nearest seed is the same.
struct CellRun {
  int y = 0, z = 0, first = 0, end = 0;
  int seed = 0;
};

/// The discrete Voronoi cells of seeds on a grid (position-dependent-classification §5.2, Alg. 1):
/// runs that cover every node once, sorted by the seed's row, then z, y, x. Of seeds equally near
/// the first one counts. Distances are those of nodes' indices, squared if Euclidean: integers.
std::vector<CellRun> voronoiRuns(glm::ivec3 nodes, std::span<const GridSeed> seeds,
                                 SeedMetric metric, int threads = 0);

/// Discrete natural-neighbour (Sibson) interpolation on every node of a grid, cells clipped to it
/// (§4.3-5.2): at a seed, its own values; elsewhere the mean over the nodes v with
/// distance(q, v) <= distance(v, its seed) of the values of v's seed. Returns [node], x fastest.
///
/// Faster than the paper's Alg. 2, in which every node looks at every node, O(n^6): node v of the
/// cell of seed s counts for the nodes in the ball around v through s and for no others. Of a ball,
/// only the ends of its rows are noted, +1 and -1, and one running sum along x makes counts of all
/// of them: O(n^3 r^2) with r the mean radius of a cell, about n / (2 seeds^(1/3)). Counts are
/// integers and sums run in the order of the rows, so results do not depend on `threads` (0 = as
/// many as there are cores) and equal those of a direct count bit for bit.
///
/// At most one seed a node. Throws InvalidArgument naming a grid of no node or more than
/// kMostNodes an axis, no seeds at all, a seed outside the grid, two on one node, a row outside
/// `rows`.
inline constexpr int kMostNodes = 128;
std::vector<NodeValues> naturalNeighbours(glm::ivec3 nodes, std::span<const GridSeed> seeds,
                                          std::span<const NodeValues> rows, SeedMetric metric,
                                          int threads = 0);

}  // namespace vestige
