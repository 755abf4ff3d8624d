// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <vector>

namespace vestige {

class IntervalPartition;

/// More than this share of samples outside of the intervals deserves a word.
inline constexpr double kOutside = 0.01;

/// One field at one step, over all owned (non-ghost) samples. Moments are of the finite samples;
/// the range holds them and what is interpolated between them and ghosts on faces. The histogram
/// has equal bins over [low, high], the last one closed.
struct FieldStatistics {
  std::uint64_t count = 0;   ///< samples in all
  std::uint64_t noData = 0;  ///< of these NaN, infinite or masked
  double low = 0.0, high = 0.0;
  double mean = 0.0, deviation = 0.0;  ///< population standard deviation
  std::vector<std::uint64_t> histogram;
  /// Samples below and above the step's intervals.
  std::uint64_t below = 0, above = 0;
  /// ... as a share of those with data.
  double shareOutside() const {
    return count > noData ? double(below + above) / double(count - noData) : 0.0;
  }
  friend bool operator==(const FieldStatistics&, const FieldStatistics&) = default;
};

/// Whether data reach beyond intervals by more than what rounding may do: 1/1000 of their width.
bool reachesBeyond(const FieldStatistics& statistics, const IntervalPartition& intervals);

/// An object with the members' names as keys; reading throws Format naming the key that is missing
/// (`below` and `above` may be) or makes no sense (a histogram has at most 65536 bins). Moments may
/// have overflowed: mean and deviation need not be finite in memory, though JSON text cannot hold
/// such numbers.
nlohmann::json toJson(const FieldStatistics& statistics);
FieldStatistics statisticsFromJson(const nlohmann::json& json);

}  // namespace vestige
