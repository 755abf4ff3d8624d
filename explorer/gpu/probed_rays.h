// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "explorer/gpu/gpu.h"

namespace vestige {

/// Pictures of costly rays: every other pixel is cast first, and those between only where the
/// colours around them bend by more than a tolerance. Made, used and destroyed in Device::run.
class ProbedRays {
 public:
  /// Draws every pixel of the bound target, rays `pixelStep` pixels apart, from pixel (0, 0) on:
  /// location 0 = colour, 1 = (planar depth, > 1e29 = nothing there; share of guess).
  using Cast = std::function<void(float pixelStep)>;

  ProbedRays();
  /// Fills RGBA32F pictures of `size`. `tolerance` is of a colour's second difference over two
  /// pixels, the error less than an eighth of it; 0 = casts all.
  void render(const gl::Texture& color, const gl::Texture& info, ImageSize size, double tolerance,
              const Cast& cast);

 private:
  gl::Program between_, spread_;
  gl::Framebuffer half_, betweens_, full_;
  gl::VertexArray empty_;
};

}  // namespace vestige
