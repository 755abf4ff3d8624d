// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "adaptor/ingest/block_set.h"
#include "adaptor/plan/classification.h"
#include "proxy/format/layout/field_layout.h"

namespace vestige {

/// The field on one grid over all blocks, ghosts left out: normalised by the range of `statistics`;
/// where no block is there is no data. Throws GRID naming the block whose samples lie between those
/// of others: such blocks (refined ones, say) have no grid in common.
FieldSamples assembleField(const PlannedField& field, const BlockSet& blocks,
                           const FieldStatistics& statistics, int threads);

}  // namespace vestige
