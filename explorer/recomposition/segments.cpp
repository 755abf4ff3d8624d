// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/recomposition/segments.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "explorer/recomposition/run_order.h"
#include "explorer/recomposition/segment_builder.h"

namespace vestige {
namespace {

/// What is stored of the rays of successive pixels. Gathered a cache line of each plane at a time.
class StoredRays {
 public:
  StoredRays(const LengthPlanes& planes, bool noData) : planes_(planes), noData_(noData) {}

  /// The channels that the ray of this pixel meets; valid until the next call.
  std::span<RayInterval> at(std::size_t pixel) {
    if (pixel < begin_ || pixel >= begin_ + kTile) gather(pixel);
    const std::size_t i = pixel - begin_;
    return {rays_[i].data(), counts_[i]};
  }

 private:
  static constexpr std::size_t kTile = 16;

  void gather(std::size_t pixel) {
    begin_ = pixel;
    counts_.fill(0);
    const std::size_t tile = std::min(kTile, planes_.header.size.pixels() - pixel);
    const IntervalPartition& partition = planes_.partition();
    for (int k = 0; k < partition.channels(); ++k) {
      const auto c = std::size_t(k);
      if (planes_.length[c].empty() || (k == partition.noData() && !noData_)) continue;
      const float* length = planes_.length[c].data() + pixel;
      const float* depth = planes_.depth[c].empty() ? nullptr : planes_.depth[c].data() + pixel;
      const float* runs = planes_.runs[c].empty() ? nullptr : planes_.runs[c].data() + pixel;
      for (std::size_t i = 0; i < tile; ++i) {
        if (!(length[i] > 0.0f)) continue;
        rays_[i][counts_[i]++] = {k, length[i], depth ? depth[i] : 0.0f,
                                  runs ? std::max(1, int(runs[i] + 0.5f)) : 1};
      }
    }
  }

  const LengthPlanes& planes_;
  bool noData_;
  std::size_t begin_ = std::numeric_limits<std::size_t>::max() - kTile;
  std::array<std::array<RayInterval, IntervalPartition::kMaxIntervals + 3>, kTile> rays_;
  std::array<std::size_t, kTile> counts_{};
};

}  // namespace

Order resolvedOrder(Order order, ImageSize size) {
  if (order != Order::Auto) return order;
  return size.pixels() <= kRunsPixels ? Order::Runs : Order::Mean;
}

namespace {
// The 16 bits are those of a float below its sign: exponents 102 to 133 and 11 bits of mantissa.
constexpr int kDroppedBits = 12;
constexpr std::uint32_t kLeastBits = 102u << 23;
constexpr std::uint32_t kMostBits = (0xffffu << kDroppedBits) + kLeastBits;
}  // namespace

std::uint32_t amountBits(float value) {
  const float bounded =
      std::min(std::max(std::bit_cast<float>(kLeastBits), value), std::bit_cast<float>(kMostBits));
  const std::uint32_t half = 1u << (kDroppedBits - 1);
  return (std::bit_cast<std::uint32_t>(bounded) - kLeastBits + half) >> kDroppedBits;
}

float amountValue(std::uint32_t bits) {
  return std::bit_cast<float>((bits << kDroppedBits) + kLeastBits);
}

std::vector<Segment> SegmentLists::at(std::size_t pixel) const {
  std::vector<Segment> segments;
  if (first[pixel] == kNone) return segments;
  for (std::size_t i = first[pixel];; ++i) {
    const std::uint32_t entry = entries[i];
    segments.push_back({int(entry >> 16 & kMostChannel), float(amountValue(entry & 0xffffu) * unit),
                        (entry & kAmbiguous) != 0, (entry & kMixed) != 0});
    if (entry & kLast) return segments;
  }
}

SegmentLists segmentsFromLength(const LengthPlanes& planes, Order wanted) {
  const Order order = resolvedOrder(wanted, planes.header.size);
  const IntervalPartition& partition = planes.partition();
  const ImageSize size = planes.header.size;
  const Camera& camera = planes.header.camera;
  const bool ends = order == Order::Runs && !planes.first.empty() && !planes.last.empty();
  const bool slanted = camera.projection != Projection::Orthographic;
  // In diagonals amounts are between 0 and 1, where a half is precise to 2^-11 of any of them.
  const double diagonal = planes.header.domain.diagonal();
  const double unit = diagonal > 0.0 ? diagonal : 1.0;
  // No data is transparent: never a segment, but it takes its place along the ray.
  StoredRays rays(planes, order == Order::Runs);
  return buildSegmentLists(
      size, unit,
      [=, &planes, &partition, &camera](std::size_t i, std::vector<Segment>& out) mutable {
        const std::span<RayInterval> ray = rays.at(i);
        if (ray.empty()) return;
        if (order == Order::Mean) {
          orderByMeanDepth(ray, out);
          return;
        }
        RayEnds rayEnds;
        if (ends) {
          rayEnds.first = int(planes.first[i]) - 1;
          rayEnds.last = int(planes.last[i]) - 1;
        }
        if (slanted) {
          const auto x = double(i % std::size_t(size.width)),
                     y = double(i / std::size_t(size.width));
          rayEnds.depthPerLength =
              float(camera.rayThrough({x + 0.5, y + 0.5}, size).depthPerLength);
        }
        orderByRuns(ray, rayEnds, partition, out);
      });
}

std::vector<int> nestedOrder(const IntervalPartition& partition) {
  std::vector<int> order{partition.below()};
  for (int k = 0; k < partition.intervals(); ++k) order.push_back(k);
  order.push_back(partition.above());
  return order;
}

SegmentLists segmentsFromAttenuation(const AttenuationPlanes& planes, std::span<const int> order) {
  constexpr double kDeepest = 60.0;  // 1 - A below 1e-26 is opaque whatever the factor
  return buildSegmentLists(planes.header.size, 1.0, [&](std::size_t i, std::vector<Segment>& out) {
    double left = 1.0;
    for (int k : order) {
      const Plane& plane = planes.attenuation[std::size_t(k)];
      const double a = plane.empty() ? 0.0 : double(plane[i]);
      if (!(a > 0.0) || left <= 0.0) continue;
      const double after = std::max(left - a, 0.0);
      const double depth = after > 0.0 ? std::min(std::log(left / after), kDeepest) : kDeepest;
      out.push_back({k, float(depth), true});
      left = after;
    }
    if (out.size() == 1) out.front().ambiguous = false;
  });
}

}  // namespace vestige
