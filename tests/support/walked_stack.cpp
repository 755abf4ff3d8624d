// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/walked_stack.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/support/ray_walk.h"

namespace vestige::test {
namespace {

constexpr int kRanks = IntervalPartition::kMaxIntervals + 3;

/// What a ray met in one slab, in planar depth.
struct CellSum {
  std::array<double, kRanks> length{}, moment{};
  int first = -1, last = -1;  ///< ranks

  void add(int rank, double z0, double z1) {
    if (first < 0) first = rank;
    last = rank;
    length[std::size_t(rank)] += z1 - z0;
    moment[std::size_t(rank)] += (z1 - z0) * 0.5 * (z0 + z1);
  }
};

/// Whole levels that add up to all of them, by largest remainder.
std::array<int, kRanks> quantised(const CellSum& sum, int levels) {
  std::array<int, kRanks> result{};
  std::array<double, kRanks> rest{};
  double all = 0.0;
  for (const double length : sum.length) all += length;
  int left = levels;
  for (std::size_t r = 0; r < kRanks; ++r) {
    const double share = sum.length[r] / all * levels;
    result[r] = int(share);
    rest[r] = sum.length[r] > 0.0 ? share - result[r] : -1.0;
    left -= result[r];
  }
  for (; left > 0; --left) {
    const auto most = std::max_element(rest.begin(), rest.end());
    ++result[std::size_t(most - rest.begin())];
    *most -= 1.0;
  }
  return result;
}

StackCell cellOf(const CellSum& sum, double near, double far, int levels, int noData,
                 std::vector<std::uint8_t>& out) {
  const auto whole = quantised(sum, levels);
  StackCell cell;
  cell.begin = std::uint32_t(out.size());
  cell.noData = std::uint8_t(whole[std::size_t(noData)]);
  int lowest = noData, highest = -1;
  for (int r = 0; r < noData; ++r) {
    if (whole[std::size_t(r)] == 0) continue;
    lowest = std::min(lowest, r);
    highest = r;
  }
  if (highest < 0) return cell;
  cell.lowest = std::uint8_t(lowest);
  cell.count = std::uint8_t(highest - lowest + 1);
  for (int r = lowest; r <= highest; ++r) out.push_back(std::uint8_t(whole[std::size_t(r)]));
  const auto place = [&](int rank) {
    const auto r = std::size_t(rank);
    const double share = (sum.moment[r] / sum.length[r] - near) / (far - near);
    return 1 + std::clamp(int(share * SlicedStack::kTurns), 0, SlicedStack::kTurns - 1);
  };
  const int a = std::min(sum.first, sum.last), b = std::max(sum.first, sum.last);
  cell.setTurns(lowest < a ? place(lowest) : 0, highest > b ? place(highest) : 0);
  return cell;
}

}  // namespace

SlicedStack walkedStack(
    ProxyHeader header, int levels,
    const std::function<void(std::size_t pixel, const StretchSink& sink)>& stretches) {
  SlicedStack stack;
  stack.header = std::move(header);
  stack.header.kind = kind::kSliced;
  stack.levels = levels;
  const IntervalPartition& partition = *stack.header.partition;
  const std::vector<double>& depths = stack.header.slabDepths;
  const std::size_t slabs = depths.size() - 1, pixels = stack.header.size.pixels();
  const int noData = partition.rankOf(partition.noData());
  stack.slabs.resize(slabs);
  for (StackSlab& slab : stack.slabs) slab.cells.resize(pixels);
  stack.faces.assign(slabs + 1, std::vector<std::uint8_t>(pixels, SlicedStack::kOutside));
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    std::vector<CellSum> cells(slabs);
    double near = HUGE_VAL, far = -HUGE_VAL;
    stretches(pixel, [&](const LinearStretch& part) {
      near = std::min(near, part.z0);
      far = std::max(far, part.z1);
      splitAtBounds(partition, part.f0, part.f1, [&](int channel, double t0, double t1) {
        const int rank = partition.rankOf(channel);
        const double a = std::lerp(part.z0, part.z1, t0), b = std::lerp(part.z0, part.z1, t1);
        for (std::size_t s = 0; s < slabs; ++s) {
          const double from = std::max(a, depths[s]), to = std::min(b, depths[s + 1]);
          if (from < to) cells[s].add(rank, from, to);
        }
      });
    });
    for (std::size_t s = 0; s < slabs; ++s) {
      StackSlab& slab = stack.slabs[s];
      slab.cells[pixel].begin = std::uint32_t(slab.levels.size());
      if (cells[s].first < 0) continue;
      slab.cells[pixel] = cellOf(cells[s], std::max(near, depths[s]), std::min(far, depths[s + 1]),
                                 levels, noData, slab.levels);
      stack.faces[s][pixel] = std::uint8_t(cells[s].first);
      stack.faces[s + 1][pixel] = std::uint8_t(cells[s].last);
    }
  }
  return stack;
}

SlicedStack walkedStack(const Scene& scene, const Camera& camera, ImageSize size,
                        const IntervalPartition& partition, int slabs, int levels,
                        int samplesPerVoxel) {
  ProxyHeader header;
  header.field = "field";
  header.view = "front";
  header.camera = camera;
  header.size = size;
  header.domain = scene.domain();
  header.partition = partition;
  header.statistics.low = scene.low;
  header.statistics.high = scene.high;
  header.slabDepths = evenSlabs(camera, header.domain, slabs);
  return walkedStack(header, levels, [&](std::size_t pixel, const StretchSink& sink) {
    const auto width = std::size_t(size.width);
    const Ray ray =
        camera.rayThrough({double(pixel % width) + 0.5, double(pixel / width) + 0.5}, size);
    walkRay(scene, ray, samplesPerVoxel, [&](double s0, double s1, double f0, double f1) {
      sink({s0 * ray.depthPerLength, s1 * ray.depthPerLength, f0, f1});
    });
  });
}

std::vector<double> evenSlabs(const Camera& camera, const Box& domain, int slabs) {
  double near = HUGE_VAL, far = -HUGE_VAL;
  for (int i = 0; i < 8; ++i) {
    const double z = glm::dot(domain.corner(i) - camera.position, camera.forward);
    near = std::min(near, z);
    far = std::max(far, z);
  }
  std::vector<double> depths;
  for (int s = 0; s <= slabs; ++s) depths.push_back(std::lerp(near, far, double(s) / slabs));
  return depths;
}

VoxelView voxelView(const Scene& scene, glm::dvec3 forward, glm::dvec3 up) {
  VoxelView view;
  view.camera = frameBox(scene.domain(), forward, up, 1.0);
  const glm::dvec3 right = view.camera.right();
  const auto along = [&](glm::dvec3 way) {
    const glm::dvec3 a = glm::abs(way);
    return a.x > a.y && a.x > a.z ? 0 : a.y > a.z ? 1 : 2;
  };
  const int across = along(right), upward = along(view.camera.up);
  view.size = {scene.size[std::size_t(across)], scene.size[std::size_t(upward)]};
  // A hair narrower, so that rays through the outermost samples do not miss the domain by rounding.
  view.camera.viewHeight = view.size.height * scene.spacing[upward] * (1.0 - 1e-5);
  view.camera.pixelAspect = scene.spacing[across] / scene.spacing[upward];
  return view;
}

}  // namespace vestige::test
