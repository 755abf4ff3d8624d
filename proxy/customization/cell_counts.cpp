// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/customization/cell_counts.h"

#include <algorithm>
#include <cstdlib>

#include "proxy/base/cpu_dispatch.h"

namespace vestige {
namespace {

/// Nodes along x that are counted at once.
constexpr int kLanes = 16;
constexpr int kMostPending = 65535;

int floorDivided(int a, int b) { return a >= 0 ? a / b : -((b - 1 - a) / b); }

int farthest(const CellCounts::Run& run) {
  return std::max(std::abs(run.first), std::abs(run.last));
}

/// Least and greatest K of runs that count for any node.
std::pair<int, int> reachOf(SeedMetric metric, const std::vector<CellCounts::Run>& runs) {
  int least = 0, most = 0;
  for (const CellCounts::Run& run : runs) {
    least = std::min(least, -measured(metric, farthest(run)));
    most = std::max(most, measured(metric, run.y) + measured(metric, run.z));
  }
  return {least, most};
}

/// floor(sqrt(i)) for i in [0, most].
std::vector<std::int16_t> rootTable(int most) {
  std::vector<std::int16_t> roots(std::size_t(most) + 1);
  for (int root = 0, i = 0; i <= most; ++i) {
    if ((root + 1) * (root + 1) <= i) ++root;
    roots[std::size_t(i)] = std::int16_t(root);
  }
  return roots;
}

/// Adds to `blocks` vectors of counts the nodes of a run that are at least as far as the threshold.
VESTIGE_INLINE void addHalf(std::uint16_t* __restrict counts,
                            const std::int16_t* __restrict thresholds, int first, int last,
                            int blocks) {
  const auto low = std::int16_t(first), end = std::int16_t(last + 1);
  for (int block = 0; block < blocks; ++block, counts += kLanes, thresholds += kLanes) {
    for (int i = 0; i < kLanes; ++i) {
      const std::int16_t from = std::max(thresholds[i], low);
      const auto some = std::int16_t(end - from);
      counts[i] = std::uint16_t(counts[i] + std::max(some, std::int16_t(0)));
    }
  }
}

/// A run in a slice: what its rows share.
struct RunInSlice {
  int first, last;   ///< along x
  int across;        ///< K in the run's own row y
  int y, reach;      ///< the row, and how many rows below and above it are met
  int rows;          ///< of the slice
  int seedX, width;  ///< of rows; only nodes 0 .. seedX to the left, rows end at `nodesX`
  int nodesX;
};

/// half(i): how far a node reaches along x whose measure of reach is i.
template <typename Measure, typename Half>
VESTIGE_INLINE void addRun(const RunInSlice& run, const ThresholdTable& table, std::uint16_t* right,
                           std::uint16_t* left, const Measure& measure, const Half& half) {
  const int below = std::min(run.reach, run.y);
  const int above = std::min(run.reach, run.rows - 1 - run.y);
  const int atFirst = measure(run.first), atLast = measure(run.last);
  const std::ptrdiff_t row = std::ptrdiff_t(run.y) * run.width;
  for (int d = 0; d <= std::max(below, above); ++d) {
    const int k = run.across - measure(d);
    const int toRight = atLast + k < 0 ? -1 : run.last + half(atLast + k);
    const int toLeft = atFirst + k < 0 ? -1 : half(atFirst + k) - run.first;
    const int rightBlocks =
        toRight < 0 ? 0 : std::min(toRight, run.nodesX - 1 - run.seedX) / kLanes + 1;
    const int leftBlocks = toLeft < 1 ? 0 : std::min(toLeft, run.seedX) / kLanes + 1;
    const std::int16_t* thresholds = table.row(k);
    const std::ptrdiff_t away = std::ptrdiff_t(d) * run.width;
    if (d <= above) {
      addHalf(right + row + away, thresholds, run.first, run.last, rightBlocks);
      addHalf(left + row + away, thresholds, -run.last, -run.first, leftBlocks);
    }
    if (d > 0 && d <= below) {
      addHalf(right + row - away, thresholds, run.first, run.last, rightBlocks);
      addHalf(left + row - away, thresholds, -run.last, -run.first, leftBlocks);
    }
  }
}

VESTIGE_CPU_DISPATCH void addEuclidean(const RunInSlice& run, const ThresholdTable& table,
                                       std::uint16_t* right, std::uint16_t* left,
                                       const std::int16_t* roots) {
  addRun(
      run, table, right, left, [](int d) { return d * d; },
      [roots](int i) { return int(roots[i]); });
}

VESTIGE_CPU_DISPATCH void addManhattan(const RunInSlice& run, const ThresholdTable& table,
                                       std::uint16_t* right, std::uint16_t* left) {
  addRun(
      run, table, right, left, [](int d) { return d < 0 ? -d : d; }, [](int i) { return i; });
}

VESTIGE_CPU_DISPATCH void addBothHalves(int* counts, const std::uint16_t* right,
                                        const std::uint16_t* left, int seedX, int nodesX) {
  for (int x = seedX; x < nodesX; ++x) counts[x] += right[x - seedX];
  for (int x = 0; x < seedX; ++x) counts[x] += left[seedX - x];
}

}  // namespace

ThresholdTable::ThresholdTable(SeedMetric metric, int least, int most, int width)
    : least_(least),
      width_(width),
      thresholds_(std::size_t(most - least + 1) * std::size_t(width)) {
  constexpr int kNever = 2 * kMostNodes;
  auto to = thresholds_.begin();
  for (int k = least; k <= most; ++k) {
    for (int x = 0; x < width; ++x) {
      int threshold = k >= x ? -kNever : kNever;
      if (metric == SeedMetric::Manhattan) {
        if (k >= -x && k < x) threshold = floorDivided(x - k + 1, 2);
      } else if (x > 0) {
        threshold = floorDivided(x * x - k + 2 * x - 1, 2 * x);
      }
      *to++ = std::int16_t(std::clamp(threshold, -kNever, kNever));
    }
  }
}

CellCounts::CellCounts(glm::ivec3 nodes, SeedMetric metric, std::span<const GridSeed> seeds,
                       std::span<const CellRun> runs)
    : nodes_(nodes),
      metric_(metric),
      width_((nodes.x + kLanes - 1) / kLanes * kLanes),
      thresholds_(metric, 0, 0, width_) {
  std::vector<CellRun> sorted(runs.begin(), runs.end());
  std::stable_sort(sorted.begin(), sorted.end(), [&](const CellRun& a, const CellRun& b) {
    const int rowA = seeds[std::size_t(a.seed)].row, rowB = seeds[std::size_t(b.seed)].row;
    return rowA != rowB ? rowA < rowB : a.seed < b.seed;
  });
  int seed = -1;
  for (const CellRun& run : sorted) {
    const GridSeed& its = seeds[std::size_t(run.seed)];
    if (run.seed != seed) cells_.push_back({its, runs_.size(), runs_.size()});
    seed = run.seed;
    const glm::ivec3 p = its.node;
    runs_.push_back({run.y - p.y, run.z - p.z, run.first - p.x, run.end - 1 - p.x});
    cells_.back().end = runs_.size();
  }
  const auto [least, most] = reachOf(metric, runs_);
  thresholds_ = ThresholdTable(metric, least, most, width_);
  if (metric == SeedMetric::Euclidean) roots_ = rootTable(most - least);
}

SliceCounter::SliceCounter(const CellCounts& cells)
    : cells_(cells),
      width_(cells.width_),
      counts_(std::size_t(width_) * std::size_t(cells.nodes_.y)),
      right_(counts_.size()),
      left_(counts_.size()) {}

void SliceCounter::add(const CellCounts::Cell& cell, int z) {
  const SeedMetric metric = cells_.metric_;
  const glm::ivec3 seed = cell.seed.node;
  int pending = 0;
  for (std::size_t i = cell.begin; i < cell.end; ++i) {
    const CellCounts::Run& run = cells_.runs_[i];
    const int across =
        measured(metric, run.y) + measured(metric, run.z) - measured(metric, seed.z + run.z - z);
    const int rest = across + measured(metric, farthest(run));
    if (rest < 0) continue;
    // Pending counts have 16 bits.
    const int length = run.last - run.first + 1;
    if (pending + length > kMostPending) {
      flush(seed.x);
      pending = 0;
    }
    pending += length;
    const int reach = metric == SeedMetric::Euclidean ? cells_.roots_[std::size_t(rest)] : rest;
    const int y = seed.y + run.y;
    low_ = std::min(low_, std::max(y - reach, 0));
    high_ = std::max(high_, std::min(y + reach, cells_.nodes_.y - 1));
    const RunInSlice here{run.first, run.last, across,         y, reach, cells_.nodes_.y,
                          seed.x,    width_,   cells_.nodes_.x};
    if (metric == SeedMetric::Euclidean) {
      addEuclidean(here, cells_.thresholds_, right_.data(), left_.data(), cells_.roots_.data());
    } else {
      addManhattan(here, cells_.thresholds_, right_.data(), left_.data());
    }
  }
  flush(seed.x);
}

void SliceCounter::flush(int seedX) {
  for (int y = low_; y <= high_; ++y) {
    const std::size_t at = std::size_t(y) * std::size_t(width_);
    addBothHalves(row(y), &right_[at], &left_[at], seedX, cells_.nodes_.x);
    std::fill_n(right_.begin() + std::ptrdiff_t(at), width_, std::uint16_t(0));
    std::fill_n(left_.begin() + std::ptrdiff_t(at), width_, std::uint16_t(0));
  }
  lowest_ = std::min(lowest_, low_);
  highest_ = std::max(highest_, high_);
  low_ = kMostNodes;
  high_ = -1;
}

void SliceCounter::clear() {
  for (int y = lowest_; y <= highest_; ++y) std::fill_n(row(y), width_, 0);
  lowest_ = kMostNodes;
  highest_ = -1;
}

}  // namespace vestige
