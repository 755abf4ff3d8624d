// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "proxy/camera/camera.h"

namespace vestige {

/// 8-bit sRGB picture, RGBA interleaved, row by row from the top, alpha not premultiplied.
struct Raster {
  ImageSize size;
  std::vector<std::uint8_t> rgba;
};

}  // namespace vestige
