// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "explorer/gpu/custom_textures.h"
#include "explorer/gpu/gpu.h"
#include "explorer/gpu/light.h"
#include "explorer/gpu/rendered_view.h"
#include "explorer/picture/look.h"
#include "explorer/picture/stretch.h"
#include "proxy/camera/box.h"
#include "proxy/camera/camera.h"

namespace vestige {

/// Depth layers as the GPU holds them: planes of one view that were decoded and completed.
struct LayerPlanes {
  Camera camera;
  ImageSize size;
  std::vector<std::vector<float>> depth;   ///< [layer] planar Z, +inf = nothing
  std::vector<std::vector<float>> normal;  ///< [layer] 3 a pixel, or empty
  Box domain;
  /// [layer] 1 where the depth is no more than likely; empty = nowhere.
  std::vector<std::vector<std::uint8_t>> likely;
};

struct LayerTextures {
  Camera camera;
  ImageSize size;
  int count = 0;
  bool storedNormals = false;
  gl::Texture depth;   ///< R32F array
  gl::Texture normal;  ///< RGBA16F array; (0, 0, 0) = none stored at the pixel; a = likely
  Box domain;

  explicit LayerTextures(const LayerPlanes& planes);
};

/// A rotated view of depth layers; depth: of the nearest sampled surface.
using WarpedView = RenderedView;

/// Relighting [Tikhonova 2010, §5], proxy ambient occlusion (eq. 5) and view synthesis by
/// warping the layers as meshes with one vertex a pixel. Made, used and destroyed in Device::run.
class DepthLayerPass {
 public:
  DepthLayerPass();
  /// [layer] rgb = diffuse and ambient light, a = specular.
  gl::Texture light(const LayerTextures& layers, const LightSetup& setup);
  /// `colors` with factors and shifts of a customisation at the place of each pixel's surface.
  gl::Texture customized(const LayerTextures& layers, const gl::Texture& colors,
                         const CustomTextures& custom);
  /// Draws the layers from `target`. `colors` [layer]: premultiplied RGBA of each source pixel;
  /// `light` may be null. Surfaces stretched across silhouettes fill what no sample covers and
  /// count as guess; so do depths that are only likely, surfaces seen from behind and, if `unseen`,
  /// rays through space that no stored ray saw before the layer itself is met. The layers' camera
  /// may be multi-perspective, `target` not (InvalidArgument); `target` is in the scene of
  /// `stretch`.
  WarpedView warp(const LayerTextures& layers, const gl::Texture& colors, const gl::Texture* light,
                  const Camera& target, ImageSize size, bool unseen, const Stretch& stretch = {});

 private:
  const gl::Program& program(const std::string& name, std::string_view vertex,
                             std::string_view fragment,
                             const std::vector<std::pair<std::string, std::string>>& defines = {});
  std::map<std::string, gl::Program> programs_;
  gl::Framebuffer framebuffer_;
  gl::VertexArray empty_;
};

}  // namespace vestige
