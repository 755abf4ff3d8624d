// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "adaptor/ingest/block_set.h"
#include "proxy/transfer/statistics.h"

namespace vestige {

inline constexpr int kHistogramBins = 256;

/// One block's part of a field.
struct FieldPart {
  FieldReader reader;
  SampleRange own;
  /// BlockSet::facePlaces: the range holds the values that are interpolated there, too.
  std::array<std::vector<SamplePlace>, 3> faces;
};

/// Statistics over the own samples of all parts; the range (low, high) is that of the field,
/// sampled and interpolated, on the parts' boxes with their faces, so that nothing that rays see
/// lies outside of it. The result does not depend on the number of threads; range, counts and
/// histogram do not depend on how the domain is split into blocks either. Two passes: the histogram
/// needs the range first. `ends`: of intervals whose `below` and `above` are counted.
FieldStatistics measureField(const std::vector<FieldPart>& parts, int threads,
                             std::optional<std::pair<double, double>> ends = {},
                             int bins = kHistogramBins);

}  // namespace vestige
