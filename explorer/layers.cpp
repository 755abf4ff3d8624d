// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/layers.h"

#include <cmath>
#include <limits>

#include "explorer/parallel.h"

namespace vestige {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Where a channel starts on a ray if it is one run; +inf where it is absent.
float frontOf(const LengthPlanes& lengths, std::size_t channel, std::size_t pixel,
              float depthPerLength) {
  const Plane& length = lengths.length[channel];
  if (length.empty() || !(length[pixel] > 0.0f) || lengths.depth[channel].empty()) {
    return kInfinity;
  }
  return lengths.depth[channel][pixel] - 0.5f * length[pixel] * depthPerLength;
}

/// Calls `work(pixel, depthPerLength)` for every pixel, on all cores.
template <typename Work>
void forRays(const ProxyHeader& header, const Work& work) {
  parallelRanges(header.size.height, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      for (int x = 0; x < header.size.width; ++x) {
        const double ratio =
            header.camera.projection == Projection::Orthographic
                ? 1.0
                : header.camera.rayThrough({x + 0.5, y + 0.5}, header.size).depthPerLength;
        work(std::size_t(y) * std::size_t(header.size.width) + std::size_t(x), float(ratio));
      }
    }
  });
}

}  // namespace

std::vector<int> layerOfChannels(const IntervalPartition& partition,
                                 const std::vector<double>& isovalues) {
  std::vector<int> layers(std::size_t(partition.channels()), -1);
  for (int k = 0; k < partition.noData(); ++k) {
    const double middle =
        k == partition.below() ? partition.low()
        : k == partition.above()
            ? partition.high()
            : 0.5 * (partition.bounds()[std::size_t(k)] + partition.bounds()[std::size_t(k) + 1]);
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t m = 0; m < isovalues.size(); ++m) {
      const double distance = std::abs(isovalues[m] - middle);
      if (distance < nearest) {
        nearest = distance;
        layers[std::size_t(k)] = int(m);
      }
    }
  }
  return layers;
}

LayerPlanes completedLayers(DepthLayers layers, const LengthPlanes* lengths,
                            const std::vector<int>& layerOf) {
  LayerPlanes planes{layers.header.camera, layers.header.size, std::move(layers.depth),
                     std::move(layers.normal)};
  if (!lengths || lengths->header.size != planes.size) return planes;
  forRays(lengths->header, [&](std::size_t i, float depthPerLength) {
    for (std::size_t k = 0; k < layerOf.size(); ++k) {
      if (layerOf[k] < 0) continue;
      const float front = frontOf(*lengths, k, i, depthPerLength);
      if (!(front < kInfinity)) continue;
      float& z = planes.depth[std::size_t(layerOf[k])][i];
      // A stored crossing keeps its place; completed depths are told apart by having no normal.
      const Plane& normal = planes.normal[std::size_t(layerOf[k])];
      const bool stored =
          z < kInfinity && !normal.empty() &&
          (normal[3 * i] != 0.0f || normal[3 * i + 1] != 0.0f || normal[3 * i + 2] != 0.0f);
      if (!stored && (normal.empty() ? !(z < kInfinity) : front < z)) z = front;
    }
  });
  return planes;
}

LayerPlanes layersFromLengths(const LengthPlanes& lengths, std::vector<int>& layerOf) {
  LayerPlanes planes{lengths.header.camera, lengths.header.size, {}, {}};
  layerOf.assign(std::size_t(lengths.partition().channels()), -1);
  for (int k = 0; k < lengths.partition().noData(); ++k) {
    if (lengths.length[std::size_t(k)].empty()) continue;
    layerOf[std::size_t(k)] = int(planes.depth.size());
    planes.depth.emplace_back(planes.size.pixels(), kInfinity);
    planes.normal.emplace_back();
  }
  forRays(lengths.header, [&](std::size_t i, float depthPerLength) {
    for (std::size_t k = 0; k < layerOf.size(); ++k) {
      if (layerOf[k] < 0) continue;
      planes.depth[std::size_t(layerOf[k])][i] = frontOf(lengths, k, i, depthPerLength);
    }
  });
  return planes;
}

}  // namespace vestige
