// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/classified_renderer.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "tests/support/headlight.h"
#include "tests/support/ray_walk.h"

namespace vestige::test {
namespace {

/// Lengths along a ray at which it is sampled: its entry, anchored depths, its exit.
template <typename Step>
void walkSamples(const Box& domain, const ClassifiedView& view, double stepDepth, const Ray& ray,
                 const Step& step) {
  const auto [enter, leave] = insideBox(ray, domain);
  if (!(enter < leave)) return;
  double origin = HUGE_VAL;
  for (int i = 0; i < 8; ++i) {
    origin =
        std::min(origin, glm::dot(domain.corner(i) - view.camera.position, view.camera.forward));
  }
  const auto lengthTo = [&](double i) { return (origin + i * stepDepth) / ray.depthPerLength; };
  double index = std::floor((enter * ray.depthPerLength - origin) / stepDepth);
  double s0 = enter;
  while (s0 < leave) {
    const double s1 = std::min(lengthTo(++index), leave);
    if (s1 > s0 && !step(s0, s1)) return;
    s0 = std::max(s0, s1);
  }
}

double depthOfStep(const FieldScenes& scenes, const ClassifiedView& view) {
  return scenes.fields[0].minimumSpacing() / view.samplesPerVoxel;
}

struct Light {
  glm::dvec3 color{0.0};
  double transmittance = 1.0;

  /// A homogeneous stretch; white comes on top of what is emitted.
  void add(double extinction, const glm::dvec3& emission, const Headlight& headlight,
           double length) {
    const double depth = extinction * length;
    const double alpha = -std::expm1(-depth);
    // ∫ e^(-σ s) ds; without extinction, the length.
    const double seen = depth > 0.0 ? alpha / extinction : length;
    color += transmittance * (emission * (seen * headlight.own) + headlight.white * alpha);
    transmittance *= 1.0 - alpha;
  }
};

/// Sums over channels of a look.
struct Mixed {
  double extinction = 0.0;
  glm::dvec3 emission{0.0};

  Mixed(std::span<const double> weights, std::span<const ChannelOptics> optics) {
    for (std::size_t k = 0; k < weights.size(); ++k) {
      extinction += weights[k] * optics[k].extinction;
      emission += weights[k] * optics[k].emission;
    }
  }
};

/// Gradients of Σ factor w by differences over a grid point before and after.
class Slopes {
 public:
  Slopes(const FieldScenes& scenes, const Classifier& classifier, const glm::dvec3& world)
      : channels_(classifier.channels().size()), spacing_(scenes.fields[0].spacing) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const int side : {0, 1}) {
        glm::dvec3 beside = world;
        beside[axis] += (2 * side - 1) * spacing_[axis];
        const FieldSample at = scenes.sample(beside, classifier.needsGradient());
        auto& weights = weights_[std::size_t(2 * axis + side)];
        weights.resize(channels_);
        classifier.weights(at, at, weights);
      }
    }
  }
  /// 0 where all that is left of the differences is their rounding.
  template <typename Factor>
  glm::dvec3 of(const Factor& factor) const {
    glm::dvec3 rise(0.0);
    double scale = 0.0;
    for (std::size_t k = 0; k < channels_; ++k) scale = std::max(scale, std::abs(factor(k)));
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t k = 0; k < channels_; ++k)
        rise[int(axis)] += factor(k) * (weights_[2 * axis + 1][k] - weights_[2 * axis][k]);
    return glm::length(rise) > 1e-10 * scale ? rise / (2.0 * spacing_) : glm::dvec3(0.0);
  }

 private:
  std::size_t channels_;
  glm::dvec3 spacing_;
  std::array<std::vector<double>, 6> weights_;
};

RgbPicture blank(ImageSize size) { return {size, std::vector<float>(size.pixels() * 3, 0.0f)}; }

void store(RgbPicture& picture, std::size_t pixel, const glm::dvec3& color) {
  for (int c = 0; c < 3; ++c) picture.rgb[3 * pixel + std::size_t(c)] = float(color[c]);
}

/// One ray's light under every look.
std::vector<Light> lightOf(const FieldScenes& scenes, const Classifier& classifier,
                           std::span<const std::vector<ChannelOptics>> looks,
                           const ClassifiedView& view, const Ray& ray) {
  const std::vector<double> densities = classifier.densities();
  std::vector<Light> lights(looks.size());
  std::vector<double> weights(classifier.channels().size());
  const auto sample = [&](double s) {
    return scenes.sample(ray.origin + s * ray.direction, classifier.needsGradient());
  };
  double sampledAt = -1.0;
  FieldSample last;
  walkSamples(scenes.fields[0].domain(), view, depthOfStep(scenes, view), ray,
              [&](double s0, double s1) {
                const FieldSample a = sampledAt == s0 ? last : sample(s0);
                last = sample(s1);
                sampledAt = s1;
                classifier.weights(a, last, weights);
                if (std::all_of(weights.begin(), weights.end(), [](double w) { return w == 0.0; }))
                  return true;
                std::optional<Slopes> slopes;
                if (view.lit)
                  slopes.emplace(scenes, classifier, ray.origin + 0.5 * (s0 + s1) * ray.direction);
                bool seen = false;
                for (std::size_t i = 0; i < looks.size(); ++i) {
                  const Mixed mixed(weights, looks[i]);
                  Headlight headlight;
                  if (slopes) {
                    const glm::dvec3 slope = slopes->of([&](std::size_t k) {
                      return densities.empty() ? looks[i][k].extinction : densities[k];
                    });
                    headlight = headlightOn(slope, ray.direction);
                  }
                  lights[i].add(mixed.extinction, mixed.emission, headlight, s1 - s0);
                  seen = seen || lights[i].transmittance > 1e-8;
                }
                return seen;
              });
  return lights;
}

}  // namespace

FieldScenes::FieldScenes(std::vector<Scene> scenes) : fields(std::move(scenes)) {
  for (const Scene& scene : fields) {
    std::vector<float> sorted = scene.values;
    const auto middle = sorted.begin() + long(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    domains.push_back({scene.low, scene.high, double(*middle)});
  }
}

FieldSample FieldScenes::sample(const glm::dvec3& world, bool gradient) const {
  FieldSample sample;
  double square = 0.0;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    sample.values[i] = fields[i].sample(world);
    if (!gradient) continue;
    const glm::dvec3 slope = fields[i].gradient(world) / domains[i].range();
    square += glm::dot(slope, slope);
  }
  sample.gradient = std::sqrt(square);
  return sample;
}

std::vector<RgbPicture> renderClassified(const FieldScenes& scenes, const Classifier& classifier,
                                         std::span<const std::vector<ChannelOptics>> looks,
                                         const ClassifiedView& view) {
  std::vector<RgbPicture> pictures(looks.size(), blank(view.size));
  forEachRay(view.camera, view.size, [&](std::size_t pixel, const Ray& ray) {
    const std::vector<Light> lights = lightOf(scenes, classifier, looks, view, ray);
    for (std::size_t i = 0; i < looks.size(); ++i) store(pictures[i], pixel, lights[i].color);
  });
  return pictures;
}

RgbPicture renderMaximum(const FieldScenes& scenes, const Classifier& classifier,
                         const ClassifiedView& view) {
  RgbPicture picture = blank(view.size);
  forEachRay(view.camera, view.size, [&](std::size_t pixel, const Ray& ray) {
    double most = NAN;
    const auto meet = [&](double s) {
      const double value = scenes.fields[0].sample(ray.origin + s * ray.direction);
      if (std::isfinite(value) && !(value <= most)) most = value;
    };
    walkSamples(scenes.fields[0].domain(), view, depthOfStep(scenes, view), ray,
                [&](double s0, double s1) {
                  meet(s0);
                  meet(s1);
                  return true;
                });
    store(picture, pixel, classifier.maximum()->color(most));
  });
  return picture;
}

}  // namespace vestige::test
