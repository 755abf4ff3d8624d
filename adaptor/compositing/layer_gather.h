// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "adaptor/compositing/march_types.h"
#include "proxy/format/layout/analytic_layers_layout.h"

namespace vestige {

/// Optical depth toward a distant light (single scattering, [Bergeron]): planes
/// normal to its direction, seen by an orthographic camera that looks along it. Depths of blocks
/// add, in any order.
struct LightDepth {
  static constexpr ImageSize kSize{256, 256};
  static constexpr int kSlices = 192;

  Camera camera;             ///< where the light comes from; frames the domain
  std::vector<float> depth;  ///< [slice][pixel] up to the far side of each of kSlices equal slices

  /// Of a light that travels along `direction` through the domain; nothing is in its way yet.
  LightDepth(const Box& domain, glm::dvec3 direction);
};

/// What layers of a block depend on that a march of its own cannot know.
struct LayerRequest {
  int layers = 4;
  std::span<const float> front;         ///< [pixel] transmittance in front of the block
  std::span<const float> end;           ///< [pixel] at the far end of the whole ray
  const LightDepth* shadows = nullptr;  ///< of the whole domain; null: as MarchRequest says
};

/// What a block adds to the layers of the rays (method §2), in planes [plane][pixel].
struct LayerRays {
  std::vector<float> boundary;  ///< [layers + 1] planar depth; +inf: not in this block
  std::vector<float> light;     ///< [3 layers] that reaches the camera
  std::vector<float> tau;       ///< [1] optical depth of the block
};

/// Light that every point gets, shadowed or not.
inline constexpr float kShadowAmbient = 0.25f;

/// Gathers the layers of a view, block by block from front to back (method §2). What it makes does
/// not depend on how the domain is split.
class LayerGatherer {
 public:
  /// `transmittance` at the far end of the whole rays.
  LayerGatherer(int layers, std::vector<float> transmittance);
  /// What the next block is to be marched with.
  LayerRequest request(const LightDepth* shadows) const;
  void add(const LayerRays& block);
  /// Premultiplied linear RGB of the whole rays, [3][pixel].
  std::vector<float> light() const;
  /// `exit`: planar depth at which rays leave the domain.
  AnalyticLayerPlanes planes(std::span<const float> exit) const;

 private:
  int layers_;
  std::vector<float> end_, front_;
  std::vector<float> boundary_, light_;
};

}  // namespace vestige
