// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "explorer/recomposition/segments.h"

namespace vestige {

/// What is stored of one channel on one ray: its length, mean depth and number of runs, in world
/// units along the ray and planar depth.
struct RayInterval {
  int channel;
  float length;
  float depth;
  int runs;
};

/// What is stored of a whole ray: the channels in which it enters and leaves the domain (-1 = not
/// stored), and its planar depth per world length (1 for orthographic cameras).
struct RayEnds {
  int first = -1, last = -1;
  float depthPerLength = 1.0f;
};

/// One segment a channel, by increasing mean depth. Exact where every channel has one run.
void orderByMeanDepth(std::span<RayInterval> ray, std::vector<Segment>& segments);

/// The likely order where channels have several runs. `ray` holds every channel that is there, no
/// data included, so that the lengths fill the chord. Three steps (method §4, "The order along
/// a ray"):
///  1. A continuous field steps from a channel to its neighbour only, so run counts and ends give
///     the number of crossings of every bound. Where that is one or two, lengths and mean depths
///     say exactly where the crossings lie: they cut the ray and bound the channels in between.
///  2. Within these bounds each channel gets the distribution over depth of largest entropy that
///     keeps every length and mean depth and fills the chord.
///  3. Open stretches are cut into slabs; the shares in a slab are one mixture.
/// Lengths are kept exactly. Segments in stretches that step 1 left open are ambiguous. Not a
/// function of any look. Reorders `ray`.
void orderByRuns(std::span<RayInterval> ray, const RayEnds& ends,
                 const IntervalPartition& partition, std::vector<Segment>& segments);

}  // namespace vestige
