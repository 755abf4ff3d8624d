// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/vec3.hpp>
#include <string>
#include <vector>

namespace vestige {

/// A colour map over [0, 1]. Control colours are given in sRGB as their authors publish them and
/// interpolated in sRGB; `at` returns linear RGB (method §1).
class Colormap {
 public:
  /// "viridis", "inferno", "plasma", "magma", "cividis", "coolwarm", "grey", "hot", "turbo",
  /// "rainbow" ("gray" is "grey"); a suffix "_r" reverses. Throws Config naming the choices.
  static Colormap named(const std::string& name);
  static std::vector<std::string> names();
  /// Equally spaced sRGB colours, at least 1, components in [0, 1]; else throws InvalidArgument.
  static Colormap fromSrgb(std::string name, std::vector<glm::dvec3> colors);

  /// Linear RGB at t, clamped to [0, 1]; NaN is 0.
  glm::dvec3 at(double t) const;
  const std::string& name() const { return name_; }
  const std::vector<glm::dvec3>& srgbColors() const { return colors_; }

 private:
  std::string name_ = "grey";
  std::vector<glm::dvec3> colors_{glm::dvec3(0.0), glm::dvec3(1.0)};
};

/// The sRGB transfer curve (IEC 61966-2-1), component by component, and its inverse.
glm::dvec3 linearFromSrgb(glm::dvec3 srgb);
glm::dvec3 srgbFromLinear(glm::dvec3 linear);

}  // namespace vestige
