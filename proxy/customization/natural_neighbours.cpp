// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/customization/natural_neighbours.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "proxy/base/cpu_dispatch.h"
#include "proxy/base/error.h"
#include "proxy/base/parallel.h"
#include "proxy/customization/cell_counts.h"

namespace vestige {
namespace {

std::size_t indexIn(glm::ivec3 nodes, glm::ivec3 p) {
  return std::size_t((p.z * nodes.y + p.y) * nodes.x + p.x);
}

void requireGrid(glm::ivec3 nodes, std::span<const GridSeed> seeds) {
  for (int axis = 0; axis < 3; ++axis) {
    if (nodes[axis] >= 1 && nodes[axis] <= kMostNodes) continue;
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("seeds are interpolated on 1 to {} nodes an axis, not {} x {} x {}",
                            kMostNodes, nodes.x, nodes.y, nodes.z));
  }
  if (seeds.empty()) {
    throw Error(ErrorCode::InvalidArgument, "there are no seeds to interpolate between");
  }
  for (const GridSeed& seed : seeds) {
    const glm::ivec3 p = seed.node;
    if (p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x < nodes.x && p.y < nodes.y && p.z < nodes.z)
      continue;
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("a seed at node {}, {}, {} is outside a grid of {} x {} x {}", p.x, p.y,
                            p.z, nodes.x, nodes.y, nodes.z));
  }
}

/// The nearest seed of every node of a row along x.
VESTIGE_CPU_DISPATCH void nearestInRow(std::span<const GridSeed> seeds, SeedMetric metric, int y,
                                       int z, std::span<int> distance, std::span<int> nearest) {
  std::fill(distance.begin(), distance.end(), std::numeric_limits<int>::max());
  const int count = int(distance.size());
  for (int s = 0; s < int(seeds.size()); ++s) {
    const glm::ivec3 p = seeds[std::size_t(s)].node;
    const int across = measured(metric, y - p.y) + measured(metric, z - p.z);
    for (int x = 0; x < count; ++x) {
      const int d = across + measured(metric, x - p.x);
      const bool nearer = d < distance[std::size_t(x)];
      distance[std::size_t(x)] = nearer ? d : distance[std::size_t(x)];
      nearest[std::size_t(x)] = nearer ? s : nearest[std::size_t(x)];
    }
  }
}

VESTIGE_CPU_DISPATCH void addCounts(int* counts, const int* more, int count) {
  for (int i = 0; i < count; ++i) counts[i] += more[i];
}

/// Products are exact, so that fusing them with the sum changes nothing.
VESTIGE_CPU_DISPATCH void addProducts(double* sums, const int* counts, double value, int count) {
  for (int i = 0; i < count; ++i) sums[i] += double(counts[i]) * value;
}

/// Counts of nodes and sums of values over them in one slice.
class SliceSums {
 public:
  /// Only channels that vary are summed: the mean of equal numbers is exactly that number, because
  /// counts times floats, and sums of them, fit a double.
  SliceSums(const CellCounts& cells, std::span<const NodeValues> rows)
      : nodes_(cells.nodes()), rows_(rows) {
    const NodeValues& first = rows[std::size_t(cells.cells().front().seed.row)];
    for (std::size_t c = 0; c < first.size(); ++c) constant_[c] = first[c] + 0.0f;  // no -0
    for (std::size_t c = 0; c < first.size(); ++c) {
      const bool varies = std::any_of(cells.cells().begin(), cells.cells().end(),
                                      [&](const CellCounts::Cell& cell) {
                                        return rows[std::size_t(cell.seed.row)][c] != first[c];
                                      });
      if (varies) channels_.push_back(c);
    }
    const std::size_t plane = std::size_t(nodes_.x) * std::size_t(nodes_.y);
    counts_.resize(plane);
    sums_.assign(channels_.size(), std::vector<double>(plane));
  }

  void add(SliceCounter& counter, int valueRow) {
    const NodeValues& values = rows_[std::size_t(valueRow)];
    for (int y = counter.lowest(); y <= counter.highest(); ++y) {
      const int* more = counter.row(y);
      const std::size_t at = std::size_t(y) * std::size_t(nodes_.x);
      addCounts(&counts_[at], more, nodes_.x);
      for (std::size_t i = 0; i < channels_.size(); ++i)
        addProducts(&sums_[i][at], more, double(values[channels_[i]]), nodes_.x);
    }
  }

  void writeMeans(NodeValues* to) const {
    for (std::size_t node = 0; node < counts_.size(); ++node) {
      to[node] = constant_;
      for (std::size_t i = 0; i < channels_.size(); ++i)
        to[node][channels_[i]] = float(sums_[i][node] / counts_[node]);
    }
  }

 private:
  glm::ivec3 nodes_;
  std::span<const NodeValues> rows_;
  NodeValues constant_{};
  std::vector<std::size_t> channels_;
  std::vector<int> counts_;
  std::vector<std::vector<double>> sums_;
};

}  // namespace

std::vector<CellRun> voronoiRuns(glm::ivec3 nodes, std::span<const GridSeed> seeds,
                                 SeedMetric metric, int threads) {
  requireGrid(nodes, seeds);
  std::vector<std::vector<CellRun>> slices{std::size_t(nodes.z)};
  parallelFor(nodes.z, threads, [&](int z) {
    std::vector<int> distance(std::size_t(nodes.x)), nearest(std::size_t(nodes.x));
    std::vector<CellRun>& mine = slices[std::size_t(z)];
    for (int y = 0; y < nodes.y; ++y) {
      nearestInRow(seeds, metric, y, z, distance, nearest);
      for (int x = 0; x < nodes.x; ++x) {
        const int seed = nearest[std::size_t(x)];
        if (x == 0 || mine.back().seed != seed) mine.push_back({y, z, x, x, seed});
        mine.back().end = x + 1;
      }
    }
  });
  std::vector<CellRun> runs;
  for (const auto& slice : slices) runs.insert(runs.end(), slice.begin(), slice.end());
  std::stable_sort(runs.begin(), runs.end(), [&](const CellRun& a, const CellRun& b) {
    return seeds[std::size_t(a.seed)].row < seeds[std::size_t(b.seed)].row;
  });
  return runs;
}

void requireSeeds(glm::ivec3 nodes, std::span<const GridSeed> seeds, std::size_t rows) {
  requireGrid(nodes, seeds);
  std::vector<bool> taken(std::size_t(nodes.x) * std::size_t(nodes.y) * std::size_t(nodes.z));
  for (const GridSeed& seed : seeds) {
    if (seed.row < 0 || std::size_t(seed.row) >= rows) {
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("a seed has row {} of {}", seed.row, rows));
    }
    const std::size_t at = indexIn(nodes, seed.node);
    if (taken[at]) {
      throw Error(ErrorCode::InvalidArgument, fmt::format("two seeds stand on node {}, {}, {}",
                                                          seed.node.x, seed.node.y, seed.node.z));
    }
    taken[at] = true;
  }
}

std::vector<NodeValues> naturalNeighbours(glm::ivec3 nodes, std::span<const GridSeed> seeds,
                                          std::span<const NodeValues> rows, SeedMetric metric,
                                          int threads) {
  requireSeeds(nodes, seeds, rows.size());
  const std::vector<CellRun> runs = voronoiRuns(nodes, seeds, metric, threads);
  const std::size_t plane = std::size_t(nodes.x) * std::size_t(nodes.y);
  const CellCounts cells(nodes, metric, seeds, runs);
  std::vector<NodeValues> result(plane * std::size_t(nodes.z));
  parallelFor(nodes.z, threads, [&](int z) {
    SliceCounter counter(cells);
    SliceSums sums(cells, rows);
    for (const CellCounts::Cell& cell : cells.cells()) {
      counter.add(cell, z);
      const bool last = &cell == &cells.cells().back() || (&cell + 1)->seed.row != cell.seed.row;
      if (!last) continue;
      sums.add(counter, cell.seed.row);
      counter.clear();
    }
    sums.writeMeans(&result[std::size_t(z) * plane]);
  });
  for (const GridSeed& seed : seeds)
    result[indexIn(nodes, seed.node)] = rows[std::size_t(seed.row)];
  return result;
}

}  // namespace vestige
