// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "adaptor/ingest/block_part.h"
#include "adaptor/ingest/block_set.h"
#include "adaptor/config/config.h"
#include "proxy/format/image/proxy_image.h"
#include "proxy/camera/view_set.h"

namespace vestige {

/// What is the same for the whole step.
struct StepFrame {
  std::int64_t cycle = 0;
  double time = 0.0;
  const BlockSet* blocks = nullptr;
  std::vector<View> views;
  std::string provenance;
  TextureLimits limits{};
};

/// The blocks that own some of the domain, in parts that fit in textures; throws GRID when there
/// are none.
std::vector<BlockPart> marchedParts(const StepFrame& frame);
/// The same, nearest first for a camera.
std::vector<BlockPart> partsInOrder(const StepFrame& frame, const Camera& camera);
/// As configured, or the smallest spacing of any block, the same for all of them, so that they
/// sample alike; but not so little that there are more than 8192 along the diagonal, for the sake
/// of grids that are very fine somewhere.
double stepLengthOf(const Config& config, const StepFrame& frame);
/// What does not depend on what is shown.
ProxyHeader commonHeader(const Config& config, const StepFrame& frame, const View& view);

}  // namespace vestige
