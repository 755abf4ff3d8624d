// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "explorer/picture/look.h"
#include "proxy/camera/box.h"
#include "proxy/camera/camera.h"

namespace vestige {

/// How surfaces and grids are lit. Directions in eye space of the camera that they are seen with.
struct LightSetup {
  std::vector<glm::dvec3> directions;  ///< unit, toward the light
  std::vector<double> intensities;
  Material material;
  bool shade = true;  ///< false: ambient occlusion alone
  NormalSource normals = NormalSource::Stored;
  AmbientOcclusion ao;
  double aoRadiusWorld = 0.0;
  /// The layers' eye space in the scene that they are lit in (stretch.h), and normals alike.
  glm::dmat4 stretch{1.0};
  glm::dmat3 stretchNormal{1.0};
  /// Where the viewer is: for perspective viewers their position (w = 1), else the unit direction
  /// toward them (w = 0).
  glm::dvec4 viewer{0.0, 0.0, 1.0, 0.0};
};

/// The light setup of a look whose viewer is `target`, for layers of `domain` seen by `source`.
LightSetup lightSetup(const Look& look, const Camera& source, const Camera& target,
                      const Box& domain);

}  // namespace vestige
