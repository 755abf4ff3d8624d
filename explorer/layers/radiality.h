// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "explorer/recomposition/decode.h"

namespace vestige {

/// Histogram of the angle between the surface normal and the ray, back to where it came from, at
/// the hits of depth layers, in bins of ten degrees [Tikhonova 2010, §4.4, Fig. 6b-d].
/// Surfaces that rays graze are sampled thinly and hide much: mass at high angles predicts large
/// errors of turned views. Pixels without a stored normal are left out.
struct Radiality {
  static constexpr int kBins = 9;
  std::array<std::uint64_t, kBins> counts{};
  std::uint64_t beyond60 = 0;

  std::uint64_t hits() const;
  /// The share of hits at more than 60 degrees; 0 without hits.
  double shareBeyond60() const;
};

Radiality radialityOf(const DepthLayers& layers);

}  // namespace vestige
