// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "adaptor/compositing/march_types.h"

namespace vestige {

/// An image in which every ray misses.
RayImage emptyImage(const MarchRequest& request);

/// How many planes march.glsl puts for a request.
std::size_t planeCount(const MarchRequest& request);

/// Takes over the planes of rows [firstRow, firstRow + rows), one after another as march.glsl puts
/// them.
void takePlanes(const float* planes, const MarchRequest& request, int firstRow, int rows,
                RayImage& image);

}  // namespace vestige
