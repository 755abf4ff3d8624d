// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

#include "adaptor/plan/classification.h"
#include "adaptor/compositing/march_types.h"
#include "proxy/format/layout/feature_layout.h"
#include "proxy/camera/raster.h"
#include "proxy/format/layout/sliced_stack.h"

namespace vestige {

/// How previews are drawn.
struct PreviewStyle {
  glm::dvec3 background{0.0};  ///< sRGB
  bool transparent = false;
  int threads = 1;
  double pixelAspect = 1.0;  ///< of the proxy; the picture's pixels are square
};

/// A picture of one proxy (kind::k...) for tables and file browsers, made without GL:
///   attenuation  Σ a_k c_k with the base function's interval colours (method §2)
///   length       recomposed with the base function in the pixel's order of mean depths
///   depth        the nearest layer, near is bright
///   mip          the colour map at the largest value
///   reference    itself
///   layered      the reference picture of its own light
/// and of a stack: its slabs as mixtures under the base function.
Raster preview(std::string_view kind, const RayImage& rays, const Classification& classification,
               const PreviewStyle& style);
Raster preview(const SlicedStack& stack, const Classification& classification,
               const PreviewStyle& style);
/// Of features, under the run's look: what each took of the light, or slabs as mixtures.
Raster preview(const FeatureImage& image, const PreviewStyle& style);
Raster preview(const FeatureStack& stack, const PreviewStyle& style);

}  // namespace vestige
