// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <vector>

#include "adaptor/compositing/march_types.h"
#include "tests/support/scenes.h"

namespace vestige::test {

/// A scene and the look that is baked into its layers, unlit. Values of `opacity` are in the
/// scene's units, opacities per hundredth of the domain's diagonal.
struct LayeredScene {
  const char* name;
  int size;
  const char* colormap;
  std::vector<OpacityPoint> opacity;

  /// Everything `density` times as dense.
  MarchRequest request(const Scene& scene, ImageSize image, double density = 1.0) const {
    std::vector<OpacityPoint> points = opacity;
    for (OpacityPoint& point : points)
      point.opacity = -std::expm1(density * std::log1p(-point.opacity));
    MarchRequest request{.camera = frameBox(scene.domain(), {0, 1, 0}, {0, 0, 1}, image.aspect()),
                         .size = image,
                         .partition = IntervalPartition::uniform(scene.low, scene.high, 16),
                         .base = TransferFunction(points, scene.domain().diagonal() / 100,
                                                  Colormap::named(colormap), scene.low, scene.high),
                         .domain = scene.domain(),
                         .isovalues = {}};
    request.attenuation = request.length = false;
    request.reference = true;
    return request;
  }
};

/// Semi-transparent skin over bone, as in the paper's CT scenes; a plume of smoke; veils of
/// turbulence; smooth shells.
inline const std::vector<LayeredScene> kLayeredScenes{
    {"ct",
     256,
     "hot",
     {{-600, 0}, {-350, 0.06}, {-100, 0.01}, {150, 0.02}, {300, 0.5}, {1200, 0.9}}},
    {"plume", 128, "inferno", {{0.03, 0}, {0.3, 0.15}, {1.0, 0.4}}},
    {"turbulent", 256, "viridis", {{0.55, 0}, {0.8, 0.3}, {1.0, 0.6}}},
    {"smooth", 256, "coolwarm", {{0.2, 0}, {0.3, 0.2}, {0.4, 0}, {0.6, 0}, {0.7, 0.3}, {0.8, 0}}}};

}  // namespace vestige::test
