// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "adaptor/ingest/block_set.h"
#include "adaptor/config/config.h"
#include "proxy/camera/view_set.h"

namespace vestige {

/// An orthographic view that is cut into slabs.
struct StackView {
  View view;
  ImageSize size;
  std::vector<double> depths;  ///< of the slabs' faces, planar, rising
};

/// The stacks that [sliced] asks for. Those of a set have cameras of their own, "stack-front" and
/// so on, with a pixel on every sample across the view as far as SlicedConfig::pixels allows,
/// shaped as the samples are (Camera::pixelAspect): coarser pixels, or square ones where samples
/// are not, would cost edges between them.
/// Those of the run's own views are of `size`.
std::vector<StackView> stackViews(const SlicedConfig& sliced, ImageSize size,
                                  const std::vector<View>& views, const BlockSet& blocks,
                                  Location location);

}  // namespace vestige
