// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/vec4.hpp>
#include <optional>

#include "explorer/annotation/annotate.h"
#include "proxy/customization/customization.h"

namespace vestige {

/// Draws the seeds of enabled primitives as discs, joined along the edges of their primitive, those
/// of changed corners as well. Colours by Annotations::seeds: Identity: one for each primitive,
/// corners grey; Value: blue where a seed makes less of what it passes and red where more (of
/// opacity, else of gamma, whose great values make less, else of blending), and the shift's own
/// colour where there is one. `plane` (n, d) of a slice, in the scene: seeds fade with their
/// distance from it.
void drawSeeds(Picture& picture, Seeds mode, const Customization& customization,
               const AnnotationSubject& subject, const std::optional<glm::dvec4>& plane = {});

}  // namespace vestige
