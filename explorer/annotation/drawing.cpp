// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/annotation/drawing.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "proxy/transfer/colormap.h"

namespace vestige {
namespace {

void blend(Picture& picture, int x, int y, glm::dvec3 color, double cover) {
  if (x < 0 || y < 0 || x >= picture.size.width || y >= picture.size.height || cover <= 0.0) return;
  float* pixel = picture.pixel(x, y);
  const float share = float(std::min(cover, 1.0));
  for (int c = 0; c < 3; ++c) pixel[c] = pixel[c] * (1.0f - share) + share * float(color[c]);
  pixel[3] = pixel[3] * (1.0f - share) + share;
}

/// The pixels whose distance from a shape may be below `reach`, each with its middle.
template <typename Draw>
void forPixels(const Picture& picture, glm::dvec2 low, glm::dvec2 high, double reach,
               const Draw& draw) {
  const auto bound = [](double v, int limit) { return int(std::clamp(v, -1.0, double(limit))); };
  for (int y = bound(low.y - reach, picture.size.height);
       y <= bound(high.y + reach, picture.size.height); ++y) {
    for (int x = bound(low.x - reach, picture.size.width);
         x <= bound(high.x + reach, picture.size.width); ++x) {
      draw(x, y, glm::dvec2(x + 0.5, y + 0.5));
    }
  }
}

}  // namespace

Ink inkOn(const std::optional<glm::dvec3>& background) {
  const glm::dvec3 back = background.value_or(glm::dvec3(0.0));
  const double luminance = glm::dot(linearFromSrgb(back), glm::dvec3(0.2126, 0.7152, 0.0722));
  // Where black and white stand out alike (WCAG 2.1: (L1 + 0.05) / (L2 + 0.05)).
  const bool bright = luminance > 0.179;
  return {bright ? glm::dvec3(0.01) : glm::dvec3(0.9), bright ? glm::dvec3(1.0) : glm::dvec3(0.005),
          background ? 0.85 : 0.9};
}

double letterHeight(ImageSize size) {
  const double side = std::min(size.width, size.height);
  return std::min(std::max(12.0, 15.0 * std::pow(side / 512.0, 0.6)), std::max(6.0, side / 14.0));
}

void drawLine(Picture& picture, glm::dvec2 from, glm::dvec2 to, double width,
              glm::dvec3 colorLinear, double opacity) {
  if (!std::isfinite(from.x + from.y + to.x + to.y)) return;
  const double half = 0.5 * width;
  const glm::dvec2 along = to - from;
  const double squared = std::max(glm::dot(along, along), 1e-12);
  forPixels(picture, glm::min(from, to), glm::max(from, to), half + 1.0,
            [&](int x, int y, glm::dvec2 point) {
              // Coverage falls off over one pixel around the line's edge.
              const double t = std::clamp(glm::dot(point - from, along) / squared, 0.0, 1.0);
              const double distance = glm::length(point - (from + t * along));
              blend(picture, x, y, colorLinear,
                    opacity * std::clamp(half + 0.5 - distance, 0.0, 1.0));
            });
}

void drawPlate(Picture& picture, glm::dvec2 low, glm::dvec2 high, double radius,
               glm::dvec3 colorLinear, double opacity) {
  const glm::dvec2 middle = 0.5 * (low + high);
  const glm::dvec2 half = 0.5 * (high - low) - radius;
  forPixels(picture, low, high, 1.0, [&](int x, int y, glm::dvec2 point) {
    const glm::dvec2 beyond = glm::abs(point - middle) - half;
    const double distance = glm::length(glm::max(beyond, glm::dvec2(0.0))) +
                            std::min(std::max(beyond.x, beyond.y), 0.0) - radius;
    blend(picture, x, y, colorLinear, opacity * std::clamp(0.5 - distance, 0.0, 1.0));
  });
}

void drawBackplate(Picture& picture, glm::dvec2 low, glm::dvec2 high, double radius,
                   const Ink& ink) {
  const double rim = std::max(1.0, letterHeight(picture.size) / 16.0);
  drawPlate(picture, low - rim, high + rim, radius + rim, ink.ink, 0.35);
  drawPlate(picture, low, high, radius, ink.plate, ink.plateOpacity);
}

void drawRimmedLine(Picture& picture, glm::dvec2 from, glm::dvec2 to, double width,
                    glm::dvec3 colorLinear, const Ink& ink, double opacity) {
  drawLine(picture, from, to, width + 2.0, ink.plate, 0.6 * opacity * ink.plateOpacity);
  drawLine(picture, from, to, width, colorLinear, opacity);
}

void drawRimmedText(Picture& picture, const Font& font, glm::dvec2 origin, const std::string& text,
                    glm::dvec3 colorLinear, const Ink& ink) {
  const double rim = std::max(1.0, font.digitHeight() / 10.0);
  for (int i = 0; i < 8; ++i) {
    const double angle = 0.785398163 * i;
    font.draw(picture, origin + rim * glm::dvec2(std::cos(angle), std::sin(angle)), text,
              ink.plate);
  }
  font.draw(picture, origin, text, colorLinear);
}

std::string shortened(const std::string& text, const Font& font, double width) {
  if (font.width(text) <= width) return text;
  std::string kept = text;
  while (!kept.empty() && font.width(kept + "…") > width) {
    // Whole letters of UTF-8.
    while (!kept.empty() && (kept.back() & 0xc0) == 0x80) kept.pop_back();
    if (!kept.empty()) kept.pop_back();
  }
  return kept + "…";
}

}  // namespace vestige
