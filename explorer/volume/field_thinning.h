// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "proxy/format/layout/field_layout.h"

namespace vestige {

/// What every OpenGL takes along a side of a 3-D texture.
inline constexpr int kMostTextureSide = 2048;

/// The field with at most so many samples along each axis. Longer axes keep their ends; their new
/// samples are means over what lies around them, without data where less than half of that has any.
FieldSamples thinned(FieldSamples field, int most = kMostTextureSide);

}  // namespace vestige
