// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/camera/view_set.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include "proxy/base/error.h"
#include "proxy/base/nearest_word.h"
#include "proxy/base/parse_number.h"

namespace vestige {
namespace {

struct Axis {
  const char* name;
  glm::dvec3 forward, up;
};
constexpr glm::dvec3 kUp(0, 0, 1);
const std::array<Axis, 6> kAxes = {{{"front", {0, 1, 0}, kUp},
                                    {"back", {0, -1, 0}, kUp},
                                    {"left", {1, 0, 0}, kUp},
                                    {"right", {-1, 0, 0}, kUp},
                                    {"top", {0, 0, -1}, {0, 1, 0}},
                                    {"bottom", {0, 0, 1}, {0, 1, 0}}}};
constexpr int kMaxSphere = 4096;  // more than a step can make (adaptor/config/config.h)

[[noreturn]] void unknown(const std::string& name, const std::string& why) {
  throw Error(
      ErrorCode::Config,
      fmt::format("view set '{}': {}{}; choose front, back, left, right, top, bottom, axes, "
                  "sphere:N (N in 1..{}) or orbit:AZ,EL (degrees)",
                  name, why,
                  didYouMean(name, {"front", "back", "left", "right", "top", "bottom", "axes"}),
                  kMaxSphere));
}

/// Direction i of n on a Fibonacci sphere: equal areas in z, golden angle in azimuth.
glm::dvec3 fibonacci(int i, int n) {
  const double z = 1.0 - (2.0 * i + 1.0) / n;
  const double azimuth = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
  const double radius = std::sqrt(1.0 - z * z);
  return {radius * std::cos(azimuth), radius * std::sin(azimuth), z};
}

int sphereCount(const std::string& name, std::string_view text) {
  const auto n = parseNumber(text);
  if (!n || *n != std::floor(*n) || *n < 1 || *n > kMaxSphere)
    unknown(name, fmt::format("'{}' is no number of directions in 1..{}", text, kMaxSphere));
  return int(*n);
}

/// Azimuth and elevation in degrees.
glm::dvec2 orbitAngles(const std::string& name, std::string_view text) {
  const auto comma = text.find(',');
  if (comma == std::string_view::npos) unknown(name, "orbit needs two angles");
  const auto angle = [&](std::string_view piece) {
    const auto degrees = parseNumber(piece);
    if (!degrees || std::abs(*degrees) > 360.0)
      unknown(name, fmt::format("'{}' is no angle in -360..360", piece));
    return *degrees + 0.0;  // no negative zero in names
  };
  return {angle(text.substr(0, comma)), angle(text.substr(comma + 1))};
}

}  // namespace

std::vector<View> viewSet(const std::string& name, const Box& box, double aspect,
                          Projection projection, double fieldOfView, double convergence) {
  const auto framed = [&](std::string viewName, glm::dvec3 forward, glm::dvec3 up) {
    if (projection == Projection::MultiPerspective)
      return View{std::move(viewName) + "_distorted",
                  frameBoxDistorted(box, forward, up, aspect, convergence)};
    return View{std::move(viewName), frameBox(box, forward, up, aspect, projection, fieldOfView)};
  };
  std::vector<View> views;
  for (const Axis& axis : kAxes)
    if (name == axis.name || name == "axes")
      views.push_back(framed(axis.name, axis.forward, axis.up));
  if (!views.empty()) return views;

  const std::string_view text = name;
  if (text.starts_with("sphere:")) {
    const int n = sphereCount(name, text.substr(7));
    for (int i = 0; i < n; ++i)
      views.push_back(framed(fmt::format("sphere{:03}", i), -fibonacci(i, n), kUp));
  } else if (text.starts_with("orbit:")) {
    const glm::dvec2 degrees = orbitAngles(name, text.substr(6));
    const double radians = std::numbers::pi / 180.0;
    const Camera turned =
        framed("front", kAxes[0].forward, kUp)
            .camera.orbited(box.center(), degrees.x * radians, degrees.y * radians);
    // Framed anew: a turned box may need more room.
    views.push_back(
        framed(fmt::format("orbit_{}_{}", degrees.x, degrees.y), turned.forward, turned.up));
  } else {
    unknown(name, "no such set");
  }
  return views;
}

}  // namespace vestige
