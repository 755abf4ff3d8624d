// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tests/support/walked_stack.h"

namespace vestige::test {

/// The scenes of the sweep of rate and distortion; smooth512 is "smooth" at 512^3 with 256^2 pixels
/// (issue goal: bytes follow pixels).
inline constexpr const char* kSweepScenes[] = {"ct", "turbulent", "plume", "smooth", "smooth512"};

inline Scene sweepScene(const std::string& name) {
  const bool large = name == "smooth512";
  Scene scene = namedScene(large ? "smooth" : name, large ? 512 : name == "plume" ? 128 : 256,
                           sceneCache());
  scene.name = name;
  return scene;
}

/// Pixels that stand on the samples; of smooth512 fewer, the outermost ones on the faces.
inline VoxelView sweepView(const Scene& scene, glm::dvec3 forward, glm::dvec3 up) {
  constexpr int kCoarsePixels = 256;
  VoxelView view = voxelView(scene, forward, up);
  if (scene.name != "smooth512") return view;
  view.camera.viewHeight *= (1.0 - 1.0 / view.size.height) / (1.0 - 1.0 / kCoarsePixels);
  view.size = {kCoarsePixels, kCoarsePixels};
  return view;
}

}  // namespace vestige::test
