// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>

#include "explorer/annotation/text.h"
#include "explorer/picture/picture.h"

namespace vestige {

/// How lines and letters are drawn so that they can be read on a background, whatever data lie
/// under them: in `ink`, on a plate or with a rim of `plate`. Linear RGB.
struct Ink {
  glm::dvec3 ink, plate;
  double plateOpacity;
};
/// On a background in sRGB; empty = transparent, which may end up before anything.
Ink inkOn(const std::optional<glm::dvec3>& background);

/// The height of letters, which annotations are measured by: it grows with the picture, but less
/// than it, and stays legible in small ones.
double letterHeight(ImageSize size);

/// An antialiased line in linear RGB.
void drawLine(Picture& picture, glm::dvec2 from, glm::dvec2 to, double width,
              glm::dvec3 colorLinear, double opacity = 1.0);
/// A box with round corners.
void drawPlate(Picture& picture, glm::dvec2 low, glm::dvec2 high, double radius,
               glm::dvec3 colorLinear, double opacity);
/// The plate behind annotations. Its thin rim tells it from what is behind it, also where the
/// background is of its colour.
void drawBackplate(Picture& picture, glm::dvec2 low, glm::dvec2 high, double radius,
                   const Ink& ink);
/// A line, text in `color`, each with a rim.
void drawRimmedLine(Picture& picture, glm::dvec2 from, glm::dvec2 to, double width,
                    glm::dvec3 colorLinear, const Ink& ink, double opacity = 1.0);
void drawRimmedText(Picture& picture, const Font& font, glm::dvec2 origin, const std::string& text,
                    glm::dvec3 colorLinear, const Ink& ink);
/// The text, or as much of its beginning as `width` holds and an ellipsis.
std::string shortened(const std::string& text, const Font& font, double width);

}  // namespace vestige
