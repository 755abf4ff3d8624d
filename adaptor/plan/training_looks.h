// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "proxy/transfer/interval_partition.h"
#include "proxy/transfer/transfer_function.h"

namespace vestige {

/// The function with its opacities in [low, high) times `scale`, in [0, 1]: jumps at both ends,
/// which may be infinite.
TransferFunction withScaledOpacity(const TransferFunction& base, double low, double high,
                                   double scale);

/// The looks of a view's training pictures [Tikhonova 2010, §6.2]: the base function, then
/// the same with the opacities of one group of intervals after the other times `scale`, in [0, 1].
/// The groups, at least two, follow each other in value and hold about equally many intervals that
/// are not transparent; as many looks as asked for, or fewer where there are fewer such intervals.
std::vector<TransferFunction> trainingLooks(const TransferFunction& base,
                                            const IntervalPartition& partition, int pictures,
                                            double scale);

}  // namespace vestige
