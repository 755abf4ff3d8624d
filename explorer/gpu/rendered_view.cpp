// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/gpu/rendered_view.h"

#include <limits>

#include "explorer/gpu/gpu.h"

namespace vestige {

RenderedView readDrawnView(ImageSize size) {
  RenderedView view;
  view.picture = {size, gpu::readFloats(size, 0)};
  const std::vector<float> values = gpu::readFloats(size, 1);
  view.depth.resize(size.pixels());
  view.guess.resize(size.pixels());
  for (std::size_t i = 0; i < size.pixels(); ++i) {
    const float z = values[4 * i];
    view.depth[i] = z > 1e29f ? std::numeric_limits<float>::infinity() : z;
    view.guess[i] = values[4 * i + 1];
  }
  return view;
}

}  // namespace vestige
