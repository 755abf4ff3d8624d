// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "proxy/format/image/storage_scale.h"

namespace vestige {

/// A half below 2^-13 is a whole number of these, up to 2047 of them: with such a unit the bits of
/// a stored value are a small integer, which is what deflate's predictor wants to see.
inline constexpr double kHalfQuantum = 0x1p-24;
/// Up to this many quanta a half holds every whole number.
inline constexpr double kHalfLevels = 2047.0;

/// The nearest whole number that a half holds exactly as that many quanta.
inline double roundToHalf(double quanta) {
  if (quanta < 2048.0) return std::nearbyint(quanta);
  const double grain = std::exp2(std::ilogb(quanta) - 10);
  return std::nearbyint(quanta / grain) * grain;
}

/// Rounds values >= zero to whole steps, coarser ones above 2048 steps, such that a half holds them
/// exactly under unit() and `zero`.
class Quantiser {
 public:
  explicit Quantiser(double step, double zero = 0.0)
      : scale_{step / kHalfQuantum, zero}, zero_(zero), perStep_(1.0 / step) {}
  float operator()(double value) const {
    return scale_.memory(float(roundToHalf((value - zero_) * perStep_) * kHalfQuantum));
  }
  /// The value of a whole number of steps, 0 .. kHalfLevels; not of 0 when zero != 0.
  float level(double steps) const { return scale_.memory(float(steps * kHalfQuantum)); }
  double unit() const { return scale_.unit; }

 private:
  StorageScale scale_;
  double zero_, perStep_;
};

}  // namespace vestige
