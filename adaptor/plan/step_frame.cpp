// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/plan/step_frame.h"

#include <algorithm>

#include "adaptor/common/adaptor_error.h"
#include "adaptor/compositing/march_types.h"

namespace vestige {

std::vector<BlockPart> marchedParts(const StepFrame& frame) {
  std::vector<BlockPart> parts;
  for (const auto& [index, block] : frame.blocks->blocks()) {
    if (block.grid.empty()) continue;
    const auto size = frame.blocks->owned(index).size();
    if (!(size.x > 0.0 && size.y > 0.0 && size.z > 0.0)) continue;
    const auto split = splitBlock(*frame.blocks, index, frame.limits);
    parts.insert(parts.end(), split.begin(), split.end());
  }
  if (parts.empty()) {
    throw AdaptorError(VESTIGE_ERROR_GRID, "no block has a volume: nothing to show");
  }
  return parts;
}

std::vector<BlockPart> partsInOrder(const StepFrame& frame, const Camera& camera) {
  const auto parts = marchedParts(frame);
  std::vector<Box> boxes;
  for (const BlockPart& part : parts) boxes.push_back(ownedBox(*frame.blocks, part));
  std::vector<BlockPart> order;
  for (const auto position : visibilityOrder(boxes, camera)) order.push_back(parts[position]);
  return order;
}

double stepLengthOf(const Config& config, const StepFrame& frame) {
  if (config.stepLength > 0.0) return config.stepLength;
  constexpr double kMostSteps = 8192.0;
  const Box domain = frame.blocks->domain();
  return std::max(frame.blocks->smallestSpacing(), domain.diagonal() / kMostSteps);
}

ProxyHeader commonHeader(const Config& config, const StepFrame& frame, const View& view) {
  ProxyHeader header;
  header.time = frame.time;
  header.cycle = long(frame.cycle);
  header.view = view.name;
  header.camera = view.camera;
  header.size = config.size;
  header.domain = frame.blocks->domain();
  header.provenance = frame.provenance;
  header.note = config.note;
  header.owner = config.owner;
  return header;
}

}  // namespace vestige
