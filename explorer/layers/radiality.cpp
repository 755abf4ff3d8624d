// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/layers/radiality.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace vestige {

std::uint64_t Radiality::hits() const {
  return std::accumulate(counts.begin(), counts.end(), std::uint64_t(0));
}

double Radiality::shareBeyond60() const {
  const std::uint64_t all = hits();
  return all > 0 ? double(beyond60) / double(all) : 0.0;
}

Radiality radialityOf(const DepthLayers& layers) {
  Radiality radiality;
  const ProxyHeader& header = layers.header;
  const glm::dmat3 eyeFromWorld(header.camera.eyeFromWorld());
  for (int y = 0; y < header.size.height; ++y) {
    for (int x = 0; x < header.size.width; ++x) {
      const auto i = std::size_t(y) * std::size_t(header.size.width) + std::size_t(x);
      const glm::dvec3 back =
          -(eyeFromWorld * header.camera.rayThrough({x + 0.5, y + 0.5}, header.size).direction);
      for (std::size_t m = 0; m < layers.depth.size(); ++m) {
        if (!std::isfinite(layers.depth[m][i]) || layers.normal[m].empty()) continue;
        const float* const n = layers.normal[m].data() + 3 * i;
        const glm::dvec3 normal(n[0], n[1], n[2]);
        const double length = glm::length(normal);
        if (!(length > 0.5)) continue;
        const double cosine = std::clamp(glm::dot(normal, back) / length, 0.0, 1.0);
        const double degrees = std::acos(cosine) * 180.0 / std::numbers::pi;
        ++radiality.counts[std::size_t(std::min(int(degrees / 10.0), Radiality::kBins - 1))];
        radiality.beyond60 += degrees > 60.0;
      }
    }
  }
  return radiality;
}

}  // namespace vestige
