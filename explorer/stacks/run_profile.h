// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "explorer/stacks/stack_runs.h"
#include "proxy/transfer/interval_partition.h"
#include "proxy/transfer/statistics.h"

namespace vestige {

/// The field inside one run by the share t in [0, 1] of the run's length, as the height y in [0, 1]
/// of its interval: a cubic; or, with a plateau, a parabola up (or down) to it, level, and another.
struct ProfileSegment {
  int rank = 0;
  float length = 0.0f;
  float y0 = 0.0f, y1 = 0.0f;  ///< at its ends
  float d0 = 0.0f, d1 = 0.0f;  ///< dy/dt at its ends
  float plateau = -1.0f;       ///< < 0: none
  float t0 = 0.0f, t1 = 0.0f;  ///< lengths of the parabolas

  float at(float t) const {
    const float u = 1.0f - t;
    float y;
    if (plateau >= 0.0f) {
      y = plateau;
      if (t < t0) {
        const float left = 1.0f - t / t0;
        y += (y0 - plateau) * left * left;
      } else if (u < t1) {
        const float left = 1.0f - u / t1;
        y += (y1 - plateau) * left * left;
      }
    } else {
      y = u * u * (1.0f + 2.0f * t) * y0 + t * t * (3.0f - 2.0f * t) * y1 +
          t * u * (u * d0 - t * d1);
    }
    return y < 0.0f ? 0.0f : y > 1.0f ? 1.0f : y;
  }
  /// How far `at` may be wrong: least where the run crosses its interval, most on plateaus.
  float doubt() const {
    if (plateau >= 0.0f || (y0 == y1 && d0 == d1)) return 0.25f;
    if (y0 == y1) return 0.03f * (d0 > d1 ? d0 - d1 : d1 - d0);
    return 0.05f;
  }
};

/// A continuous field along a ray that has exactly its runs: it passes every bound where one run
/// ends and the next begins. Slopes there follow from the runs on both sides: rising or falling
/// through two runs, their weighted harmonic mean (Fritsch and Butland 1984), which keeps a cubic
/// monotone; next to a run that turns, what the other's slope has become on the way to a
/// standstill. A turn is the cubic of the slopes at its ends, no higher than its interval. Runs so
/// long that these slopes must have ended, and those with an open end, come to a plateau: where the
/// field's histogram has a peak in the interval, there; else somewhat beyond its middle.
class RunProfile {
 public:
  RunProfile(const IntervalPartition& partition, const FieldStatistics& statistics);

  /// The segments of pixel i's runs, of which each run has one; no data has y = 0. Valid until the
  /// next call.
  const std::vector<ProfileSegment>& of(const RunLists& runs, std::size_t pixel);
  /// The value at a height of a rank. Below and above the partition ranks are as wide as their
  /// neighbours.
  double value(int rank, float y) const {
    return low_[std::size_t(rank)] + double(y) * width_[std::size_t(rank)];
  }
  double width(int rank) const { return width_[std::size_t(rank)]; }
  int noData() const { return noData_; }

 private:
  static constexpr int kRanks = IntervalPartition::kMaxIntervals + 3;
  std::array<double, kRanks> low_{}, width_{};
  std::array<float, kRanks> relative_{};  ///< width / mean width
  struct Peak {
    float y = 0.5f, weight = 0.0f;
  };
  std::array<Peak, kRanks> peak_{};
  int noData_;
  void findPeaks(const IntervalPartition& partition, const FieldStatistics& statistics);
  float plateauOf(int rank, float bound, float guess) const;

  std::vector<ProfileSegment> segments_;
  std::vector<float> slope_;  ///< [knot] in mean widths per length, signed
};

}  // namespace vestige
