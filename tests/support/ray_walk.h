// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "proxy/camera/camera.h"
#include "proxy/transfer/interval_partition.h"
#include "tests/support/scenes.h"

namespace vestige::test {

/// Where a ray is inside a box before it ends, as lengths along it; first > second: nowhere.
inline std::pair<double, double> insideBox(const Ray& ray, const Box& box) {
  double enter = 0.0, leave = ray.lastDepth / ray.depthPerLength;
  for (int axis = 0; axis < 3; ++axis) {
    const double o = ray.origin[axis], d = ray.direction[axis];
    if (std::abs(d) < 1e-14) {
      if (o < box.low[axis] || o > box.high[axis]) return {1.0, 0.0};
      continue;
    }
    const double a = (box.low[axis] - o) / d, b = (box.high[axis] - o) / d;
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return {enter, leave};
}

/// Calls step(s0, s1, f0, f1) for a step whose ends have these values. Where one of them is NaN, it
/// calls twice: each end's half is as that end is (method §1).
template <typename Step>
void forHalves(double s0, double s1, double f0, double f1, const Step& step) {
  if (std::isfinite(f0) == std::isfinite(f1)) {
    step(s0, s1, f0, f1);
    return;
  }
  const double middle = 0.5 * (s0 + s1);
  step(s0, middle, f0, f0);
  step(middle, s1, f1, f1);
}

/// Calls step(s0, s1, f0, f1) for equal sub-steps of a ray from its entry into the domain to its
/// exit; s = length along the ray, f = the field there.
template <typename Step>
void walkRay(const Scene& scene, const Ray& ray, int samplesPerVoxel, const Step& step) {
  const auto [enter, leave] = insideBox(ray, scene.domain());
  if (!(enter < leave)) return;
  const double wanted = scene.minimumSpacing() / samplesPerVoxel;
  const int steps = std::max(1, int(std::ceil((leave - enter) / wanted)));
  const double length = (leave - enter) / steps;
  double s0 = enter, f0 = scene.sample(ray.origin + enter * ray.direction);
  for (int i = 1; i <= steps; ++i) {
    const double s1 = i == steps ? leave : enter + i * length;
    const double f1 = scene.sample(ray.origin + s1 * ray.direction);
    forHalves(s0, s1, f0, f1, step);
    s0 = s1;
    f0 = f1;
  }
}

/// A step of a ray: lengths along it, the field at its ends, the middle of the whole step where it
/// is cut, or of its half (forHalves).
struct RayStep {
  double s0, s1, f0, f1, middle;
};

/// Calls step(RayStep) between samples at planar depths Z_0 + i * stepDepth, Z_0 the least depth of
/// the domain's corners, the field linear between them; the steps at entry and exit are cut there.
template <typename Step>
void walkAnchored(const Scene& scene, const Camera& camera, const Ray& ray, double stepDepth,
                  const Step& step) {
  const Box domain = scene.domain();
  const auto [enter, leave] = insideBox(ray, domain);
  if (!(enter < leave)) return;
  double depthOrigin = HUGE_VAL;
  for (int i = 0; i < 8; ++i) {
    depthOrigin =
        std::min(depthOrigin, glm::dot(domain.corner(i) - camera.position, camera.forward));
  }
  const auto lengthTo = [&](double i) {
    return (depthOrigin + i * stepDepth) / ray.depthPerLength;
  };
  double index = std::floor((enter * ray.depthPerLength - depthOrigin) / stepDepth);
  double s0 = lengthTo(index), f0 = scene.sample(ray.origin + s0 * ray.direction);
  for (; s0 < leave; ++index) {
    const double s1 = lengthTo(index + 1.0), f1 = scene.sample(ray.origin + s1 * ray.direction);
    forHalves(s0, s1, f0, f1, [&](double begin, double end, double first, double last) {
      const auto fieldAt = [&](double s) {
        return first + (s - begin) / (end - begin) * (last - first);
      };
      const double a = std::max(begin, enter), b = std::min(end, leave);
      if (a < b) step(RayStep{a, b, fieldAt(a), fieldAt(b), 0.5 * (begin + end)});
    });
    s0 = s1;
    f0 = f1;
  }
}

/// Calls segment(t0, t1), 0 <= t0 < t1 <= 1, in order, for the stretches into which `values`
/// (ascending) cut a linear stretch of field from f0 to f1, both finite.
template <typename Segment>
void splitAt(std::span<const double> values, double f0, double f1, const Segment& segment) {
  const auto first = std::upper_bound(values.begin(), values.end(), std::min(f0, f1));
  const auto last = std::lower_bound(first, values.end(), std::max(f0, f1));
  double t0 = 0.0;
  const auto cut = [&](double value) {
    const double t1 = std::clamp((value - f0) / (f1 - f0), t0, 1.0);
    if (t1 > t0) segment(t0, t1);
    t0 = t1;
  };
  if (f1 > f0) {
    for (auto value = first; value != last; ++value) cut(*value);
  } else {
    for (auto value = last; value != first; --value) cut(*(value - 1));
  }
  if (t0 < 1.0) segment(t0, 1.0);
}

/// Calls segment(channel, t0, t1), 0 <= t0 < t1 <= 1, for the stretches of a linear stretch of
/// field from f0 to f1 between which the channel changes, in order. No data at either end = all of
/// it.
template <typename Segment>
void splitAtBounds(const IntervalPartition& partition, double f0, double f1,
                   const Segment& segment) {
  if (!std::isfinite(f0) || !std::isfinite(f1)) {
    segment(partition.noData(), 0.0, 1.0);
    return;
  }
  splitAt(partition.bounds(), f0, f1, [&](double t0, double t1) {
    segment(partition.channelOf(f0 + 0.5 * (t0 + t1) * (f1 - f0)), t0, t1);
  });
}

/// Calls pixel(index, ray) for every pixel, rows shared out among all cores. Thread-safe bodies.
template <typename Pixel>
void forEachRay(const Camera& camera, ImageSize size, const Pixel& pixel) {
  std::atomic<int> next{0};
  const auto work = [&] {
    for (int y = next++; y < size.height; y = next++) {
      for (int x = 0; x < size.width; ++x) {
        pixel(std::size_t(y) * std::size_t(size.width) + std::size_t(x),
              camera.rayThrough({x + 0.5, y + 0.5}, size));
      }
    }
  };
  std::vector<std::jthread> threads;
  for (unsigned i = 1; i < std::max(1u, std::thread::hardware_concurrency()); ++i) {
    threads.emplace_back(work);
  }
  work();
}

}  // namespace vestige::test
