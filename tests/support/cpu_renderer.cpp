// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/cpu_renderer.h"

#include <memory>

#include "tests/support/headlight.h"
#include "tests/support/ray_walk.h"

namespace vestige::test {
namespace {

/// Light gathered front to back (method §1).
struct Light {
  glm::dvec3 color{0.0};
  double transmittance = 1.0;

  void add(const Optics& optics, double length) { add(optics.extinction, optics.color, length); }
  void add(double extinction, const glm::dvec3& own, double length) {
    if (extinction <= 0.0) return;
    const double alpha = -std::expm1(-extinction * length);
    color += transmittance * alpha * own;
    transmittance *= 1.0 - alpha;
  }
};

std::vector<RgbPicture> blackPictures(std::size_t count, ImageSize size) {
  return std::vector<RgbPicture>(count, {size, std::vector<float>(size.pixels() * 3, 0.0f)});
}

void store(RgbPicture& picture, std::size_t pixel, const Light& light) {
  for (int c = 0; c < 3; ++c) picture.rgb[pixel * 3 + std::size_t(c)] = float(light.color[c]);
}

}  // namespace

std::vector<RgbPicture> renderIntervals(const Scene& scene, const Camera& camera, ImageSize size,
                                        const IntervalPartition& partition,
                                        std::span<const IntervalLook> looks, int samplesPerVoxel) {
  auto pictures = blackPictures(looks.size(), size);
  forEachRay(camera, size, [&](std::size_t pixel, const Ray& ray) {
    std::vector<Light> lights(looks.size());
    const auto flush = [&](int channel, double length) {
      if (channel < 0 || length <= 0.0) return;
      const auto k = std::size_t(channel);
      for (std::size_t i = 0; i < looks.size(); ++i) {
        lights[i].add(looks[i].extinction[k], looks[i].color[k], length);
      }
    };
    // Neighbouring stretches of one channel are one homogeneous stretch.
    int channel = -1;
    double length = 0.0;
    walkRay(scene, ray, samplesPerVoxel, [&](double s0, double s1, double f0, double f1) {
      splitAtBounds(partition, f0, f1, [&](int k, double t0, double t1) {
        if (k != channel) {
          flush(channel, length);
          channel = k;
          length = 0.0;
        }
        length += (t1 - t0) * (s1 - s0);
      });
    });
    flush(channel, length);
    for (std::size_t i = 0; i < looks.size(); ++i) store(pictures[i], pixel, lights[i]);
  });
  return pictures;
}

std::vector<RgbPicture> renderContinuous(const Scene& scene, const Camera& camera, ImageSize size,
                                         std::span<const Medium> media, int samplesPerVoxel) {
  auto pictures = blackPictures(media.size(), size);
  forEachRay(camera, size, [&](std::size_t pixel, const Ray& ray) {
    std::vector<Light> lights(media.size());
    walkRay(scene, ray, samplesPerVoxel, [&](double s0, double s1, double f0, double f1) {
      if (!std::isfinite(f0 + f1)) return;
      const double early = 0.75 * f0 + 0.25 * f1, late = 0.25 * f0 + 0.75 * f1;
      const double half = 0.5 * (s1 - s0);
      for (std::size_t i = 0; i < media.size(); ++i) {
        if (lights[i].transmittance < 1e-7) continue;
        lights[i].add(media[i](early), half);
        lights[i].add(media[i](late), half);
      }
    });
    for (std::size_t i = 0; i < media.size(); ++i) store(pictures[i], pixel, lights[i]);
  });
  return pictures;
}

namespace {

constexpr int kSubSteps = 32;

}  // namespace

RgbPicture renderReference(const Scene& scene, const MarchRequest& request) {
  RgbPicture picture = blackPictures(1, request.size)[0];
  std::vector<double> points;
  for (const OpacityPoint& point : request.base.opacityPoints()) points.push_back(point.value);
  const double stepDepth = request.stepLength > 0.0 ? request.stepLength : scene.minimumSpacing();
  forEachRay(request.camera, request.size, [&](std::size_t pixel, const Ray& ray) {
    Light light;
    const auto step = [&](const RayStep& part) {
      if (!std::isfinite(part.f0 + part.f1) || light.transmittance < 1e-9) return;
      Headlight headlight;
      if (request.phong) {
        headlight =
            headlightOn(scene.gradient(ray.origin + part.middle * ray.direction), ray.direction);
      }
      splitAt(points, part.f0, part.f1, [&](double t0, double t1) {
        const double length = (part.s1 - part.s0) * (t1 - t0) / kSubSteps;
        for (int i = 0; i < kSubSteps; ++i) {
          const double t = t0 + (i + 0.5) / kSubSteps * (t1 - t0);
          const double f = part.f0 + t * (part.f1 - part.f0);
          const double extinction = request.base.extinction(f);
          if (extinction <= 0.0) continue;
          light.add(extinction, request.base.color(f) * headlight.own + headlight.white, length);
        }
      });
    };
    walkAnchored(scene, request.camera, ray, stepDepth, step);
    store(picture, pixel, light);
  });
  return picture;
}

Medium tabulated(const Medium& medium, double low, double high, int entries) {
  auto table = std::make_shared<std::vector<Optics>>();
  for (int i = 0; i <= entries; ++i) table->push_back(medium(low + (high - low) * i / entries));
  return [table, low, scale = entries / (high - low), entries](double value) {
    if (!std::isfinite(value)) return Optics{};
    const double u = std::clamp((value - low) * scale, 0.0, double(entries));
    const int i = std::min(int(u), entries - 1);
    const Optics &a = (*table)[std::size_t(i)], &b = (*table)[std::size_t(i) + 1];
    const double t = u - i;
    return Optics{a.extinction + t * (b.extinction - a.extinction),
                  a.color + t * (b.color - a.color)};
  };
}

}  // namespace vestige::test
