// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>

#include "proxy/format/image/proxy_image.h"
#include "proxy/format/image/storage_scale.h"

namespace vestige {

// Proxy images from the planes that rays gathered (adaptor/compositing/march_types.h). Planes follow each
// other, each of header.size pixels row by row from the top; `kind` of the header is set here.
// Values are rounded to the steps below, so that they compress well and survive storage bit for
// bit; the largest rounding error stands in the part's `error`. Throws InvalidArgument when a span
// has another size than the header asks for.

/// Fractions of light a_k of every channel of header.partition, and what is left, T (method §2).
/// Step 2^-12 below one half, 2^-11 above.
ProxyImage attenuationImage(ProxyHeader header, std::span<const float> attenuation,
                            std::span<const float> transmittance);

/// Lengths, mean depths m_k / ℓ_k and runs of every channel of header.partition (method §2). Length
/// in steps of diagonal / 2^13 up to a quarter of the domain's diagonal, then of half's precision;
/// lengths below half a step are 0, and so are their mean depths and runs. Mean depth in 2047 steps
/// over the domain's depths along the view. Runs up to 2047. `first`, `last`: the channels in which
/// rays enter and leave (255 = miss); both or neither.
ProxyImage lengthImage(ProxyHeader header, std::span<const float> length,
                       std::span<const float> moment, std::span<const float> runs,
                       std::span<const std::uint8_t> first = {},
                       std::span<const std::uint8_t> last = {});

/// One layer for each of header.isovalues: planar depth Z (+inf = no hit) to 2^-20 of the domain's
/// diagonal, and unit normals in steps of 1/128 (planes nx, ny, nz of layer 0, then of layer 1
/// ...).
ProxyImage depthImage(ProxyHeader header, std::span<const float> depth,
                      std::span<const float> normal);

/// How largest values are held in memory and in files: as they are, {1, 0}, where floats tell 2^16
/// steps of the intervals' range apart; else value = held * unit + zero, with 1 .. 2 in the range.
StorageScale mipScale(const IntervalPartition& intervals);
/// Largest value along the ray, held so, NaN = none; to 2^-16 of the range that header.statistics
/// gives, or not rounded when that is empty.
ProxyImage mipImage(ProxyHeader header, std::span<const float> value);

/// Premultiplied linear RGB (three planes) and A = 1 - T; step 2^-12 below one half, 2^-11 above.
ProxyImage referenceImage(ProxyHeader header, std::span<const float> rgb,
                          std::span<const float> transmittance);

/// The range of planar depths of a box seen by a camera, low <= high.
struct DepthRange {
  double low, high;
};
DepthRange depthRange(const Camera& camera, const Box& box);

}  // namespace vestige
