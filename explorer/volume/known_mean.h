// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>

namespace vestige {

/// A place between samples, of which some may have no data (method §1): the mean of those that
/// have, by their shares, and NaN where the one of the greatest share, the nearest, has none.
class KnownMean {
 public:
  void add(double value, double share) {
    const bool known = std::isfinite(value);
    if (share > most_) {
      most_ = share;
      nearestKnown_ = known;
    }
    if (!known) return;
    sum_ += share * value;
    shares_ += share;
  }
  double value() const {
    return nearestKnown_ ? sum_ / shares_ : std::numeric_limits<double>::quiet_NaN();
  }

 private:
  double sum_ = 0.0, shares_ = 0.0, most_ = 0.0;
  bool nearestKnown_ = false;
};

}  // namespace vestige
