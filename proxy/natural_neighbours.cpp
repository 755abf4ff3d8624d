// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/natural_neighbours.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <thread>

#include "proxy/error.h"

namespace vestige {
namespace {

/// work(i) for all i in [0, count), the next free thread taking the next i.
void forEach(int count, int threads, const std::function<void(int)>& work) {
  const int most = threads > 0 ? threads : std::max(1, int(std::thread::hardware_concurrency()));
  std::atomic<int> next{0};
  const auto run = [&] {
    for (int i = next++; i < count; i = next++) work(i);
  };
  std::vector<std::jthread> others;
  for (int i = 1; i < std::min(most, count); ++i) others.emplace_back(run);
  run();
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

int measured(SeedMetric metric, int d) {
  return metric == SeedMetric::Euclidean ? d * d : std::abs(d);
}

/// The nearest seed of every node of a row along x.
void nearestInRow(std::span<const GridSeed> seeds, SeedMetric metric, int y, int z,
                  std::span<int> distance, std::span<int> nearest) {
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

/// floor(sqrt(i)) for every squared distance in a grid.
std::vector<std::int16_t> rootTable(glm::ivec3 nodes) {
  const glm::ivec3 last = nodes - 1;
  std::vector<std::int16_t> roots(
      std::size_t(last.x * last.x + last.y * last.y + last.z * last.z + 1));
  for (int root = 0, i = 0; i < int(roots.size()); ++i) {
    if ((root + 1) * (root + 1) <= i) ++root;
    roots[std::size_t(i)] = std::int16_t(root);
  }
  return roots;
}

/// The counts of one row of values in one slice of constant z.
class SliceCounter {
 public:
  SliceCounter(glm::ivec3 nodes, SeedMetric metric, const std::vector<std::int16_t>& roots)
      : nodes_(nodes),
        metric_(metric),
        roots_(roots),
        stride_(nodes.x + 1),
        changes_(std::size_t(stride_ * nodes.y)) {}

  /// Notes, for every node of a run, the ends of the rows in which its ball cuts slice z.
  void note(const CellRun& run, glm::ivec3 seed, int z) {
    const int across = measured(metric_, run.y - seed.y) + measured(metric_, run.z - seed.z) -
                       measured(metric_, run.z - z);
    for (int x = run.first; x < run.end; ++x) {
      const int rest = across + measured(metric_, x - seed.x);
      if (rest < 0) continue;
      if (metric_ == SeedMetric::Euclidean) {
        const std::int16_t* roots = &roots_[std::size_t(rest)];
        noteBall(x, run.y, *roots, [roots](int dy) { return int(roots[-dy * dy]); });
      } else {
        noteBall(x, run.y, rest, [rest](int dy) { return rest - dy; });
      }
    }
  }

  /// Turns what was noted into counts, passes those that are not 0 to take(node in slice, count)
  /// and forgets everything.
  template <typename Take>
  void takeCounts(const Take& take) {
    for (int y = lowest_; y <= highest_; ++y) {
      int* row = &changes_[std::size_t(y * stride_)];
      int count = 0;
      for (int x = 0; x < nodes_.x; ++x) {
        count += row[x];
        if (count != 0) take(y * nodes_.x + x, count);
      }
      std::fill(row, row + stride_, 0);
    }
    lowest_ = kMostNodes;
    highest_ = -1;
  }

 private:
  /// half(|dy|): how far the ball reaches along x in the row dy away.
  template <typename Half>
  void noteBall(int x, int y, int reach, const Half& half) {
    const int below = std::min(reach, y), above = std::min(reach, nodes_.y - 1 - y);
    lowest_ = std::min(lowest_, y - below);
    highest_ = std::max(highest_, y + above);
    const std::ptrdiff_t stride = stride_;
    const int end = nodes_.x;
    const auto note = [&](int* row, int h) {
      ++row[std::max(x - h, 0)];
      --row[std::min(x + h + 1, end)];
    };
    int* up = &changes_[std::size_t(y * stride)];
    int* down = up;
    note(up, half(0));
    // The rows on both sides have the same ends.
    const int both = std::min(below, above), most = std::max(below, above);
    for (int dy = 1; dy <= both; ++dy) {
      const int h = half(dy);
      note(up += stride, h);
      note(down -= stride, h);
    }
    const std::ptrdiff_t way = below > above ? -stride : stride;
    int* further = below > above ? down : up;
    for (int dy = both + 1; dy <= most; ++dy) note(further += way, half(dy));
  }

  glm::ivec3 nodes_;
  SeedMetric metric_;
  const std::vector<std::int16_t>& roots_;
  int stride_, lowest_ = kMostNodes, highest_ = -1;
  std::vector<int> changes_;
};

using Sums = std::array<double, std::tuple_size_v<NodeValues>>;

}  // namespace

std::vector<CellRun> voronoiRuns(glm::ivec3 nodes, std::span<const GridSeed> seeds,
                                 SeedMetric metric, int threads) {
  requireGrid(nodes, seeds);
  std::vector<std::vector<CellRun>> slices{std::size_t(nodes.z)};
  forEach(nodes.z, threads, [&](int z) {
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

std::vector<NodeValues> naturalNeighbours(glm::ivec3 nodes, std::span<const GridSeed> seeds,
                                          std::span<const NodeValues> rows, SeedMetric metric,
                                          int threads) {
  const std::vector<CellRun> runs = voronoiRuns(nodes, seeds, metric, threads);
  const std::size_t plane = std::size_t(nodes.x) * std::size_t(nodes.y);
  std::vector<std::uint8_t> taken(plane * std::size_t(nodes.z));
  const auto indexOf = [&](glm::ivec3 p) {
    return std::size_t(p.z) * plane + std::size_t(p.y * nodes.x + p.x);
  };
  for (const GridSeed& seed : seeds) {
    if (seed.row < 0 || std::size_t(seed.row) >= rows.size()) {
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("a seed has row {} of {}", seed.row, rows.size()));
    }
    if (taken[indexOf(seed.node)]++) {
      throw Error(ErrorCode::InvalidArgument, fmt::format("two seeds stand on node {}, {}, {}",
                                                          seed.node.x, seed.node.y, seed.node.z));
    }
  }
  const std::vector<std::int16_t> roots = rootTable(nodes);
  std::vector<NodeValues> result(taken.size());
  forEach(nodes.z, threads, [&](int z) {
    SliceCounter counter(nodes, metric, roots);
    std::vector<Sums> sums(plane);
    std::vector<int> counts(plane);
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const GridSeed& seed = seeds[std::size_t(runs[i].seed)];
      counter.note(runs[i], seed.node, z);
      const bool last =
          i + 1 == runs.size() || seeds[std::size_t(runs[i + 1].seed)].row != seed.row;
      if (!last) continue;
      const NodeValues& values = rows[std::size_t(seed.row)];
      counter.takeCounts([&](int node, int count) {
        counts[std::size_t(node)] += count;
        Sums& sum = sums[std::size_t(node)];
        for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += double(count) * double(values[c]);
      });
    }
    for (std::size_t i = 0; i < plane; ++i) {
      for (std::size_t c = 0; c < sums[i].size(); ++c) {
        result[std::size_t(z) * plane + i][c] = float(sums[i][c] / counts[i]);
      }
    }
  });
  for (const GridSeed& seed : seeds) result[indexOf(seed.node)] = rows[std::size_t(seed.row)];
  return result;
}

}  // namespace vestige
