// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "proxy/format/exr/exr_file.h"
#include "proxy/format/image/proxy_image.h"

namespace vestige {

/// A plane of one channel, pixel by pixel; empty = the channel is zero everywhere.
using Plane = std::vector<float>;

/// Opacity lengths of a view (method §2): [channel] planes of ℓ, mean depth and run count.
struct LengthPlanes {
  ProxyHeader header;
  double unit = 1.0;  ///< lengths are whole multiples of 2^-12 unit, or halves times it
  std::vector<Plane> length, depth, runs;
  Plane first, last;  ///< 1 + the channel in which a ray enters and leaves; empty = not stored

  const IntervalPartition& partition() const { return *header.partition; }
};

/// Accumulated attenuation of a view: [channel] planes of a_k.
struct AttenuationPlanes {
  ProxyHeader header;
  std::vector<Plane> attenuation;

  const IntervalPartition& partition() const { return *header.partition; }
};

/// Depth layers of a view, in the order of the isovalues.
struct DepthLayers {
  ProxyHeader header;
  std::vector<Plane> depth;   ///< planar Z, +inf = no hit
  std::vector<Plane> normal;  ///< 3 floats a pixel, unit, eye space; empty = none stored

  int count() const { return int(depth.size()); }
};

/// From a file, parts decoded on several threads. Throw Format or NotFound naming file, channel and
/// what is missing, or out of its range (outOfRange() in proxy/format/layout/proxy_check.h): what follows relies
/// on finite depths, lengths >= 0 and numbers of runs.
LengthPlanes readLengthPlanes(const ExrFile& file);
ProxyImage readImage(const ExrFile& file);

/// From a proxy in memory, whose values are in their ranges. Throw Format or NotFound naming what
/// is missing.
LengthPlanes lengthPlanes(ProxyImage image);
AttenuationPlanes attenuationPlanes(ProxyImage image);
DepthLayers depthLayers(ProxyImage image);

}  // namespace vestige
