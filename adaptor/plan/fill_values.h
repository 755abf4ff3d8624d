// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "adaptor/plan/classification.h"

namespace vestige {

/// A value that seems to stand for no data, though nobody said so.
struct SuspectedFill {
  double value = 0.0;  ///< of the host's samples: of each component, where a field is a magnitude
  double share = 0.0;  ///< of the field's samples
  double low = 0.0, high = 0.0;  ///< range of the other ones
};

/// The least or the largest value of a step, if more than 1 % of the samples have exactly it, it is
/// far from all others, and it is one that is in use for this (-9999, 1e20, NetCDF's ...) or a
/// million times as large as they are. Reads the samples only where the histogram says that it may
/// be so.
std::optional<SuspectedFill> suspectedFill(const PlannedField& field,
                                           const FieldStatistics& statistics,
                                           const BlockSet& blocks, int threads);

/// A value as short as a float, or else a double, reads it back; as TOML has it.
std::string shortest(double value);

}  // namespace vestige
