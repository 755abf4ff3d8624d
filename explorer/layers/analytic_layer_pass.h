// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include "explorer/gpu/custom_textures.h"
#include "explorer/gpu/gpu.h"
#include "explorer/gpu/probed_rays.h"
#include "explorer/picture/picture.h"
#include "explorer/picture/stretch.h"
#include "proxy/format/layout/analytic_layers_layout.h"

namespace vestige {

/// Piecewise-analytic layers of one view as the GPU holds them (method §2).
struct AnalyticLayerTextures {
  Camera camera;
  ImageSize size;
  Box domain;
  int layers = 0;
  std::string shading;  ///< what light the colours hold
  gl::Texture
      boundaries;     ///< RGBA32UI array: 16-bit levels of depth, eight a texel, then the state
  gl::Texture media;  ///< RGBA32F array [layer]: light per opacity, extinction per diagonal
  gl::Texture tiles;  ///< RGBA32F: nearest and farthest level of 8 x 8 pixels; some saturated

  /// Of a proxy whose values are in their ranges.
  AnalyticLayerTextures(const ProxyHeader& header, const AnalyticLayerPlanes& planes);
};

/// A view of layers.
struct AnalyticLayerView {
  Picture picture;           ///< premultiplied linear RGBA
  std::vector<float> guess;  ///< [pixel] share of the light that came by space that is not stored
};

/// Epipolar ray casting of layers [Lochmann 2016, §3.3], for orthographic and
/// perspective cameras on both sides. At the stored view the picture is the stored one to rounding.
/// Space that is not stored, behind saturated rays and outside of the stored picture, is empty and
/// counts as a guess. Made, used and destroyed in Device::run.
class AnalyticLayerPass {
 public:
  /// The guess is left out unless it is asked for. `custom` may be null: factors and shifts at the
  /// middle of each stretch of a ray in a layer. `target` is in the scene of `stretch`; optical
  /// depths are those of lengths in the world.
  AnalyticLayerView render(const AnalyticLayerTextures& layers, const Camera& target,
                           ImageSize size, bool guess = true,
                           const CustomTextures* custom = nullptr, const Stretch& stretch = {});

 private:
  const gl::Program& program(int layers, bool custom);
  std::map<std::pair<int, bool>, gl::Program> programs_;
  ProbedRays rays_;
  gl::VertexArray empty_;
};

}  // namespace vestige
