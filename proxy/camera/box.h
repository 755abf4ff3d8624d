// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace vestige {

/// An axis-aligned box in world units, low <= high in each component.
struct Box {
  glm::dvec3 low{0.0};
  glm::dvec3 high{0.0};

  glm::dvec3 center() const { return 0.5 * (low + high); }
  glm::dvec3 size() const { return high - low; }
  double diagonal() const { return glm::length(size()); }
  /// Corner i, 0..7: bit 0, 1, 2 of i choose high in x, y, z.
  glm::dvec3 corner(int i) const {
    return {i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z};
  }
  friend bool operator==(const Box&, const Box&) = default;
};

}  // namespace vestige
