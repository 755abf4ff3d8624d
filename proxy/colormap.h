// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/vec3.hpp>
#include <string>
#include <vector>

namespace vestige {

/// A colour map over [0, 1]. Control colours are given in sRGB as their authors publish them and
/// interpolated in sRGB; `at` returns linear RGB (method §0).
class Colormap {
 public:
  /// "viridis", "inferno", "plasma", "magma", "cividis", "coolwarm", "grey", "hot", "turbo",
  /// "rainbow"; a suffix "_r" reverses. Throws Config naming the choices.
  static Colormap named(const std::string& name);
  static std::vector<std::string> names();
  /// Equally spaced sRGB colours, at least 1.
  static Colormap fromSrgb(std::string name, std::vector<glm::dvec3> colors);

  /// Linear RGB at t, clamped to [0, 1].
  glm::dvec3 at(double t) const;
  const std::string& name() const { return name_; }
  const std::vector<glm::dvec3>& srgbColors() const { return colors_; }

 private:
  std::string name_;
  std::vector<glm::dvec3> colors_;
};

glm::dvec3 linearFromSrgb(glm::dvec3 srgb);
glm::dvec3 srgbFromLinear(glm::dvec3 linear);

}  // namespace vestige
