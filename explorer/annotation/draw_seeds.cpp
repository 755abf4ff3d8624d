// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/annotation/draw_seeds.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace vestige {
namespace {

/// Well apart for any number of primitives: hues at golden sections of the circle.
glm::dvec3 identityColor(int primitive) {
  if (primitive < 0) return glm::dvec3(0.3);
  const double hue = std::fmod(0.05 + 0.6180339887 * primitive, 1.0);
  const auto part = [&](double offset) {
    return 0.05 +
           0.85 * std::clamp(std::abs(std::fmod(hue + offset, 1.0) * 6.0 - 3.0) - 1.0, 0.0, 1.0);
  };
  return {part(0.0), part(2.0 / 3.0), part(1.0 / 3.0)};
}

glm::dvec3 valueColor(const SeedParameters& p) {
  if (p.shift != glm::dvec3(0.0)) return 0.5 + 0.5 * p.shift;
  const double share = p.opacity != 1.0 ? p.opacity / (1.0 + p.opacity)
                       : p.gamma != 1.0 ? 1.0 / (1.0 + p.gamma)
                                        : 0.5 + 0.5 * p.blend;
  const glm::dvec3 less(0.05, 0.15, 0.9), same(0.7), more(0.9, 0.05, 0.05);
  return share < 0.5 ? glm::mix(less, same, 2.0 * share) : glm::mix(same, more, 2.0 * share - 1.0);
}

}  // namespace

void drawSeeds(Picture& picture, Seeds mode, const Customization& customization,
               const AnnotationSubject& subject, const std::optional<glm::dvec4>& plane) {
  if (mode == Seeds::None) return;
  const double unit = std::max(3.0, 0.012 * picture.size.height);
  const auto strength = [&](glm::dvec3 world) {
    if (!plane) return 1.0;
    const glm::dvec3 normal(*plane), at = subject.stretch.point(world);
    const double away = std::abs(glm::dot(normal, at) - plane->w) / glm::length(normal);
    return std::clamp(1.0 - 10.0 * away / subject.domain.diagonal(), 0.15, 1.0);
  };
  const auto pixelOf = [&](glm::dvec3 at) {
    return glm::dvec2(subject.camera.project(subject.stretch.point(at), picture.size));
  };
  const std::vector<SeedPoint> points = customization.points(subject.domain);
  for (const SeedPoint& a : points) {
    if (a.primitive < 0 && a.parameters == SeedParameters{}) continue;
    const glm::dvec3 color =
        mode == Seeds::Identity ? identityColor(a.primitive) : valueColor(a.parameters);
    for (const SeedPoint& b : points) {
      // Edges join seeds that differ along one axis.
      const glm::dvec3 way = b.position - a.position;
      const int axes = (way.x != 0.0) + (way.y != 0.0) + (way.z != 0.0);
      if (a.primitive < 0 || b.primitive != a.primitive || axes != 1) continue;
      if (way.x + way.y + way.z < 0.0) continue;
      drawLine(picture, pixelOf(a.position), pixelOf(b.position), 0.25 * unit, color,
               0.8 * strength(0.5 * (a.position + b.position)));
    }
    const glm::dvec2 at = pixelOf(a.position);
    drawLine(picture, at, at, 1.5 * unit, glm::dvec3(0.0), 0.6 * strength(a.position));
    drawLine(picture, at, at, unit, color, strength(a.position));
  }
}

}  // namespace vestige
