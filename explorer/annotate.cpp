// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/annotate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "explorer/text.h"

namespace vestige {
namespace {

void blend(Picture& picture, int x, int y, glm::dvec3 color, double cover) {
  if (x < 0 || y < 0 || x >= picture.size.width || y >= picture.size.height || cover <= 0.0) return;
  float* pixel = picture.pixel(x, y);
  const float share = float(std::min(cover, 1.0));
  for (int c = 0; c < 3; ++c) pixel[c] = pixel[c] * (1.0f - share) + share * float(color[c]);
  pixel[3] = pixel[3] * (1.0f - share) + share;
}

/// Lengths of annotations follow the picture's size.
double unitOf(const Picture& picture) {
  return std::clamp(std::min(picture.size.width, picture.size.height) / 36.0, 9.0, 60.0);
}

std::string numberText(double value, int decimals, bool scientific) {
  char text[64];
  std::snprintf(text, sizeof text, scientific ? "%.*e" : "%.*f", decimals, value);
  // A comma-decimal locale must not show, and -0 is 0.
  std::string result(text);
  std::replace(result.begin(), result.end(), ',', '.');
  if (result.find_first_of("123456789") == std::string::npos && result[0] == '-')
    result.erase(0, 1);
  return result;
}

void drawColorbar(Picture& picture, const AnnotationSubject& subject, glm::dvec3 ink) {
  const TransferFunction& function = *subject.function;
  const double unit = unitOf(picture);
  const Font font(int(std::lround(unit)));
  const double low = function.colorLow(), high = function.colorHigh();
  const int barWidth = std::max(6, int(unit * 0.9)), right = picture.size.width - int(unit);
  const int top = int(picture.size.height * 0.22), bottom = int(picture.size.height * 0.82);
  for (int y = top; y < bottom; ++y) {
    const double value = high + (low - high) * (y + 0.5 - top) / (bottom - top);
    for (int x = right - barWidth; x < right; ++x) {
      blend(picture, x, y, function.color(value), 1.0);
    }
  }
  const double x0 = right - barWidth, x1 = right;
  for (const auto& [from, to] : {std::pair{glm::dvec2(x0, top), glm::dvec2(x1, top)},
                                 std::pair{glm::dvec2(x0, bottom), glm::dvec2(x1, bottom)},
                                 std::pair{glm::dvec2(x0, top), glm::dvec2(x0, bottom)},
                                 std::pair{glm::dvec2(x1, top), glm::dvec2(x1, bottom)}}) {
    drawLine(picture, from, to, 1.0, ink);
  }
  for (const Tick& tick : ticksOf(low, high)) {
    const double y = bottom + (top - bottom) * (tick.value - low) / (high - low);
    drawLine(picture, {x0 - 0.35 * unit, y}, {x0, y}, 1.0, ink);
    font.draw(picture, {x0 - 0.6 * unit - font.width(tick.text), y + 0.5 * font.digitHeight()},
              tick.text, ink);
  }
  const std::string title =
      subject.units.empty() ? subject.field : subject.field + " [" + subject.units + "]";
  font.draw(picture, {std::max(unit, x1 - font.width(title)), top - 0.8 * unit}, title, ink);
}

/// The names of features that can be seen, each beside its colour.
void drawLegend(Picture& picture, const AnnotationSubject& subject, glm::dvec3 ink) {
  const double unit = unitOf(picture);
  const Font font(int(std::lround(unit)));
  double y = picture.size.height * 0.22;
  for (const Feature& feature : subject.features) {
    if (!feature.enabled || feature.opacity == 0.0) continue;
    const double right = picture.size.width - unit, side = 1.1 * unit;
    for (int row = int(y - side); row < int(y); ++row) {
      for (int x = int(right - side); x < int(right); ++x) {
        blend(picture, x, row, feature.color, 1.0);
      }
    }
    font.draw(picture,
              {std::max(unit, right - side - 0.6 * unit - font.width(feature.name)),
               y - 0.5 * (side - font.digitHeight())},
              feature.name, ink);
    y += 1.8 * unit;
  }
}

void drawAxes(Picture& picture, const AnnotationSubject& subject) {
  const double unit = unitOf(picture);
  const Font font(int(std::lround(unit)));
  const glm::dvec2 origin{3.2 * unit, picture.size.height - 3.2 * unit};
  const glm::dmat4 eyeFromWorld = subject.camera.eyeFromWorld();
  const std::array<glm::dvec3, 3> colors{glm::dvec3(0.9, 0.05, 0.05), glm::dvec3(0.05, 0.6, 0.08),
                                         glm::dvec3(0.08, 0.2, 0.95)};
  std::array<int, 3> order{0, 1, 2};
  const auto axis = [&](int i) { return glm::dvec3(eyeFromWorld[i]); };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return axis(a).z < axis(b).z; });
  for (int i : order) {  // the farthest first
    const glm::dvec3 eye = axis(i);
    const glm::dvec2 flat{eye.x, -eye.y};
    const glm::dvec2 end = origin + 2.2 * unit * flat;
    const glm::dvec3 color = colors[std::size_t(i)];
    drawLine(picture, origin, end, std::max(1.5, unit / 7.0), color);
    const std::string name(1, "xyz"[i]);
    const double length = glm::length(flat);
    const glm::dvec2 away = length > 0.05 ? flat / length : glm::dvec2(0.7, -0.7);
    font.draw(
        picture,
        end + 0.6 * unit * away + glm::dvec2(-0.5 * font.width(name), 0.35 * font.digitHeight()),
        name, color);
  }
}

}  // namespace

std::vector<Tick> ticksOf(double low, double high, int wanted) {
  if (!(high > low) || !std::isfinite(high - low)) return {};
  const double rough = (high - low) / std::max(wanted, 1);
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  const double lead = rough / power;
  const double step = power * (lead < 1.5 ? 1.0 : lead < 3.5 ? 2.0 : lead < 7.5 ? 5.0 : 10.0);
  const double largest = std::max(std::abs(low), std::abs(high));
  const bool scientific = largest >= 1e6 || largest < 1e-3;
  // As many decimals as tell neighbouring ticks apart.
  const double finest = scientific ? step / std::pow(10.0, std::floor(std::log10(largest))) : step;
  const int decimals = std::clamp(int(std::ceil(-std::log10(finest) - 1e-9)), 0, 12);
  std::vector<Tick> ticks;
  const double slack = 1e-9 * (high - low);
  const auto last = std::int64_t(std::floor((high + slack) / step));
  for (auto i = std::int64_t(std::ceil((low - slack) / step)); i <= last; ++i) {
    const double value = double(i) * step;
    ticks.push_back({value, numberText(value, decimals, scientific)});
  }
  return ticks;
}

void drawLine(Picture& picture, glm::dvec2 from, glm::dvec2 to, double width,
              glm::dvec3 colorLinear, double opacity) {
  if (!std::isfinite(from.x + from.y + to.x + to.y)) return;
  const double half = 0.5 * width;
  const glm::dvec2 along = to - from;
  const double squared = std::max(glm::dot(along, along), 1e-12);
  const auto bound = [](double v, int limit) { return int(std::clamp(v, -1.0, double(limit))); };
  const int x0 = bound(std::min(from.x, to.x) - half - 1, picture.size.width);
  const int x1 = bound(std::max(from.x, to.x) + half + 1, picture.size.width);
  const int y0 = bound(std::min(from.y, to.y) - half - 1, picture.size.height);
  const int y1 = bound(std::max(from.y, to.y) + half + 1, picture.size.height);
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      // Coverage falls off over one pixel around the line's edge.
      const glm::dvec2 point{x + 0.5, y + 0.5};
      const double t = std::clamp(glm::dot(point - from, along) / squared, 0.0, 1.0);
      const double distance = glm::length(point - (from + t * along));
      blend(picture, x, y, colorLinear, opacity * std::clamp(half + 0.5 - distance, 0.0, 1.0));
    }
  }
}

void drawBoxEdges(Picture& picture, const AnnotationSubject& subject, bool hidden,
                  glm::dvec3 colorLinear) {
  const Box& box = subject.domain;
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
  const double width = std::max(1.0, unitOf(picture) / 14.0);
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
      const int pieces = subject.camera.projection == Projection::MultiPerspective ? 48 : 1;
      for (int i = 0; i < pieces; ++i) {
        const auto at = [&](int step) {
          const double t = double(step) / pieces;
          return glm::dvec2(subject.camera.project((1.0 - t) * from + t * to, picture.size));
        };
        drawLine(picture, at(i), at(i + 1), width, colorLinear, hidden ? 0.45 : 0.8);
      }
    }
  }
}

glm::dvec3 inkOn(const std::optional<glm::dvec3>& background) {
  const glm::dvec3 back = background.value_or(glm::dvec3(0.0));
  const double luminance = glm::dot(linearFromSrgb(back), glm::dvec3(0.2126, 0.7152, 0.0722));
  return luminance > 0.25 ? glm::dvec3(0.01) : glm::dvec3(0.85);
}

void annotate(Picture& picture, const Annotations& wanted, const AnnotationSubject& subject,
              const std::optional<glm::dvec3>& background) {
  const glm::dvec3 ink = inkOn(background);
  if (wanted.colorbar && subject.function) drawColorbar(picture, subject, ink);
  if (wanted.colorbar) drawLegend(picture, subject, ink);
  if (wanted.axes) drawAxes(picture, subject);
  if (wanted.time) {
    const double unit = unitOf(picture);
    const Font font(int(std::lround(unit)));
    char time[64];
    std::snprintf(time, sizeof time, "t = %.6g", subject.time);
    std::string text(time);
    std::replace(text.begin(), text.end(), ',', '.');
    text += "   cycle " + std::to_string(subject.cycle);
    font.draw(picture, {unit, unit + font.digitHeight()}, text, ink);
  }
}

}  // namespace vestige
