// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "explorer/export/export_arrays.h"

namespace vestige {

inline constexpr const char* kWorldLength = "world length";
inline constexpr const char* kNumber = "1";

/// A channel of a part of a proxy (ProxyPart) as it is exported.
ExportChannel exportChannel(const ProxyHeader& header, const std::string& part,
                            const std::string& channel);
/// A channel of the intervals: `meaning` is of what its values are ("length of the ray with").
ExportChannel intervalChannel(const IntervalPartition& partition, int channel,
                              const std::string& meaning, const char* units);

}  // namespace vestige
