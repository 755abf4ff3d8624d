// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "explorer/annotation/annotate.h"
#include "explorer/annotation/drawing.h"

namespace vestige {

/// The colour bar of the subject's function with ticks and units, on a plate at the right. Nothing
/// where the picture is too small to hold it.
void drawColorBar(Picture& picture, const AnnotationSubject& subject, const Ink& ink);
/// The subject's legend: names beside their colours, on a plate at the right; as many as there is
/// room for.
void drawLegend(Picture& picture, const AnnotationSubject& subject, const Ink& ink);

}  // namespace vestige
