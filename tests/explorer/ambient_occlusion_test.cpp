// SPDX-License-Identifier: BSD-3-Clause
//
// Proxy ambient occlusion (visualization-by-proxy §5, eq. 5) in a groove, where the answer is
// known.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "explorer/layer_pass.h"
#include "proxy/gl/device.h"
#include "proxy/gl/functions.h"

namespace vestige {
namespace {

constexpr ImageSize kSize{96, 48};
constexpr double kRadius = 12.0;  // in pixels, as all lengths here
constexpr int kBottom = 32;

/// A plateau, a steep wall down to x = 32, a gentle one up to x = 64, a plateau; the same for all
/// y.
double height(double x) {
  if (x < 24.0 || x > 64.0) return 0.0;
  return x < kBottom ? -2.0 * (x - 24.0) : -0.5 * (64.0 - x);
}

glm::dvec3 normal(double x) {
  const double slope = (height(x + 0.01) - height(x - 0.01)) / 0.02;
  return glm::normalize(glm::dvec3(-slope, 0.0, 1.0));
}

LayerPlanes groove() {
  LayerPlanes planes;
  planes.size = kSize;
  planes.domain = {{0.0, 0.0, -50.0}, {96.0, 48.0, 50.0}};
  planes.camera.position = {48.0, 24.0, 100.0};
  planes.camera.forward = {0.0, 0.0, -1.0};
  planes.camera.up = {0.0, 1.0, 0.0};
  planes.camera.viewHeight = kSize.height;
  planes.camera.nearDepth = 1.0;
  planes.camera.farDepth = 200.0;
  planes.depth.emplace_back();
  planes.normal.emplace_back();
  for (std::size_t i = 0; i < kSize.pixels(); ++i) {
    const double x = double(i % std::size_t(kSize.width)) + 0.5;
    planes.depth[0].push_back(float(100.0 - height(x)));
  }
  planes.normal[0].resize(3 * kSize.pixels());
  for (std::size_t i = 0; i < kSize.pixels(); ++i) {
    const glm::dvec3 n = normal(double(i % std::size_t(kSize.width)) + 0.5);
    for (std::size_t c = 0; c < 3; ++c) planes.normal[0][c * kSize.pixels() + i] = float(n[int(c)]);
  }
  return planes;
}

/// What the shader leaves open along the middle row.
std::vector<double> openness(NormalSource normals) {
  std::vector<float> pixels(4 * kSize.pixels());
  gl::Device::create()->run([&] {
    LayerPass pass;
    const LayerTextures layers(groove());
    LightSetup setup;
    setup.shade = false;
    setup.normals = normals;
    setup.ao = {true, 1.0, 0.0};
    setup.aoRadiusWorld = kRadius;
    const gl::Texture light = pass.light(layers, setup);
    light.bind(0);
    gl::functions().GetTexImage(GL_TEXTURE_2D_ARRAY, 0, GL_RGBA, GL_FLOAT, pixels.data());
  });
  std::vector<double> row;
  for (int x = 0; x < kSize.width; ++x) {
    row.push_back(double(pixels[4 * std::size_t(kSize.height / 2 * kSize.width + x)]));
  }
  return row;
}

/// The share of the hemisphere, by the cosine rule, that the groove covers within the radius.
double covered(double x) {
  const glm::dvec3 n = normal(x), side{n.z, 0.0, -n.x}, other{0.0, 1.0, 0.0};
  constexpr int kRays = 2000;
  int hits = 0;
  for (int i = 0; i < kRays; ++i) {
    const double u = (i + 0.5) / kRays, angle = 2.0 * std::numbers::pi * 0.61803398875 * i;
    const glm::dvec3 d =
        std::sqrt(u) * (std::cos(angle) * side + std::sin(angle) * other) + std::sqrt(1.0 - u) * n;
    for (double t = 0.25; t < kRadius; t += 0.25) {
      if (height(x + t * d.x) <= height(x) + t * d.z + 1e-3) continue;
      ++hits;
      break;
    }
  }
  return double(hits) / kRays;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const double n = double(a.size());
  double sa = 0, sb = 0, aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sa += a[i], sb += b[i], aa += a[i] * a[i], bb += b[i] * b[i], ab += a[i] * b[i];
  }
  return (n * ab - sa * sb) / std::sqrt((n * aa - sa * sa) * (n * bb - sb * sb));
}

TEST(AmbientOcclusion, DarkensAGrooveAndNotThePlanesBesideIt) {
  for (const NormalSource normals : {NormalSource::Stored, NormalSource::Depth}) {
    const auto open = openness(normals);
    for (int x : {4, 10, 18, 70, 76}) EXPECT_GE(open[std::size_t(x)], 0.99) << "plateau " << x;
    for (int x : {48, 52, 56}) EXPECT_GE(open[std::size_t(x)], 0.97) << "gentle wall " << x;
    EXPECT_LE(open[kBottom], 0.75);
    EXPECT_LE(open[kBottom - 1], 0.75);
  }
}

TEST(AmbientOcclusion, FollowsWhatTheGrooveHidesOfTheHemisphere) {
  const auto open = openness(NormalSource::Stored);
  std::vector<double> kernel, truth;
  for (int x = int(kRadius); x < kSize.width - int(kRadius); ++x) {
    kernel.push_back(1.0 - open[std::size_t(x)]);
    truth.push_back(covered(x + 0.5));
  }
  EXPECT_GT(correlation(kernel, truth), 0.8);
}

}  // namespace
}  // namespace vestige
