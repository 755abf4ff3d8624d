// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/vec2.hpp>
#include <span>
#include <string>
#include <vector>

#include "explorer/look.h"
#include "explorer/picture.h"
#include "proxy/classifier/classifier.h"
#include "proxy/transfer_function.h"

namespace vestige {

/// What the annotations of a picture speak of.
struct AnnotationSubject {
  Camera camera;  ///< of the picture
  Box domain;
  const TransferFunction* function = nullptr;  ///< for the colour bar
  std::string field, units;
  double time = 0.0;
  long cycle = 0;
  std::span<const Feature> features{};  ///< for the legend, in place of the colour bar
};

/// A tick of the colour bar: a round value and its text. All texts of a bar have equally many
/// decimals; large and small ranges use one exponent.
struct Tick {
  double value;
  std::string text;
};
/// About `wanted` ticks at round values inside [low, high].
std::vector<Tick> ticksOf(double low, double high, int wanted = 6);

/// An antialiased line in linear RGB.
void drawLine(Picture& picture, glm::dvec2 from, glm::dvec2 to, double width,
              glm::dvec3 colorLinear, double opacity = 1.0);

/// The edges of the domain's box. `hidden`: those that the box itself hides, to be drawn before
/// the volume; else the others, to be drawn after it.
void drawBoxEdges(Picture& picture, const AnnotationSubject& subject, bool hidden,
                  glm::dvec3 colorLinear);

/// Colour bar with ticks and units or legend of features, axes triad and time label, as asked for.
/// The colour of text is chosen to stand out from `background` (sRGB; empty = transparent).
void annotate(Picture& picture, const Annotations& wanted, const AnnotationSubject& subject,
              const std::optional<glm::dvec3>& background);
/// The colour of lines and letters on that background, linear.
glm::dvec3 inkOn(const std::optional<glm::dvec3>& background);

}  // namespace vestige
