// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "proxy/camera/raster.h"

namespace vestige {

/// What the explorer makes: linear RGBA, premultiplied, row by row from the top.
struct Picture {
  ImageSize size;
  std::vector<float> rgba;

  static Picture blank(ImageSize size);
  float* pixel(int x, int y) {
    return rgba.data() + 4 * (std::size_t(y) * std::size_t(size.width) + std::size_t(x));
  }
  const float* pixel(int x, int y) const { return const_cast<Picture*>(this)->pixel(x, y); }
};

/// `front` over `back`, in place in `front`; the sizes agree.
void placeOver(Picture& front, const Picture& back);
/// Over an opaque background of linear RGB.
void placeOver(Picture& front, glm::dvec3 backgroundLinear);
/// Fits the picture, whose pixels are `pixelAspect` times as wide as high, into square pixels,
/// centred, keeping its shape; area-averaged when it shrinks, bilinear when it grows; what is left
/// over is transparent.
Picture fitted(const Picture& picture, ImageSize size, double pixelAspect = 1.0);

/// The part of a picture from `low` to `high`, in its pixels, as a picture of `size`; bilinear
/// where it grows, area-averaged where it shrinks; what lies beyond the picture is transparent.
Picture windowed(const Picture& picture, glm::dvec2 low, glm::dvec2 high, ImageSize size);

/// 8-bit sRGB, alpha no longer premultiplied; and back.
Raster rasterFromPicture(const Picture& picture);
Picture pictureFromRaster(const Raster& raster);

/// Writes ".png" (8-bit sRGB) or ".exr" (linear float RGBA) by the path's extension; any other is
/// InvalidArgument. Throws Io or NoSpace.
void writePicture(const std::filesystem::path& path, const Picture& picture);
/// Reads what writePicture writes, and the reference proxies of archives.
Picture readPicture(const std::filesystem::path& path);

}  // namespace vestige
