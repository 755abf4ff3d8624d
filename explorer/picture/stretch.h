// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "proxy/camera/box.h"
#include "proxy/camera/camera.h"

namespace vestige {

/// The world with its axes stretched about the middle of a domain: the scene that a look with a
/// scale shows. The domain keeps its diagonal, so that only proportions change: equal factors do
/// nothing, and lengths (of opacities, of occlusion) keep their share of the domain. Cameras of
/// pictures are in the scene; data, clip boxes, slices and customisations are in the world.
class Stretch {
 public:
  Stretch() = default;
  /// `scale`: factors above 0.
  Stretch(glm::dvec3 scale, const Box& domain);

  bool none() const { return factors_ == glm::dvec3(1.0); }
  /// Of each axis, the diagonal kept.
  glm::dvec3 factors() const { return factors_; }
  const glm::dmat4& sceneFromWorld() const { return sceneFromWorld_; }
  const glm::dmat4& worldFromScene() const { return worldFromScene_; }
  glm::dvec3 point(glm::dvec3 world) const;
  Box box(const Box& world) const;
  /// The points with dot(plane.xyz, x) = plane.w.
  glm::dvec4 plane(glm::dvec4 world) const;
  /// A ray of the scene; `direction` is no unit vector then, so that lengths along it stay those of
  /// the scene.
  Ray worldRay(Ray scene) const;
  friend bool operator==(const Stretch&, const Stretch&) = default;

 private:
  glm::dvec3 factors_{1.0};
  glm::dmat4 sceneFromWorld_{1.0}, worldFromScene_{1.0};
};

}  // namespace vestige
