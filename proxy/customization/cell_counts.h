// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstdlib>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "proxy/customization/natural_neighbours.h"

namespace vestige {

/// d^2 or |d|: what distances along the axes add up.
inline int measured(SeedMetric metric, int d) {
  return metric == SeedMetric::Euclidean ? d * d : std::abs(d);
}

/// Which nodes v of a run count for a node q, both relative to their seed. Of the terms that do not
/// depend on x let K = |v|yz - |q - v|yz. Then v counts for q iff |q.x - v.x| - |v.x| <= K, and as
/// the left side falls with v.x for q.x >= 0, iff v.x >= T(K, q.x): one number for all runs. For
/// q.x < 0 the picture is mirrored.
class ThresholdTable {
 public:
  /// For K in [least, most] and q.x in [0, width); width a multiple of 16.
  ThresholdTable(SeedMetric metric, int least, int most, int width);
  /// T(K, 0), T(K, 1), ...
  const std::int16_t* row(int k) const {
    return &thresholds_[std::size_t(k - least_) * std::size_t(width_)];
  }

 private:
  int least_, width_;
  std::vector<std::int16_t> thresholds_;
};

/// The runs of cells as the counts of slices want them: sorted by row of values, then by seed.
class CellCounts {
 public:
  /// A run relative to its seed: nodes first .. last along x.
  struct Run {
    int y = 0, z = 0, first = 0, last = 0;
  };
  /// The runs [begin, end) of a seed.
  struct Cell {
    GridSeed seed;
    std::size_t begin = 0, end = 0;
  };

  CellCounts(glm::ivec3 nodes, SeedMetric metric, std::span<const GridSeed> seeds,
             std::span<const CellRun> runs);

  glm::ivec3 nodes() const { return nodes_; }
  SeedMetric metric() const { return metric_; }
  const std::vector<Run>& runs() const { return runs_; }
  const std::vector<Cell>& cells() const { return cells_; }

 private:
  friend class SliceCounter;

  glm::ivec3 nodes_;
  SeedMetric metric_;
  int width_;  ///< nodes along x, rounded up to whole vectors
  std::vector<Run> runs_;
  std::vector<Cell> cells_;
  ThresholdTable thresholds_;
  std::vector<std::int16_t> roots_;  ///< floor(sqrt(i)); Euclidean only
};

/// Counts of the nodes of cells in one slice of constant z.
class SliceCounter {
 public:
  explicit SliceCounter(const CellCounts& cells);
  /// Adds the nodes of a cell to the counts of the slice's nodes for which they count.
  void add(const CellCounts::Cell& cell, int z);

  /// Rows y in [lowest, highest] are all that is not 0.
  int lowest() const { return lowest_; }
  int highest() const { return highest_; }
  /// nodes.x counts.
  int* row(int y) { return &counts_[std::size_t(y) * std::size_t(width_)]; }
  /// All counts become 0.
  void clear();

 private:
  void flush(int seedX);

  const CellCounts& cells_;
  int width_, lowest_ = kMostNodes, highest_ = -1;
  std::vector<int> counts_;
  /// Counts of one cell by |q.x - seed.x|, not yet in `counts_`, and their rows.
  std::vector<std::uint16_t> right_, left_;
  int low_ = kMostNodes, high_ = -1;
};

}  // namespace vestige
