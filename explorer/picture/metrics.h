// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "proxy/camera/camera.h"

namespace vestige {

/// Linear RGB floats of a picture, seen where they are; row by row from the top. Must outlive use.
struct RgbView {
  ImageSize size;
  std::array<const float*, 3> channels;  ///< the first pixel's red, green, blue
  std::ptrdiff_t stride = 1;             ///< floats from one pixel to the next

  /// `floatsPerPixel` floats for each pixel, the first three of which are R, G, B. Throws
  /// InvalidArgument when `values` is not exactly the picture.
  static RgbView interleaved(ImageSize size, std::span<const float> values, int floatsPerPixel = 3);
  static RgbView planar(ImageSize size, std::span<const float> red, std::span<const float> green,
                        std::span<const float> blue);
};

/// Pixels x .. x + width - 1, y .. y + height - 1 of a picture, counted from its top left.
struct PixelRect {
  int x = 0, y = 0;
  int width = 0, height = 0;
  friend bool operator==(const PixelRect&, const PixelRect&) = default;
};

// How pictures are compared (method §10). Values are clamped to [0, 1] first. All throw
// InvalidArgument when the sizes differ, the rectangle is empty or leaves the picture, or a value
// in it is NaN. Without a rectangle the whole picture counts.

/// Peak signal-to-noise ratio in dB for a peak of 1, over all channels; +infinity when equal.
double psnr(const RgbView& a, const RgbView& b, const std::optional<PixelRect>& rect = {});

/// Mean structural similarity [Wang 2004]: Gaussian window of 11 x 11 pixels, sigma 1.5,
/// K1 = 0.01, K2 = 0.03, population moments, mean over the windows that lie wholly in the rectangle
/// and over the three channels. Along a side of n < 11 pixels the window is the largest odd number
/// <= n wide. In [-1, 1]; 1 when equal.
double ssim(const RgbView& a, const RgbView& b, const std::optional<PixelRect>& rect = {});

/// (1 - SSIM) / 2.
double dssim(const RgbView& a, const RgbView& b, const std::optional<PixelRect>& rect = {});

/// The pixels that the projection of a box touches, cut to the picture; nothing when it touches
/// none. For boxes in front of the camera.
std::optional<PixelRect> projectedRect(const Camera& camera, const Box& box, ImageSize size);

}  // namespace vestige
