// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "adaptor/march/marcher.h"

namespace vestige {

/// Per axis: nodes at which blocks meet, ascending, both ends included.
using Cuts = std::array<std::vector<int>, 3>;

/// A field given by a function of world space, on nodes of our choice.
struct Scene {
  std::array<std::vector<double>, 3> nodes;
  std::function<double(glm::dvec3)> field;

  Box box() const;
  Cuts whole() const;  ///< one block
  /// n nodes an axis over [low, high].
  static Scene even(glm::ivec3 count, const Box& box, std::function<double(glm::dvec3)> field);
};

/// Nodes [begin, end] of each axis of a scene, and the part that the block answers for.
struct ScenePart {
  glm::ivec3 begin, end;
  Box owned;
  BlockGrid gridIn(const Scene& scene) const;
};

/// Blocks that meet at the given nodes of each axis, front to back where there is such an order.
std::vector<ScenePart> partsOf(const Scene& scene, const Camera& camera, const Cuts& cuts,
                               int ghosts);

/// A request for everything over `domain`, with intervals over [low, high] and a ramp.
MarchRequest requestAll(const Box& domain, double low, double high, int intervals,
                        const Camera& camera, ImageSize size = {32, 24});

/// The scene marched in one block.
RayImage marchWhole(Marcher& marcher, const Scene& scene, const MarchRequest& request);

/// The same in blocks with so many ghost layers, composited front to back.
RayImage marchBlocks(Marcher& marcher, const Scene& scene, const MarchRequest& request,
                     const Cuts& cuts, int ghosts);

/// The layers of a scene in such blocks, shadowed if there is a light; their light at the camera;
/// and what the first march made.
struct GatheredLayers {
  AnalyticLayerPlanes planes;
  std::vector<float> light;
  RayImage rays;
};
GatheredLayers marchLayers(Marcher& marcher, const Scene& scene, const MarchRequest& request,
                           int layers, std::optional<glm::dvec3> light, const Cuts& cuts,
                           int ghosts);

/// The slabs of a scene in such blocks, composited.
std::vector<SlabRays> marchSlabs(Marcher& marcher, const Scene& scene, const MarchRequest& request,
                                 const std::vector<double>& depths, const Cuts& cuts, int ghosts);

/// One device per backend for a whole test program.
std::shared_ptr<gl::Device> sharedDevice(const std::string& backend);

/// The greatest difference of two planes; infinities and NaN must stand in the same places.
double greatestDifference(const std::vector<float>& a, const std::vector<float>& b);

}  // namespace vestige
