// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/annotation/annotate.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "explorer/annotation/color_bar.h"

namespace vestige {
namespace {

/// "z", or "z ×50" where the look stretches it.
std::string axisName(const AnnotationSubject& subject, int axis) {
  const std::string name(1, "xyz"[axis]);
  const glm::dvec3 factors = subject.stretch.factors();
  const double least = std::min({factors.x, factors.y, factors.z});
  const double by = factors[axis] / least;
  return by > 1.0 + 1e-6 ? fmt::format("{} ×{:.3g}", name, by) : name;
}

void drawAxes(Picture& picture, const AnnotationSubject& subject, const Ink& ink) {
  const double unit = letterHeight(picture.size);
  const Font font(int(std::lround(unit)));
  const glm::dvec2 origin{3.2 * unit, picture.size.height - 3.2 * unit};
  const glm::dmat4 eyeFromWorld = subject.camera.eyeFromWorld();
  // Red, green and blue as bright as the ink.
  const bool bright = ink.ink.x > 0.5;
  const std::array<glm::dvec3, 3> colors =
      bright ? std::array{glm::dvec3(1.0, 0.13, 0.1), glm::dvec3(0.13, 0.7, 0.15),
                          glm::dvec3(0.16, 0.4, 1.0)}
             : std::array{glm::dvec3(0.65, 0.01, 0.01), glm::dvec3(0.01, 0.25, 0.03),
                          glm::dvec3(0.02, 0.08, 0.7)};
  std::array<int, 3> order{0, 1, 2};
  const auto axis = [&](int i) { return glm::dvec3(eyeFromWorld[i]); };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return axis(a).z < axis(b).z; });
  for (int i : order) {  // the farthest first
    const glm::dvec3 eye = axis(i);
    const glm::dvec2 flat{eye.x, -eye.y};
    const glm::dvec2 end = origin + 2.2 * unit * flat;
    const glm::dvec3 color = colors[std::size_t(i)];
    drawRimmedLine(picture, origin, end, std::max(1.5, unit / 7.0), color, ink);
    const std::string name = axisName(subject, i);
    const double length = glm::length(flat);
    // Seen end on, beside the origin, away from the two that are seen.
    glm::dvec2 others{0.0};
    for (int j = 0; j < 3; ++j)
      if (j != i) others += glm::dvec2(axis(j).x, -axis(j).y);
    const glm::dvec2 away = length > 0.05 ? flat / length : -1.5 * glm::normalize(others);
    // Longer names begin or end beside the arrow's head.
    const double middle = 0.5 * font.width(name.substr(0, 1));
    const double aside = away.x < -0.5 ? font.width(name) - middle : middle;
    drawRimmedText(picture, font,
                   end + 0.6 * unit * away + glm::dvec2(-aside, 0.5 * font.digitHeight()), name,
                   color, ink);
  }
}

void drawTime(Picture& picture, const AnnotationSubject& subject, const Ink& ink) {
  const double unit = letterHeight(picture.size);
  const Font font(int(std::lround(unit)));
  const std::string text = fmt::format("t = {:.6g}   cycle {}", subject.time, subject.cycle);
  const double low = 0.5 * unit, high = low + 2.0 * unit;
  drawBackplate(picture, {low, low}, {low + font.width(text) + 1.2 * unit, high}, 0.4 * unit, ink);
  font.draw(picture, {low + 0.6 * unit, 0.5 * (low + high + font.digitHeight())}, text, ink.ink);
}

}  // namespace

void drawBoxEdges(Picture& picture, const AnnotationSubject& subject, bool hidden, const Ink& ink) {
  const Box box = subject.stretch.box(subject.domain);
  // A face is turned to the viewer when its outward normal points against the ray to its middle.
  const auto faceVisible = [&](int axis, bool high) {
    glm::dvec3 normal(0.0), middle = box.center();
    normal[axis] = high ? 1.0 : -1.0;
    middle[axis] = high ? box.high[axis] : box.low[axis];
    const glm::dvec2 pixel(subject.camera.project(middle, picture.size));
    const glm::dvec3 toward = subject.camera.projection == Projection::Perspective
                                  ? middle - subject.camera.position
                                  : subject.camera.rayThrough(pixel, picture.size).direction;
    return glm::dot(normal, toward) < -1e-9;
  };
  const double width = std::max(1.0, letterHeight(picture.size) / 14.0);
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int side = 0; side < 4; ++side) {
      const bool highU = side & 1, highV = side & 2;
      if ((faceVisible(u, highU) || faceVisible(v, highV)) == hidden) continue;
      glm::dvec3 from = box.low, to = box.low;
      from[u] = to[u] = highU ? box.high[u] : box.low[u];
      from[v] = to[v] = highV ? box.high[v] : box.low[v];
      to[axis] = box.high[axis];
      // Edges are curves in multi-perspective pictures.
      const int segments = subject.camera.projection == Projection::MultiPerspective ? 48 : 1;
      for (int i = 0; i < segments; ++i) {
        const auto at = [&](int step) {
          const double t = double(step) / segments;
          return glm::dvec2(subject.camera.project((1.0 - t) * from + t * to, picture.size));
        };
        drawRimmedLine(picture, at(i), at(i + 1), width, ink.ink, ink, hidden ? 0.45 : 0.8);
      }
    }
  }
}

void annotate(Picture& picture, const Annotations& wanted, const AnnotationSubject& subject,
              const std::optional<glm::dvec3>& background) {
  const Ink ink = inkOn(background);
  if (wanted.colorbar && subject.legend.empty() && subject.function)
    drawColorBar(picture, subject, ink);
  if (wanted.colorbar) drawLegend(picture, subject, ink);
  if (wanted.axes) drawAxes(picture, subject, ink);
  if (wanted.time) drawTime(picture, subject, ink);
}

}  // namespace vestige
