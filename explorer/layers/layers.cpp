// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/layers/layers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "explorer/recomposition/run_order.h"
#include "proxy/base/parallel.h"

namespace vestige {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Where each channel starts on a ray.
class Fronts {
 public:
  explicit Fronts(const LengthPlanes& lengths) : lengths_(lengths) {}

  /// A channel of one run starts half its length before its mean depth. Where there are several,
  /// the reconstructed order may tell; else the same depth, too far, is all there is: likely.
  void find(std::size_t pixel, float depthPerLength) {
    const IntervalPartition& partition = lengths_.partition();
    depth_.fill(kInfinity);
    likely_.fill(0);
    ray_.clear();
    bool open = false;
    for (int k = 0; k < partition.channels(); ++k) {
      const auto c = std::size_t(k);
      const Plane &length = lengths_.length[c], &mean = lengths_.depth[c];
      if (length.empty() || !(length[pixel] > 0.0f) || mean.empty()) continue;
      const int runs =
          lengths_.runs[c].empty() ? 1 : std::max(1, int(lengths_.runs[c][pixel] + 0.5f));
      ray_.push_back({k, length[pixel], mean[pixel], runs});
      depth_[c] = mean[pixel] - 0.5f * length[pixel] * depthPerLength;
      likely_[c] = runs > 1;
      open = open || runs > 1;
    }
    if (open && !lengths_.first.empty() && !lengths_.last.empty()) order(pixel, depthPerLength);
  }

  float depth(std::size_t channel) const { return depth_[channel]; }
  bool likely(std::size_t channel) const { return likely_[channel] != 0; }

 private:
  void order(std::size_t pixel, float depthPerLength) {
    const IntervalPartition& partition = lengths_.partition();
    double length = 0.0, moment = 0.0;
    for (const RayInterval& interval : ray_) {
      if (interval.channel == partition.noData()) return;  // nobody knows where that lies
      length += interval.length;
      moment += double(interval.length) * interval.depth;
    }
    const RayEnds ends{int(lengths_.first[pixel]) - 1, int(lengths_.last[pixel]) - 1,
                       depthPerLength};
    segments_.clear();
    orderByRuns(ray_, ends, partition, segments_);
    double at = moment / length - 0.5 * length * depthPerLength;
    std::array<bool, kMostChannels> met{};
    for (const Segment& segment : segments_) {
      const auto c = std::size_t(segment.channel);
      if (likely_[c] && !met[c] && !segment.ambiguous) {
        depth_[c] = float(at);
        likely_[c] = 0;
      }
      met[c] = true;
      at += double(segment.amount) * depthPerLength;
    }
  }

  static constexpr std::size_t kMostChannels = IntervalPartition::kMaxIntervals + 3;
  const LengthPlanes& lengths_;
  std::array<float, kMostChannels> depth_;
  std::array<std::uint8_t, kMostChannels> likely_;
  std::vector<RayInterval> ray_;
  std::vector<Segment> segments_;
};

/// Calls `work(pixel, fronts)` for every pixel, on all cores.
template <typename Work>
void forRays(const LengthPlanes& lengths, const Work& work) {
  const ProxyHeader& header = lengths.header;
  parallelRanges(header.size.height, [&](int begin, int end) {
    Fronts fronts(lengths);
    for (int y = begin; y < end; ++y) {
      for (int x = 0; x < header.size.width; ++x) {
        const double ratio =
            header.camera.projection == Projection::Orthographic
                ? 1.0
                : header.camera.rayThrough({x + 0.5, y + 0.5}, header.size).depthPerLength;
        const auto pixel = std::size_t(y) * std::size_t(header.size.width) + std::size_t(x);
        fronts.find(pixel, float(ratio));
        work(pixel, fronts);
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
  LayerPlanes planes{layers.header.camera,     layers.header.size,   std::move(layers.depth),
                     std::move(layers.normal), layers.header.domain, {}};
  if (!lengths || lengths->header.size != planes.size) return planes;
  planes.likely.assign(planes.depth.size(),
                       std::vector<std::uint8_t>(planes.size.pixels(), std::uint8_t{0}));
  forRays(*lengths, [&](std::size_t i, const Fronts& fronts) {
    for (std::size_t k = 0; k < layerOf.size(); ++k) {
      if (layerOf[k] < 0) continue;
      const float front = fronts.depth(k);
      if (!(front < kInfinity)) continue;
      float& z = planes.depth[std::size_t(layerOf[k])][i];
      // A stored crossing keeps its place; completed depths are told apart by having no normal.
      const Plane& normal = planes.normal[std::size_t(layerOf[k])];
      const bool stored =
          z < kInfinity && !normal.empty() &&
          (normal[3 * i] != 0.0f || normal[3 * i + 1] != 0.0f || normal[3 * i + 2] != 0.0f);
      if (!stored && (normal.empty() ? !(z < kInfinity) : front < z)) {
        z = front;
        planes.likely[std::size_t(layerOf[k])][i] = fronts.likely(k);
      }
    }
  });
  return planes;
}

LayerPlanes layersFromLengths(const LengthPlanes& lengths, std::vector<int>& layerOf) {
  LayerPlanes planes{lengths.header.camera, lengths.header.size, {}, {}, lengths.header.domain, {}};
  layerOf.assign(std::size_t(lengths.partition().channels()), -1);
  for (int k = 0; k < lengths.partition().noData(); ++k) {
    if (lengths.length[std::size_t(k)].empty()) continue;
    layerOf[std::size_t(k)] = int(planes.depth.size());
    planes.depth.emplace_back(planes.size.pixels(), kInfinity);
    planes.normal.emplace_back();
    planes.likely.emplace_back(planes.size.pixels(), std::uint8_t{0});
  }
  forRays(lengths, [&](std::size_t i, const Fronts& fronts) {
    for (std::size_t k = 0; k < layerOf.size(); ++k) {
      if (layerOf[k] < 0) continue;
      planes.depth[std::size_t(layerOf[k])][i] = fronts.depth(k);
      planes.likely[std::size_t(layerOf[k])][i] = fronts.likely(k);
    }
  });
  return planes;
}

}  // namespace vestige
