// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "explorer/pieces.h"

namespace vestige {

/// What is stored of one channel on one ray: its length, mean depth and number of runs, in world
/// units along the ray and planar depth.
struct RayInterval {
  int channel;
  float length;
  float depth;
  int runs;
};

/// One piece a channel, by increasing mean depth. Exact where every channel has one run.
void orderByMeanDepth(std::span<RayInterval> ray, std::vector<Piece>& pieces);

/// Splits channels with several runs: the succession of runs is one that a continuous field can
/// have, so that neighbours along the ray are neighbours in value, with as few turns as the counts
/// allow; lengths are kept, and mean depths as nearly as can be (docs/exploring.md "Order").
/// Rays are best given row by row, for a ray takes over where its neighbour starts and ends.
class RunOrderer {
 public:
  /// The channels in which a ray enters and leaves the domain; -1 = not known.
  struct Ends {
    int first = -1, last = -1;
  };
  explicit RunOrderer(const IntervalPartition& partition) : partition_(partition) {}
  void order(std::span<RayInterval> ray, std::vector<Piece>& pieces);
  /// Forgets the neighbour, at the start of a row.
  void startRow() { ends_ = {}; }

 private:
  const IntervalPartition& partition_;
  Ends ends_;            ///< of the last ray that was searched
  double misfit_ = 0.0;  ///< its misfit as a share of its chord
};

}  // namespace vestige
