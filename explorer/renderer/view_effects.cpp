// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/renderer/view_effects.h"

#include <algorithm>
#include <cmath>
#include <glm/trigonometric.hpp>

#include "proxy/base/error.h"

namespace vestige {
namespace {

[[noreturn]] void refuse(const char* option, double value, const char* range) {
  throw Error(ErrorCode::Config,
              std::string(option) + " " + std::to_string(value) + " is not " + range);
}

/// A viewer at distance 1 from the origin, turned.
Camera turned(const Camera& camera, const Rotation& by) {
  return camera.orbited(glm::dvec3(0.0), glm::radians(by.azimuth), glm::radians(by.elevation),
                        glm::radians(by.roll));
}

/// Van der Corput's sequence in a base, in (0, 1): evenly spread for any number of samples.
double radicalInverse(int i, int base) {
  double value = 0.0, digit = 1.0 / base;
  for (int rest = i + 1; rest > 0; rest /= base, digit /= base) value += digit * (rest % base);
  return value;
}

Picture averaged(Renderer& renderer, const Look& look, const std::vector<Rotation>& views,
                 Rendered& out, double share) {
  std::vector<double> sum;
  for (const Rotation& view : views) {
    Look one = look;
    one.rotate = view;
    // Eyes and lenses look through one frame.
    if (one.frameFor.empty()) one.frameFor = {look.rotate};
    Rendered rendered = renderer.render(one);
    if (out.notes.empty()) out.notes = rendered.notes;
    if (out.warnings.empty()) out.warnings = rendered.warnings;
    const double weight = share / double(views.size());
    out.shares.data += weight * rendered.shares.data;
    out.shares.interpolation += weight * rendered.shares.interpolation;
    out.shares.guess += weight * rendered.shares.guess;
    out.camera = rendered.camera;
    sum.resize(rendered.picture.rgba.size());
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += double(rendered.picture.rgba[i]);
    out.picture.size = rendered.picture.size;
  }
  Picture picture{out.picture.size, std::vector<float>(sum.size())};
  for (std::size_t i = 0; i < sum.size(); ++i)
    picture.rgba[i] = float(sum[i] / double(views.size()));
  return picture;
}

Picture sideBySide(const Picture& left, const Picture& right) {
  Picture pair = Picture::blank({left.size.width + right.size.width, left.size.height});
  for (int y = 0; y < left.size.height; ++y) {
    std::copy_n(left.pixel(0, y), 4 * std::size_t(left.size.width), pair.pixel(0, y));
    std::copy_n(right.pixel(0, y), 4 * std::size_t(right.size.width),
                pair.pixel(left.size.width, y));
  }
  return pair;
}

}  // namespace

void ViewEffects::validate() const {
  const auto within = [](double v, double low, double high) { return v >= low && v <= high; };
  if (!within(stereo, -90.0, 90.0)) refuse("--stereo", stereo, "within -90 .. 90 degrees");
  if (!within(aperture, 0.0, 90.0)) refuse("--aperture", aperture, "within 0 .. 90 degrees");
  for (const double angle : {shutter.azimuth, shutter.elevation, shutter.roll})
    if (!within(angle, -360.0, 360.0)) refuse("--shutter", angle, "within -360 .. 360 degrees");
  if (samples < 2 || samples > 4096) refuse("--samples", samples, "within 2 .. 4096");
}

Rotation composed(const Rotation& rotation, const Rotation& offset) {
  // In the frame of the viewer who has not turned: x right, y up, z toward them.
  Camera home;
  home.position = {0.0, 0.0, 1.0};
  home.forward = {0.0, 0.0, -1.0};
  home.up = {0.0, 1.0, 0.0};
  const Camera goal = turned(turned(home, rotation), offset);
  const glm::dvec3 from = -goal.forward;
  Rotation result;
  result.elevation = glm::degrees(std::asin(std::clamp(from.y, -1.0, 1.0)));
  result.azimuth = glm::degrees(std::atan2(from.x, from.z));
  const Camera level = turned(home, result);
  // A picture that turns counterclockwise is that of a viewer whose up leans to their right.
  result.roll =
      glm::degrees(std::atan2(glm::dot(goal.up, level.right()), glm::dot(goal.up, level.up)));
  return result;
}

std::vector<Rotation> viewsOf(const Rotation& rotation, const ViewEffects& effects, int eye) {
  const Rotation own =
      eye == 0 ? rotation : composed(rotation, {0.5 * eye * effects.stereo, 0.0, 0.0});
  const bool moves = !effects.shutter.isZero();
  if (!moves && effects.aperture == 0.0) return {own};
  std::vector<Rotation> views;
  for (int i = 0; i < effects.samples; ++i) {
    Rotation view = own;
    if (moves) {
      const double time = (i + 0.5) / effects.samples - 0.5;
      view = composed(view, {time * effects.shutter.azimuth, time * effects.shutter.elevation,
                             time * effects.shutter.roll});
    }
    if (effects.aperture > 0.0) {
      // Evenly over the lens, a disc, and over time.
      const double radius = 0.5 * effects.aperture * std::sqrt(radicalInverse(i, 2));
      const double angle = glm::radians(360.0) * radicalInverse(i, 3);
      view = composed(view, {radius * std::cos(angle), radius * std::sin(angle), 0.0});
    }
    views.push_back(view);
  }
  return views;
}

Rendered renderWithEffects(Renderer& renderer, const Look& look, const ViewEffects& effects) {
  effects.validate();
  if (effects.none()) return renderer.render(look);
  Rendered out;
  out.shares = {0.0, 0.0, 0.0};
  if (effects.stereo == 0.0) {
    out.picture = averaged(renderer, look, viewsOf(look.rotate, effects, 0), out, 1.0);
    return out;
  }
  const Picture left = averaged(renderer, look, viewsOf(look.rotate, effects, -1), out, 0.5);
  const Picture right = averaged(renderer, look, viewsOf(look.rotate, effects, 1), out, 0.5);
  out.picture = sideBySide(left, right);
  return out;
}

}  // namespace vestige
