// SPDX-License-Identifier: BSD-3-Clause
//
// Proxy ambient occlusion [Tikhonova 2010, §5, eq. 5] in a groove and on a ball, where the
// answer is known.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "explorer/layers/depth_layer_pass.h"
#include "proxy/gl/device.h"
#include "proxy/gl/functions.h"

namespace vestige {
namespace {

constexpr ImageSize kSize{96, 48};
constexpr double kRadius = 12.0;  // in pixels, as all lengths here
constexpr int kBottom = 32;
constexpr double kNothing = -std::numeric_limits<double>::infinity();

using Height = std::function<double(double x, double y)>;

/// A plateau, a steep wall down to x = 32, a gentle one up to x = 64, a plateau, the same for all
/// y; with all of it rising by `tilt` along `turn`.
Height groove(double tilt = 0.0, double turn = 0.0) {
  return [=](double x, double y) {
    const double plane = tilt * (std::cos(turn) * x + std::sin(turn) * y);
    if (x < 24.0 || x > 64.0) return plane;
    return plane + (x < kBottom ? -2.0 * (x - 24.0) : -0.5 * (64.0 - x));
  };
}

/// The upper half of a ball; far below beside it.
double ball(double x, double y) {
  const double rest = 22.0 * 22.0 - (x - 48.0) * (x - 48.0) - (y - 24.0) * (y - 24.0);
  return rest > 0.0 ? std::sqrt(rest) : kNothing;
}

glm::dvec3 normal(const Height& height, double x, double y) {
  const double e = 0.01;
  return glm::normalize(glm::dvec3((height(x - e, y) - height(x + e, y)) / (2.0 * e),
                                   (height(x, y - e) - height(x, y + e)) / (2.0 * e), 1.0));
}

/// y upward, as in eye space: row r is at y = rows - r - 1/2.
LayerPlanes layer(const Height& height) {
  LayerPlanes planes;
  planes.size = kSize;
  planes.domain = {{0.0, 0.0, -50.0}, {96.0, 48.0, 50.0}};
  planes.camera.position = {48.0, 24.0, 300.0};
  planes.camera.forward = {0.0, 0.0, -1.0};
  planes.camera.up = {0.0, 1.0, 0.0};
  planes.camera.viewHeight = kSize.height;
  planes.camera.nearDepth = 1.0;
  planes.camera.farDepth = 600.0;
  planes.depth.emplace_back();
  planes.normal.emplace_back(3 * kSize.pixels());
  for (std::size_t i = 0; i < kSize.pixels(); ++i) {
    const double x = double(i % std::size_t(kSize.width)) + 0.5;
    const double y = kSize.height - double(i / std::size_t(kSize.width)) - 0.5;
    planes.depth[0].push_back(float(300.0 - height(x, y)));
    const glm::dvec3 n = normal(height, x, y);
    for (std::size_t c = 0; c < 3; ++c) planes.normal[0][3 * i + c] = float(n[int(c)]);
  }
  return planes;
}

/// What the shader leaves open, pixel by pixel.
std::vector<double> openness(const Height& height, NormalSource normals = NormalSource::Stored) {
  std::vector<float> pixels(4 * kSize.pixels());
  gl::Device::create()->run([&] {
    DepthLayerPass pass;
    const LayerTextures layers(layer(height));
    LightSetup setup;
    setup.shade = false;
    setup.normals = normals;
    setup.ao = {true, 1.0, 0.0};
    setup.aoRadiusWorld = kRadius;
    const gl::Texture light = pass.light(layers, setup);
    light.bind(0);
    gl::functions().GetTexImage(GL_TEXTURE_2D_ARRAY, 0, GL_RGBA, GL_FLOAT, pixels.data());
  });
  std::vector<double> open;
  for (std::size_t i = 0; i < kSize.pixels(); ++i) open.push_back(double(pixels[4 * i]));
  return open;
}

constexpr double kRow = kSize.height / 2 - 0.5;  // y of the row that is looked at
std::size_t inRow(int x) { return std::size_t(kSize.height / 2 * kSize.width + x); }

/// The share of the hemisphere, by the cosine rule, that is covered within the radius.
double covered(const Height& height, double x, double y) {
  const glm::dvec3 n = normal(height, x, y);
  const glm::dvec3 side = glm::normalize(glm::dvec3(n.z, 0.0, -n.x)), other = glm::cross(n, side);
  constexpr int kRays = 2000;
  int hits = 0;
  for (int i = 0; i < kRays; ++i) {
    const double u = (i + 0.5) / kRays, angle = 2.0 * std::numbers::pi * 0.61803398875 * i;
    const glm::dvec3 d =
        std::sqrt(u) * (std::cos(angle) * side + std::sin(angle) * other) + std::sqrt(1.0 - u) * n;
    for (double t = 0.25; t < kRadius; t += 0.25) {
      if (height(x + t * d.x, y + t * d.y) <= height(x, y) + t * d.z + 1e-3) continue;
      ++hits;
      break;
    }
  }
  return double(hits) / kRays;
}

/// An isotropic unsharp mask: how much higher the neighbourhood is, by a Gaussian; not below 0.
double masked(const Height& height, double x, double y, double width) {
  double sum = 0.0, weights = 0.0;
  for (int j = -24; j <= 24; ++j) {
    for (int i = -24; i <= 24; ++i) {
      const double weight = std::exp(-(i * i + j * j) / (2.0 * width * width));
      sum += weight * (height(x + i, y + j) - height(x, y));
      weights += weight;
    }
  }
  return std::max(0.0, sum / weights);
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
    const auto open = openness(groove(), normals);
    for (int x : {4, 10, 18, 80, 86}) EXPECT_GE(open[inRow(x)], 0.99) << "plateau " << x;
    for (int x : {48, 52, 56}) EXPECT_GE(open[inRow(x)], 0.97) << "gentle wall " << x;
    EXPECT_LE(open[inRow(kBottom)], 0.75);
    EXPECT_LE(open[inRow(kBottom - 1)], 0.75);
  }
}

/// However the groove is tilted, and whatever width suits the mask best.
TEST(AmbientOcclusion, FollowsWhatIsHiddenOfTheHemisphereBetterThanAnUnsharpMask) {
  for (const double tilt : {0.0, 0.5, 1.0, 1.5}) {
    for (const double turn : {0.0, 0.8, 1.5707963, 3.1415927}) {
      const Height height = groove(tilt, turn);
      const auto open = openness(height);
      std::vector<double> kernel, truth;
      double off = 0.0;
      for (int x = int(kRadius); x < kSize.width - int(kRadius); ++x) {
        kernel.push_back(1.0 - open[inRow(x)]);
        truth.push_back(covered(height, x + 0.5, kRow));
        off = std::max(off, std::abs(kernel.back() - truth.back()));
      }
      double mask = -1.0;
      for (const double width : {2.0, 3.0, 4.0, 6.0, 8.0}) {
        std::vector<double> values;
        for (int x = int(kRadius); x < kSize.width - int(kRadius); ++x) {
          values.push_back(masked(height, x + 0.5, kRow, width));
        }
        mask = std::max(mask, correlation(values, truth));
      }
      EXPECT_GT(correlation(kernel, truth), mask) << "tilt " << tilt << " along " << turn;
      EXPECT_LE(off, 0.06) << "tilt " << tilt << " along " << turn;
    }
  }
}

TEST(AmbientOcclusion, LeavesAConvexBodyOpen) {
  for (const double value : openness(ball)) EXPECT_GE(value, 0.999);
}

}  // namespace
}  // namespace vestige
