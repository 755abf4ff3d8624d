// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace vestige {

/// A partition of the scalar axis into L intervals I_k = [b_k, b_{k+1}), the last one closed, and
/// three more channels: below, above, no data (method §1). Channel order: 0..L-1, below = L,
/// above = L+1, noData = L+2.
class IntervalPartition {
 public:
  static constexpr int kMaxIntervals = 64;

  /// L equal intervals over [low, high]. low == high (a constant field) gets a range of non-zero
  /// width around the value. Throws InvalidArgument unless finite, low <= high, 1 <= L <= 64.
  static IntervalPartition uniform(double low, double high, int intervals);
  /// The same, with a bound at zero where zero is inside by 1/1000 of the range or more: equal
  /// intervals on either side of it, as nearly as wide as those on the other as their number
  /// allows.
  static IntervalPartition uniformAroundZero(double low, double high, int intervals);
  /// Throws InvalidArgument unless 2..65 strictly increasing finite bounds.
  static IntervalPartition fromBounds(std::vector<double> bounds);
  /// L intervals that hold about equally many samples, from a histogram of equal bins over
  /// [low, high]; bounds are made strictly increasing where the data repeat one value. With a bound
  /// at zero as above: about equally many samples on either side of it.
  static IntervalPartition quantiles(double low, double high, std::span<const std::uint64_t> bins,
                                     int intervals);
  /// Whether doubles can divide [low, high] into so many intervals. If not, as for a constant
  /// field, the functions above widen it.
  static bool resolves(double low, double high, int intervals);

  int intervals() const { return int(bounds_.size()) - 1; }
  int channels() const { return intervals() + 3; }
  int below() const { return intervals(); }
  int above() const { return intervals() + 1; }
  int noData() const { return intervals() + 2; }
  std::span<const double> bounds() const { return bounds_; }
  double low() const { return bounds_.front(); }
  double high() const { return bounds_.back(); }

  /// Channels in the order of their values: rank 0 is below, 1 .. L the intervals, L + 1 above,
  /// L + 2 no data.
  int rankOf(int channel) const {
    return channel == below() ? 0 : channel < intervals() ? channel + 1 : channel;
  }
  int channelAt(int rank) const {
    return rank == 0 ? below() : rank <= intervals() ? rank - 1 : rank;
  }

  /// The channel of a value; NaN and infinities are noData.
  int channelOf(double value) const;
  /// (value - low) / (high - low) in double.
  double normalised(double value) const { return (value - low()) / (high() - low()); }
  double denormalised(double value) const { return low() + value * (high() - low()); }
  /// The name of a channel in proxies: "i00".."i63", "below", "above", "nodata".
  std::string channelName(int channel) const;

  friend bool operator==(const IntervalPartition&, const IntervalPartition&) = default;

 private:
  explicit IntervalPartition(std::vector<double> bounds) : bounds_(std::move(bounds)) {}
  std::vector<double> bounds_;
};

}  // namespace vestige
