// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "adaptor/block_set.h"
#include "proxy/statistics.h"

namespace vestige {

inline constexpr int kHistogramBins = 256;

/// One block's part of a field.
struct FieldPart {
  FieldReader reader;
  SampleRange own;
};

/// Statistics over the own samples of all parts. The result does not depend on the number of
/// threads; range, counts and histogram do not depend on how the domain is split into blocks
/// either. Two passes: the histogram needs the range first.
FieldStatistics measureField(const std::vector<FieldPart>& parts, int threads,
                             int bins = kHistogramBins);

}  // namespace vestige
