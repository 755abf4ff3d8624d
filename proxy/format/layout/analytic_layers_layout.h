// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "proxy/format/image/proxy_image.h"

namespace vestige {

/// What is known of a ray's pixel in a layered proxy.
enum class AnalyticLayerState : std::uint8_t {
  Empty = 0,      ///< it meets nothing of any opacity: no layers
  Whole = 1,      ///< nothing of any opacity is outside of its layers
  Saturated = 2,  ///< what is behind its last layer was hidden: not stored
};

/// Light that passes a saturated ray, at most: its layers end where transmittance falls below.
inline constexpr double kSaturatedTransmittance = 0x1p-12;
/// Rays of less opacity are empty.
inline constexpr double kEmptyOpacity = 0x1p-12;
inline constexpr int kMostLayers = 16;

/// Piecewise-analytic layers (method §2), in planes [plane][pixel], pixels row by row from the top.
/// Values of empty pixels are 0.
struct AnalyticLayerPlanes {
  int layers = 0;                         ///< k, 1 .. kMostLayers
  std::vector<float> boundary;            ///< [k + 1] planar depth, rising; front to back
  std::vector<float> color;               ///< [3 k] premultiplied linear RGB of each layer alone
  std::vector<float> tau;                 ///< [k] optical depth of each layer, >= 0
  std::vector<AnalyticLayerState> state;  ///< [1]
};

/// The layered proxy of a view; `kind` of the header is set here. Boundaries in 2046 steps over the
/// domain's depths, at least one step apart; colour in steps of 2^-12, 2^-11 above one half; tau in
/// steps of 2^-12 up to one half and of a half's precision above. Throws InvalidArgument when a
/// plane has another size than the header and `layers` ask for.
ProxyImage layeredImage(ProxyHeader header, const AnalyticLayerPlanes& planes);

/// The planes of a layered proxy, whose values are in their ranges (problemsOf() finds none).
/// Throws NotFound or Format naming what is missing.
AnalyticLayerPlanes layeredPlanes(const ProxyImage& image);

/// How many layers a proxy has, by the channels of its part `tau`; 0 = it is none.
int layersOf(const ProxyImage& image);

}  // namespace vestige
