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

/// Splits channels with several runs so that lengths and mean depths are kept and neighbours along
/// the ray are neighbours in value, as a continuous field demands; docs/exploring.md "Order".
void orderByRuns(std::span<RayInterval> ray, const IntervalPartition& partition,
                 std::vector<Piece>& pieces);

}  // namespace vestige
