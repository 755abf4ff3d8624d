// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "proxy/format/layout/sliced_stack.h"

namespace vestige {

/// A stretch of a ray inside one channel, by rank.
struct Visit {
  std::uint8_t rank = 0;
  float levels = 0.0f;
};

/// The order of what a ray met in one slab (method §5 "sliced opacity lengths"). A continuous field
/// passes from a rank to its neighbours only, so between the ranks at the slab's faces the path
/// runs over its extremes: enter -> (the extreme met first) -> (the other) -> leave. Ranks met once
/// keep their whole length; those met before and after a turn are divided in one ratio a turn, such
/// that the turning rank has its stored mean place; those met three times start from thirds.
class SlabPath {
 public:
  /// Finds the path of a cell. `enter`, `leave`: ranks at the slab's faces; noDataRank = the ray
  /// has no data there, SlicedStack::kOutside = it is not known. Whatever the numbers, every rank
  /// keeps its levels. Data before and after a gap need not be neighbours; a gap that touches
  /// neither face is put where ranks are passed over, or in the middle.
  void follow(const StackSlab& slab, const StackCell& cell, int enter, int leave, int noDataRank,
              int allLevels);
  /// Front to back, none of length 0; valid until the next call.
  std::span<const Visit> visits() const { return {visits_.data(), std::size_t(count_)}; }
  /// Whether the order follows from the faces: the path rises, or falls, or has one rank.
  bool certain() const { return certain_; }

 private:
  static constexpr int kMostRanks = IntervalPartition::kMaxIntervals + 2;
  static constexpr int kMostLegs = 3;

  void push(int rank, float levels);
  void insertGap(int rank, float levels);
  /// Walks over stops[0] -> stops[1] -> ...; `places` [turn]: where the rank at stops[turn + 1] has
  /// its mean in levels from the path's start, < 0 = not known.
  void walk(std::span<const int> stops, std::span<const float> places, const std::uint8_t* levels,
            int lowest);

  std::array<Visit, kMostLegs * kMostRanks + 3> visits_;
  int count_ = 0;
  bool certain_ = true;
};

}  // namespace vestige
