// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <limits>

#include "tests/support/cpu_renderer.h"
#include "tests/support/ray_walk.h"

namespace vestige::test {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

RayImage emptyImage(const MarchRequest& request) {
  RayImage image;
  image.size = request.size;
  image.channels = request.partition.channels();
  const std::size_t pixels = image.size.pixels(), planes = pixels * std::size_t(image.channels);
  const std::size_t layers = pixels * request.isovalues.size();
  image.entry.assign(pixels, 1.0f);
  image.exit.assign(pixels, 0.0f);
  image.first.assign(pixels, 255);
  image.last.assign(pixels, 255);
  if (request.attenuation) {
    image.attenuation.assign(planes, 0.0f);
    image.transmittance.assign(pixels, 1.0f);
  }
  if (request.length) {
    image.length.assign(planes, 0.0f);
    image.moment.assign(planes, 0.0f);
    image.runs.assign(planes, 0.0f);
  }
  image.depth.assign(layers, kInfinity);
  image.normal.assign(layers * 3, 0.0f);
  if (request.mip) image.mip.assign(pixels, std::numeric_limits<float>::quiet_NaN());
  if (request.reference) image.reference.assign(pixels * 3, 0.0f);
  return image;
}

/// What one ray gathers (method §2), in double.
class RayGatherer {
 public:
  RayGatherer(const Scene& scene, const MarchRequest& request, const Ray& ray)
      : scene_(scene),
        request_(request),
        ray_(ray),
        attenuation_(std::size_t(request.partition.channels())),
        length_(attenuation_.size()),
        moment_(attenuation_.size()),
        runs_(attenuation_.size()),
        depth_(request.isovalues.size(), HUGE_VAL),
        normal_(request.isovalues.size()) {}

  void step(double s0, double s1, double f0, double f1) {
    if (first_ < 0) enter_ = s0;
    leave_ = s1;
    for (double f : {f0, f1}) {
      if (std::isfinite(f)) greatest_ = std::max(greatest_, f);
    }
    splitAtBounds(request_.partition, f0, f1, [&](int k, double t0, double t1) {
      segment(k, s0 + t0 * (s1 - s0), s0 + t1 * (s1 - s0), f0 + 0.5 * (t0 + t1) * (f1 - f0));
    });
    crossings(s0, s1, f0, f1);
  }

  void store(RayImage& image, std::size_t pixel) const {
    if (first_ < 0) return;
    const std::size_t pixels = image.size.pixels();
    image.entry[pixel] = float(enter_ * ray_.depthPerLength);
    image.exit[pixel] = float(leave_ * ray_.depthPerLength);
    image.first[pixel] = std::uint8_t(first_);
    image.last[pixel] = std::uint8_t(last_);
    for (std::size_t k = 0; k < length_.size(); ++k) {
      const std::size_t at = k * pixels + pixel;
      if (request_.attenuation) image.attenuation[at] = float(attenuation_[k]);
      if (!request_.length) continue;
      image.length[at] = float(length_[k]);
      image.moment[at] = float(moment_[k]);
      image.runs[at] = float(runs_[k]);
    }
    if (request_.attenuation) image.transmittance[pixel] = float(transmittance_);
    if (request_.mip && greatest_ > -HUGE_VAL) image.mip[pixel] = float(greatest_);
    for (std::size_t c = 0; c < 3; ++c) {
      if (request_.reference) image.reference[c * pixels + pixel] = float(color_[int(c)]);
    }
    for (std::size_t m = 0; m < depth_.size(); ++m) {
      const std::size_t at = m * pixels + pixel;
      image.depth[at] = float(depth_[m]);
      for (std::size_t c = 0; c < 3; ++c) {
        image.normal[(m * 3 + c) * pixels + pixel] = float(normal_[m][int(c)]);
      }
    }
  }

 private:
  void segment(int channel, double s0, double s1, double middle) {
    const auto k = std::size_t(channel);
    if (first_ < 0) first_ = channel;
    if (channel != last_) ++runs_[k];
    last_ = channel;
    length_[k] += s1 - s0;
    moment_[k] += 0.5 * (s0 + s1) * ray_.depthPerLength * (s1 - s0);
    if (channel == request_.partition.noData()) return;
    const double alpha = -std::expm1(-request_.base.extinction(middle) * (s1 - s0));
    attenuation_[k] += transmittance_ * alpha;
    if (request_.reference) color_ += transmittance_ * alpha * request_.base.color(middle);
    transmittance_ *= 1.0 - alpha;
  }

  void crossings(double s0, double s1, double f0, double f1) {
    for (std::size_t m = 0; m < depth_.size(); ++m) {
      const double v = request_.isovalues[m];
      if (depth_[m] < HUGE_VAL || !((f0 < v && f1 >= v) || (f0 >= v && f1 < v))) continue;
      const double s = s0 + (v - f0) / (f1 - f0) * (s1 - s0);
      depth_[m] = s * ray_.depthPerLength;
      glm::dvec3 n = scene_.gradient(ray_.origin + s * ray_.direction);
      n = glm::dvec3(request_.camera.eyeFromWorld() * glm::dvec4(n, 0.0));
      const double size = glm::length(n);
      if (size == 0.0)
        n = {0.0, 0.0, 1.0};
      else
        n /= size;
      const glm::dvec3 towards =
          -glm::dvec3(request_.camera.eyeFromWorld() * glm::dvec4(ray_.direction, 0.0));
      normal_[m] = glm::dot(n, towards) < 0.0 ? -n : n;
    }
  }

  const Scene& scene_;
  const MarchRequest& request_;
  const Ray& ray_;
  double enter_ = 0.0, leave_ = 0.0, transmittance_ = 1.0, greatest_ = -HUGE_VAL;
  int first_ = -1, last_ = -1;
  glm::dvec3 color_{0.0};
  std::vector<double> attenuation_, length_, moment_, runs_, depth_;
  std::vector<glm::dvec3> normal_;
};

}  // namespace

RayImage marchOnCpu(const Scene& scene, const MarchRequest& request, int samplesPerVoxel) {
  RayImage image = emptyImage(request);
  forEachRay(request.camera, request.size, [&](std::size_t pixel, const Ray& ray) {
    RayGatherer gatherer(scene, request, ray);
    walkRay(scene, ray, samplesPerVoxel,
            [&](double s0, double s1, double f0, double f1) { gatherer.step(s0, s1, f0, f1); });
    gatherer.store(image, pixel);
  });
  return image;
}

}  // namespace vestige::test
