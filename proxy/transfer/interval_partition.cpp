// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/transfer/interval_partition.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "proxy/base/error.h"

namespace vestige {
namespace {

[[noreturn]] void refusePartition(const std::string& sentence) {
  throw Error(ErrorCode::InvalidArgument, sentence);
}

struct Range {
  double low, high;
};

void checkCount(int intervals) {
  if (intervals < 1 || intervals > IntervalPartition::kMaxIntervals)
    refusePartition(
        fmt::format("{} intervals are not in 1..{}", intervals, IntervalPartition::kMaxIntervals));
}

/// The least width of one interval that doubles of this magnitude can tell apart.
double leastWidth(double low, double high) {
  const double magnitude = std::max({std::abs(low), std::abs(high), 1e-290});
  return 2.0 * std::numeric_limits<double>::epsilon() * magnitude;
}

/// [low, high], widened about its middle where it is too narrow for so many intervals. A constant
/// field gets half its magnitude on either side, or 1 in all around zero.
Range usableRange(double low, double high, int intervals) {
  if (!std::isfinite(low) || !std::isfinite(high) || low > high || !std::isfinite(high - low))
    refusePartition(fmt::format("range [{}, {}] is not finite and ordered", low, high));
  const double least = intervals * leastWidth(low, high);
  if (high - low >= least) return {low, high};
  const double middle = low + 0.5 * (high - low);
  double half = least;
  if (low == high) half = std::abs(low) < 1e-280 ? 0.5 : 0.5 * std::abs(low);
  constexpr double kLargest = std::numeric_limits<double>::max();
  return {std::max(middle - half, -kLargest), std::min(middle + half, kLargest)};
}

/// bounds[first .. last], equal intervals from `low` to `high`.
void spread(std::vector<double>& bounds, int first, int last, double low, double high) {
  for (int k = first; k <= last; ++k)
    bounds[std::size_t(k)] = std::lerp(low, high, double(k - first) / (last - first));
}

std::vector<double> equalBounds(Range range, int intervals) {
  std::vector<double> bounds(std::size_t(intervals) + 1);
  spread(bounds, 0, intervals, range.low, range.high);
  return bounds;
}

/// How many of the intervals lie below zero, if that holds `share` of what is divided; 0 = zero
/// gets no bound: the range does not straddle it, or reaches beyond by less than 1/1000 of its
/// width.
int intervalsBelowZero(Range range, int intervals, double share) {
  const double least = 1e-3 * (range.high - range.low);
  if (intervals < 2 || !(-range.low >= least) || !(range.high >= least)) return 0;
  return int(std::clamp(std::nearbyint(share * intervals), 1.0, intervals - 1.0));
}

/// The cumulative share of a histogram over [low, high], and its inverse; linear within a bin.
class Cumulative {
 public:
  Cumulative(double low, double high, std::span<const std::uint64_t> bins)
      : low_(low), high_(high), bins_(bins) {
    for (const std::uint64_t n : bins) total_ += double(n);
  }
  bool empty() const { return total_ == 0.0; }
  double shareBelow(double value) const {
    const double place = (value - low_) / (high_ - low_) * double(bins_.size());
    double sum = 0.0;
    for (std::size_t i = 0; i < bins_.size() && double(i) < place; ++i)
      sum += double(bins_[i]) * std::min(1.0, place - double(i));
    return sum / total_;
  }
  double valueAt(double share) const {
    const double wanted = share * total_;
    std::size_t bin = 0;
    double before = 0.0;
    while (bin + 1 < bins_.size() && before + double(bins_[bin]) < wanted)
      before += double(bins_[bin++]);
    const double inside = bins_[bin] ? (wanted - before) / double(bins_[bin]) : 0.0;
    return std::lerp(low_, high_,
                     (double(bin) + std::clamp(inside, 0.0, 1.0)) / double(bins_.size()));
  }

 private:
  double low_, high_, total_ = 0.0;
  std::span<const std::uint64_t> bins_;
};

/// bounds[first + 1 .. last - 1] at equal shares from `from` to `to`; where the data repeat one
/// value they crowd together and are pushed apart, both ways.
void spreadByShare(std::vector<double>& bounds, int first, int last, const Cumulative& shares,
                   double from, double to, double least) {
  for (int k = first + 1; k < last; ++k) {
    const double value = shares.valueAt(std::lerp(from, to, double(k - first) / (last - first)));
    bounds[std::size_t(k)] = std::max(value, bounds[std::size_t(k) - 1] + least);
  }
  for (int k = last - 1; k > first; --k)
    bounds[std::size_t(k)] = std::min(bounds[std::size_t(k)], bounds[std::size_t(k) + 1] - least);
}

}  // namespace

IntervalPartition IntervalPartition::uniform(double low, double high, int intervals) {
  checkCount(intervals);
  return fromBounds(equalBounds(usableRange(low, high, intervals), intervals));
}

IntervalPartition IntervalPartition::uniformAroundZero(double low, double high, int intervals) {
  checkCount(intervals);
  const Range range = usableRange(low, high, intervals);
  const int below = intervalsBelowZero(range, intervals, -range.low / (range.high - range.low));
  if (below == 0) return fromBounds(equalBounds(range, intervals));
  std::vector<double> bounds(std::size_t(intervals) + 1);
  spread(bounds, 0, below, range.low, 0.0);
  spread(bounds, below, intervals, 0.0, range.high);
  return fromBounds(std::move(bounds));
}

bool IntervalPartition::resolves(double low, double high, int intervals) {
  return low < high && high - low >= intervals * leastWidth(low, high);
}

IntervalPartition IntervalPartition::fromBounds(std::vector<double> bounds) {
  if (bounds.size() < 2 || bounds.size() > kMaxIntervals + 1)
    refusePartition(
        fmt::format("{} interval bounds are not in 2..{}", bounds.size(), kMaxIntervals + 1));
  for (std::size_t k = 0; k < bounds.size(); ++k) {
    if (!std::isfinite(bounds[k]))
      refusePartition(fmt::format("interval bound {} is not finite", bounds[k]));
    if (k > 0 && bounds[k] <= bounds[k - 1])
      refusePartition(
          fmt::format("interval bound {} does not increase over {}", bounds[k], bounds[k - 1]));
  }
  if (!std::isfinite(bounds.back() - bounds.front()))
    refusePartition(
        fmt::format("interval bounds {} .. {} are too far apart", bounds.front(), bounds.back()));
  return IntervalPartition(std::move(bounds));
}

IntervalPartition IntervalPartition::quantiles(double low, double high,
                                               std::span<const std::uint64_t> bins, int intervals) {
  checkCount(intervals);
  const Range range = usableRange(low, high, intervals);
  const Cumulative shares(low, high, bins);
  if (shares.empty() || low == high) return fromBounds(equalBounds(range, intervals));

  std::vector<double> bounds(std::size_t(intervals) + 1);
  bounds.front() = range.low;
  bounds.back() = range.high;
  const double least = leastWidth(range.low, range.high);
  const double negative = shares.shareBelow(0.0);
  const int below = intervalsBelowZero(range, intervals, negative);
  if (below == 0) {
    spreadByShare(bounds, 0, intervals, shares, 0.0, 1.0, least);
  } else {
    bounds[std::size_t(below)] = 0.0;
    spreadByShare(bounds, 0, below, shares, 0.0, negative, least);
    spreadByShare(bounds, below, intervals, shares, negative, 1.0, least);
  }
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
    refusePartition(fmt::format("channel {} is not in 0..{}", channel, channels() - 1));
  if (channel == below()) return "below";
  if (channel == above()) return "above";
  if (channel == noData()) return "nodata";
  return fmt::format("i{:02}", channel);
}

}  // namespace vestige
