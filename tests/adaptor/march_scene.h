// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "adaptor/marcher.h"

namespace vestige {

/// A field given by a function of world space, on nodes of our choice.
struct Scene {
  std::array<std::vector<double>, 3> nodes;
  std::function<double(glm::dvec3)> field;

  Box box() const;
  /// n nodes an axis over [low, high].
  static Scene even(glm::ivec3 count, const Box& box, std::function<double(glm::dvec3)> field);
};

/// A request for everything over `domain`, with intervals over [low, high] and a ramp.
MarchRequest requestAll(const Box& domain, double low, double high, int intervals,
                        const Camera& camera, ImageSize size = {32, 24});

/// The scene marched in one block.
RayImage marchWhole(Marcher& marcher, const Scene& scene, const MarchRequest& request);

/// The same in blocks that meet at the given nodes of each axis (ascending, both ends included),
/// with so many ghost layers, composited front to back.
RayImage marchBlocks(Marcher& marcher, const Scene& scene, const MarchRequest& request,
                     const std::array<std::vector<int>, 3>& cuts, int ghosts);

/// One device per backend for a whole test program.
std::shared_ptr<gl::Device> sharedDevice(const std::string& backend);

/// The greatest difference of two planes; infinities and NaN must stand in the same places.
double greatestDifference(const std::vector<float>& a, const std::vector<float>& b);

}  // namespace vestige
