// SPDX-License-Identifier: BSD-3-Clause
//
// Piecewise-analytic layers (method §2).
#include <algorithm>
#include <cmath>

#include "proxy/base/error.h"
#include "tests/adaptor/march/march_fixture.h"

namespace vestige {
namespace {

/// Layers composited front to back: light and transmittance of a pixel.
struct Composited {
  std::array<double, 3> light{};
  double transmittance = 1.0;

  Composited(const AnalyticLayerPlanes& planes, std::size_t pixel) {
    const std::size_t pixels = planes.state.size();
    for (std::size_t i = 0; i < std::size_t(planes.layers); ++i) {
      for (std::size_t c = 0; c < 3; ++c)
        light[c] += transmittance * double(planes.color[(3 * i + c) * pixels + pixel]);
      transmittance *= std::exp(-double(planes.tau[i * pixels + pixel]));
    }
  }
};

void expectPicture(const GatheredLayers& layers, double tolerance) {
  const auto& [planes, light, rays] = layers;
  const std::size_t pixels = rays.size.pixels();
  int seen = 0;
  for (std::size_t p = 0; p < pixels; ++p) {
    const Composited made(planes, p);
    seen += planes.state[p] != AnalyticLayerState::Empty;
    const double left = std::max(double(rays.transmittance[p]), kSaturatedTransmittance);
    EXPECT_NEAR(made.transmittance, left, tolerance + kEmptyOpacity) << p;
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(made.light[c], rays.reference[c * pixels + p], tolerance + kEmptyOpacity) << p;
      if (planes.state[p] != AnalyticLayerState::Empty) {
        EXPECT_NEAR(made.light[c], light[c * pixels + p], 1e-5) << p;
      }
    }
  }
  EXPECT_GT(seen, int(pixels) / 4);
}

TEST_P(March, LayersAddUpToTheReferencePicture) {
  const Scene scene = Scene::even({20, 17, 23}, kUnit, waves);
  for (const Camera& camera : {oblique(kUnit), perspective(kUnit)}) {
    for (const bool phong : {false, true}) {
      for (const int count : {1, 4, 8}) {
        MarchRequest request = requestAll(kUnit, 0.0, 1.0, 6, camera);
        request.phong = phong;
        expectPicture(marchLayers(marcher, scene, request, count, {}, scene.whole(), 0), 2e-5);
      }
    }
  }
}

TEST_P(March, LayersWithHolesAddUpToTheReferencePicture) {
  const Scene scene = Scene::even({20, 17, 23}, kUnit, [](glm::dvec3 p) {
    return std::sin(19.0 * p.x) + std::sin(17.0 * p.y) + std::sin(23.0 * p.z) > 0.4 ? kNaN
                                                                                    : waves(p);
  });
  for (const Camera& camera : {oblique(kUnit), perspective(kUnit)}) {
    MarchRequest request = requestAll(kUnit, 0.0, 1.0, 6, camera);
    request.phong = true;
    expectPicture(marchLayers(marcher, scene, request, 4, {}, scene.whole(), 0), 2e-5);
  }
}

TEST_P(March, LayersDoNotDependOnTheBlocks) {
  const Scene scene = Scene::even({20, 17, 23}, kUnit, waves);
  const Cuts cuts{std::vector<int>{0, 9, 19}, std::vector<int>{0, 5, 11, 16},
                  std::vector<int>{0, 14, 22}};
  for (const Camera& camera : {oblique(kUnit), perspective(kUnit)}) {
    for (const bool shadowed : {false, true}) {
      MarchRequest request = requestAll(kUnit, 0.0, 1.0, 6, camera);
      request.stepLength = 0.03;
      request.phong = true;
      const auto light = shadowed ? std::optional(glm::dvec3(1.0, 0.5, -2.0)) : std::nullopt;
      const AnalyticLayerPlanes whole =
          marchLayers(marcher, scene, request, 4, light, scene.whole(), 0).planes;
      const AnalyticLayerPlanes split =
          marchLayers(marcher, scene, request, 4, light, cuts, 2).planes;
      EXPECT_EQ(whole.state, split.state);
      EXPECT_LT(greatestDifference(whole.tau, split.tau), 2e-4);  // of up to 8
      EXPECT_LT(greatestDifference(whole.color, split.color), 3e-5);
      // Where there is next to no medium a little optical depth goes a long way.
      EXPECT_LT(greatestDifference(whole.boundary, split.boundary), 2e-3 * kUnit.diagonal());
    }
  }
}

TEST_P(March, BoundariesOfAUniformMediumStandWhereOpacityPassesEqualShares) {
  const Scene scene = Scene::even({5, 5, 5}, kUnit, [](glm::dvec3) { return 0.8; });
  MarchRequest request = requestAll(kUnit, 0.0, 1.0, 4, perspective(kUnit));
  request.stepLength = 0.05;
  const double extinction = request.base.extinction(0.8);
  const auto [planes, light, rays] = marchLayers(marcher, scene, request, 4, {}, scene.whole(), 0);
  const std::size_t pixels = rays.size.pixels();
  for (std::size_t p = 0; p < pixels; ++p) {
    const double length = chord(rays, request.camera, p), taken = -std::expm1(-extinction * length);
    if (length < 0.1) continue;
    EXPECT_EQ(planes.state[p], AnalyticLayerState::Whole);
    const double depthPerLength = (rays.exit[p] - rays.entry[p]) / length;
    double sum = 0.0;
    for (std::size_t i = 1; i < 4; ++i) {
      const double at = -std::log1p(-taken * double(i) / 4.0) / extinction;
      EXPECT_NEAR(planes.boundary[i * pixels + p], rays.entry[p] + at * depthPerLength, 1e-4);
    }
    for (std::size_t i = 0; i < 4; ++i) sum += planes.tau[i * pixels + p];
    EXPECT_NEAR(sum, extinction * length, 5e-5);
    // The outermost ones close in on what is there by a 256th of the opacity.
    EXPECT_NEAR(planes.boundary[p], rays.entry[p], 0.02 * depthPerLength * length);
    EXPECT_GE(planes.boundary[p], rays.entry[p]);
    EXPECT_NEAR(planes.boundary[4 * pixels + p], rays.exit[p], 0.02 * depthPerLength * length);
    EXPECT_LE(planes.boundary[4 * pixels + p], rays.exit[p]);
  }
}

TEST_P(March, EmptyAndSaturatedRaysSaySo) {
  // Opaque in one half, nothing in the other.
  const Scene scene =
      Scene::even({33, 9, 9}, kUnit, [](glm::dvec3 p) { return p.x < 0.5 ? 1.0 : 0.0; });
  MarchRequest request =
      requestAll(kUnit, 0.0, 1.0, 4, frameBox(kUnit, {0, 1, 0}, {0, 0, 1}, 1.0), {32, 32});
  request.base = TransferFunction({{0.0, 0.0}, {0.5, 0.0}, {1.0, 0.99}}, 0.01,
                                  Colormap::named("viridis"), 0.0, 1.0);
  const auto [planes, light, rays] = marchLayers(marcher, scene, request, 2, {}, scene.whole(), 0);
  const std::size_t pixels = rays.size.pixels(), row = 16 * 32;
  EXPECT_EQ(planes.state[row + 4], AnalyticLayerState::Saturated);
  EXPECT_EQ(planes.state[row + 28], AnalyticLayerState::Empty);
  for (std::size_t b = 0; b < 3; ++b) EXPECT_EQ(planes.boundary[b * pixels + row + 28], 0.0f);
  // What is stored ends where nothing is seen any more, long before the ray leaves the domain.
  EXPECT_LT(planes.boundary[2 * pixels + row + 4], rays.entry[row + 4] + 0.05);
  EXPECT_NEAR(Composited(planes, row + 4).transmittance, kSaturatedTransmittance, 1e-6);
}

TEST_P(March, ShadowsOfAUniformMediumAreExponential) {
  const Scene scene = Scene::even({5, 5, 5}, kUnit, [](glm::dvec3) { return 0.8; });
  MarchRequest request =
      requestAll(kUnit, 0.0, 1.0, 4, frameBox(kUnit, {0, 1, 0}, {0, 0, 1}, 1.0), {16, 16});
  request.stepLength = 0.02;
  const double extinction = request.base.extinction(0.8);
  // From above: a row of pixels is as deep in the medium as it is below the top.
  const auto [planes, light, rays] =
      marchLayers(marcher, scene, request, 1, glm::dvec3(0, 0, -1), scene.whole(), 0);
  const std::size_t pixels = rays.size.pixels();
  const glm::dvec3 color = request.base.color(0.8);
  for (int y = 3; y < 13; ++y) {
    const std::size_t p = std::size_t(y) * 16 + 8;
    const double height = request.camera.unproject({8.5, y + 0.5, 1.0}, request.size).z;
    const double lit =
        kShadowAmbient + (1.0 - kShadowAmbient) * std::exp(-extinction * (1.0 - height));
    const double opacity = 1.0 - double(rays.transmittance[p]);
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(planes.color[c * pixels + p], opacity * color[int(c)] * lit, 2e-3) << y;
  }
}

TEST_P(March, LayersOfOtherSizesAreRefused) {
  const Scene scene = Scene::even({4, 4, 4}, kUnit, waves);
  const MarchRequest request = requestAll(kUnit, 0.0, 1.0, 4, oblique(kUnit));
  marchWhole(marcher, scene, request);
  EXPECT_THROW(marcher.marchLayers(request, {}), Error);
}

}  // namespace
}  // namespace vestige
