// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "proxy/format/image/proxy_image.h"

namespace vestige {

/// Between a part's values in memory and in its file: memory = stored * unit + zero in double, then
/// rounded to float; where zero != 0 a stored 0 means missing and is 0 in memory.
struct StorageScale {
  double unit = 1.0;
  double zero = 0.0;

  bool identity() const { return zero == 0.0 && unit == 1.0; }
  bool missingIsZero() const { return zero != 0.0; }
  float stored(float memory) const {
    if (identity() || (missingIsZero() && memory == 0.0f)) return memory;
    return float((double(memory) - zero) / unit);
  }
  float memory(float stored) const {
    if (identity() || (missingIsZero() && stored == 0.0f)) return stored;
    return float(double(stored) * unit + zero);
  }
};

/// What lies between a part in memory and in its file. Values of MIP need not fit single precision:
/// memory holds them as stored (mipScale), and value = held * unit + zero in double.
inline StorageScale scaleOfPart(std::string_view part, double unit, double zero) {
  return part == "mip" ? StorageScale{} : StorageScale{unit, zero};
}

}  // namespace vestige
