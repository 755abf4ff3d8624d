// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "explorer/annotation/drawing.h"
#include "explorer/picture/look.h"
#include "explorer/picture/picture.h"
#include "explorer/picture/stretch.h"
#include "proxy/transfer/transfer_function.h"

namespace vestige {

/// A line of a legend: a colour, linear, how opaque its sample is drawn, and what it stands for.
struct LegendEntry {
  std::string name;
  glm::dvec3 color{1.0};
  double opacity = 1.0;
};

/// What the annotations of a picture speak of.
struct AnnotationSubject {
  Camera camera;  ///< of the picture, in the scene of `stretch`
  Box domain;     ///< in the world
  Stretch stretch{};
  const TransferFunction* function = nullptr;  ///< for the colour bar
  std::string field, units;
  double time = 0.0;
  long cycle = 0;
  std::vector<LegendEntry> legend{};  ///< in place of a colour bar
};

/// The edges of the domain's box. `hidden`: those that the box itself hides, to be drawn before
/// the volume; else the others, to be drawn after it.
void drawBoxEdges(Picture& picture, const AnnotationSubject& subject, bool hidden, const Ink& ink);

/// Colour bar with ticks and units or legend, axes triad and time label, as asked for; readable on
/// `background` (sRGB; empty = transparent) and on any data.
void annotate(Picture& picture, const Annotations& wanted, const AnnotationSubject& subject,
              const std::optional<glm::dvec3>& background);

}  // namespace vestige
