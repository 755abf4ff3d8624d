// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/picture/stretch.h"

namespace vestige {

Stretch::Stretch(glm::dvec3 scale, const Box& domain) {
  const double before = domain.diagonal(), after = glm::length(scale * domain.size());
  if (!(before > 0.0) || (scale.x == scale.y && scale.y == scale.z)) return;
  factors_ = scale * (before / after);
  const glm::dvec3 middle = domain.center();
  for (int axis = 0; axis < 3; ++axis) {
    sceneFromWorld_[axis][axis] = factors_[axis];
    sceneFromWorld_[3][axis] = middle[axis] * (1.0 - factors_[axis]);
    worldFromScene_[axis][axis] = 1.0 / factors_[axis];
    worldFromScene_[3][axis] = middle[axis] * (1.0 - 1.0 / factors_[axis]);
  }
}

glm::dvec3 Stretch::point(glm::dvec3 world) const {
  return glm::dvec3(sceneFromWorld_ * glm::dvec4(world, 1.0));
}

Box Stretch::box(const Box& world) const { return {point(world.low), point(world.high)}; }

glm::dvec4 Stretch::plane(glm::dvec4 world) const {
  // n . (W x) = d for the scene's x.
  const glm::dvec3 normal = glm::dvec3(world) / factors_;
  return {normal, world.w - glm::dot(glm::dvec3(world), glm::dvec3(worldFromScene_[3]))};
}

Ray Stretch::worldRay(Ray scene) const {
  if (none()) return scene;
  scene.origin = glm::dvec3(worldFromScene_ * glm::dvec4(scene.origin, 1.0));
  scene.direction /= factors_;
  return scene;
}

}  // namespace vestige
