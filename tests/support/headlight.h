// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace vestige::test {

/// What is left of a point's own colour under the light of MarchRequest::phong, and white added.
struct Headlight {
  double own = 1.0, white = 0.0;
};

/// On a surface whose normal is along `slope`, seen along `direction`; full where there is no
/// slope.
inline Headlight headlightOn(const glm::dvec3& slope, const glm::dvec3& direction) {
  const double steepness = glm::length(slope);
  const bool known = steepness > 0.0 && std::isfinite(steepness);
  const double facing = known ? std::abs(glm::dot(slope, direction)) / steepness : 1.0;
  return {0.3 + 0.7 * facing, 0.2 * std::pow(facing, 32.0)};
}

}  // namespace vestige::test
