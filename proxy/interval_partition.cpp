// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/interval_partition.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "proxy/error.h"

namespace vestige {
namespace {

[[noreturn]] void refuse(const std::string& sentence) {
  throw Error(ErrorCode::InvalidArgument, sentence);
}

struct Range {
  double low, high;
};

void checkCount(int intervals) {
  if (intervals < 1 || intervals > IntervalPartition::kMaxIntervals)
    refuse(
        fmt::format("{} intervals are not in 1..{}", intervals, IntervalPartition::kMaxIntervals));
}

/// The least width of one interval that doubles of this magnitude can tell apart.
double leastWidth(double low, double high) {
  const double magnitude = std::max({std::abs(low), std::abs(high), 1e-290});
  return 8.0 * std::numeric_limits<double>::epsilon() * magnitude;
}

/// [low, high], widened about its middle where it is too narrow for so many intervals. A constant
/// field gets half its magnitude on either side, or 1 in all around zero.
Range usableRange(double low, double high, int intervals) {
  if (!std::isfinite(low) || !std::isfinite(high) || low > high || !std::isfinite(high - low))
    refuse(fmt::format("range [{}, {}] is not finite and ordered", low, high));
  const double least = intervals * leastWidth(low, high);
  if (high - low >= least) return {low, high};
  const double middle = low + 0.5 * (high - low);
  double half = least;
  if (low == high) half = std::abs(low) < 1e-280 ? 0.5 : 0.5 * std::abs(low);
  constexpr double kLargest = std::numeric_limits<double>::max();
  return {std::max(middle - half, -kLargest), std::min(middle + half, kLargest)};
}

std::vector<double> equalBounds(Range range, int intervals) {
  std::vector<double> bounds(intervals + 1);
  for (int k = 0; k <= intervals; ++k)
    bounds[k] = std::lerp(range.low, range.high, double(k) / intervals);
  return bounds;
}

}  // namespace

IntervalPartition IntervalPartition::uniform(double low, double high, int intervals) {
  checkCount(intervals);
  return fromBounds(equalBounds(usableRange(low, high, intervals), intervals));
}

IntervalPartition IntervalPartition::fromBounds(std::vector<double> bounds) {
  if (bounds.size() < 2 || bounds.size() > kMaxIntervals + 1)
    refuse(fmt::format("{} interval bounds are not in 2..{}", bounds.size(), kMaxIntervals + 1));
  for (std::size_t k = 0; k < bounds.size(); ++k) {
    if (!std::isfinite(bounds[k]))
      refuse(fmt::format("interval bound {} is not finite", bounds[k]));
    if (k > 0 && bounds[k] <= bounds[k - 1])
      refuse(fmt::format("interval bound {} does not increase over {}", bounds[k], bounds[k - 1]));
  }
  if (!std::isfinite(bounds.back() - bounds.front()))
    refuse(
        fmt::format("interval bounds {} .. {} are too far apart", bounds.front(), bounds.back()));
  return IntervalPartition(std::move(bounds));
}

IntervalPartition IntervalPartition::quantiles(double low, double high,
                                               std::span<const std::uint64_t> bins, int intervals) {
  checkCount(intervals);
  const Range range = usableRange(low, high, intervals);
  double total = 0.0;
  for (const std::uint64_t n : bins) total += double(n);
  if (total == 0.0 || low == high) return fromBounds(equalBounds(range, intervals));

  // Invert the piecewise-linear cumulative histogram at the shares k / L.
  std::vector<double> bounds(intervals + 1);
  bounds.front() = range.low;
  bounds.back() = range.high;
  std::size_t bin = 0;
  double before = 0.0;
  for (int k = 1; k < intervals; ++k) {
    const double wanted = total * k / intervals;
    while (bin + 1 < bins.size() && before + double(bins[bin]) < wanted)
      before += double(bins[bin++]);
    const double inside = bins[bin] ? (wanted - before) / double(bins[bin]) : 0.0;
    bounds[k] = std::lerp(low, high, (double(bin) + std::clamp(inside, 0.0, 1.0)) / bins.size());
  }
  // Where the data repeat one value the bounds crowd together: push them apart, both ways.
  const double least = leastWidth(range.low, range.high);
  for (int k = 1; k < intervals; ++k) bounds[k] = std::max(bounds[k], bounds[k - 1] + least);
  for (int k = intervals - 1; k > 0; --k) bounds[k] = std::min(bounds[k], bounds[k + 1] - least);
  return fromBounds(std::move(bounds));
}

int IntervalPartition::channelOf(double value) const {
  if (!std::isfinite(value)) return noData();
  if (value < low()) return below();
  if (value > high()) return above();
  if (value == high()) return intervals() - 1;
  return int(std::upper_bound(bounds_.begin(), bounds_.end(), value) - bounds_.begin()) - 1;
}

std::string IntervalPartition::channelName(int channel) const {
  if (channel < 0 || channel >= channels())
    refuse(fmt::format("channel {} is not in 0..{}", channel, channels() - 1));
  if (channel == below()) return "below";
  if (channel == above()) return "above";
  if (channel == noData()) return "nodata";
  return fmt::format("i{:02}", channel);
}

}  // namespace vestige
