// SPDX-License-Identifier: BSD-3-Clause
//
// Lengths, moments and runs of intervals, and of what has no data.
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "proxy/base/error.h"
#include "tests/adaptor/march/march_fixture.h"

namespace vestige {
namespace {

TEST_P(March, ShellsAroundACentreHaveTheirRunsAndLengths) {
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  const Scene scene = Scene::even({97, 97, 97}, box, [](glm::dvec3 p) { return glm::length(p); });
  const Camera camera = frameBox(box, {0, 1, 0}, {0, 0, 1}, 1.0);
  MarchRequest request = requestAll(box, 0.1, 0.9, 8, camera, {25, 25});
  const RayImage image = marchWhole(marcher, scene, request);
  const std::size_t pixels = image.size.pixels();
  const double centreDepth = glm::dot(-camera.position, camera.forward);
  for (std::size_t i = 0; i < pixels; ++i) {
    const glm::dvec3 foot =
        camera.unproject({double(i % 25) + 0.5, double(i / 25) + 0.5, centreDepth}, image.size);
    const double b = glm::length(foot);  // distance of the ray from the centre
    if (std::abs(foot.x) > 1.0 || std::abs(foot.z) > 1.0) continue;
    for (int c = 0; c < 8; ++c) {
      const double inner = 0.1 * (c + 1), outer = inner + 0.1;
      if (std::abs(b - inner) < 0.02 || std::abs(b - outer) < 0.02) continue;  // grazing
      const double half = outer > b ? std::sqrt(outer * outer - b * b) : 0.0;
      const double hole = inner > b ? std::sqrt(inner * inner - b * b) : 0.0;
      const std::size_t at = std::size_t(c) * pixels + i;
      EXPECT_EQ(image.runs[at], half == 0.0 ? 0.0f : hole > 0.0 ? 2.0f : 1.0f) << c << " " << b;
      EXPECT_NEAR(image.length[at], 2.0 * (half - hole), 8e-3);
      EXPECT_NEAR(image.moment[at], centreDepth * 2.0 * (half - hole), 8e-3 * centreDepth + 1e-3);
    }
  }
}

TEST_P(March, ThinIntervalsAreMeasuredInsideAStep) {
  // f = x along the ray: an interval a hundredth of a step wide has its exact length.
  const Scene scene = Scene::even({9, 9, 9}, kUnit, [](glm::dvec3 p) { return p.y; });
  MarchRequest request =
      requestAll(kUnit, 0.0, 1.0, 2, frameBox(kUnit, {0, 1, 0}, {0, 0, 1}, 1.0), {4, 4});
  request.partition = IntervalPartition::fromBounds({0.3, 0.301, 0.302, 0.9});
  request.isovalues = {0.25};
  const RayImage image = marchWhole(marcher, scene, request);
  const std::size_t pixel = 5, pixels = image.size.pixels();
  EXPECT_NEAR(image.length[0 * pixels + pixel], 0.001, 1e-6);
  EXPECT_NEAR(image.length[1 * pixels + pixel], 0.001, 1e-6);
  EXPECT_NEAR(image.length[2 * pixels + pixel], 0.598, 1e-5);
  EXPECT_NEAR(image.length[3 * pixels + pixel], 0.3, 1e-5) << "below";
  EXPECT_NEAR(image.length[4 * pixels + pixel], 0.1, 1e-5) << "above";
  EXPECT_EQ(image.first[pixel], 3);
  EXPECT_EQ(image.last[pixel], 4);
  EXPECT_NEAR(image.mip[pixel], 1.0, 1e-6);
}

TEST_P(March, NoDataIsTransparentAndHasItsOwnLength) {
  Scene scene = Scene::even({21, 21, 21}, kUnit, waves);
  const auto hole = [](double y) { return y > 0.324 && y < 0.626; };
  scene.field = [&](glm::dvec3 p) { return hole(p.y) ? kNaN : waves(p); };
  MarchRequest request =
      requestAll(kUnit, 0.2, 0.8, 6, frameBox(kUnit, {0, 1, 0}, {0, 0, 1}, 1.0), {8, 8});
  const RayImage image = marchWhole(marcher, scene, request);
  expectInvariants(image, request);
  const std::size_t noData = std::size_t(request.partition.noData());
  for (std::size_t i = 0; i < image.size.pixels(); ++i) {
    // Nodes 7..12 have no data, nor has what is nearer to them than to others.
    EXPECT_NEAR(image.length[noData * image.size.pixels() + i], 0.3, 1e-5);
    EXPECT_EQ(image.runs[noData * image.size.pixels() + i], 1.0f);
    EXPECT_EQ(image.attenuation[noData * image.size.pixels() + i], 0.0f);
    EXPECT_TRUE(std::isfinite(image.mip[i]));
    EXPECT_TRUE(std::isfinite(image.reference[i]));
  }
  // Elsewhere it is the field as if the hole were not there.
  scene.field = waves;
  const RayImage filled = marchWhole(marcher, scene, request);
  for (std::size_t i = 0; i < image.size.pixels(); ++i) {
    EXPECT_EQ(image.first[i], filled.first[i]);
    EXPECT_EQ(image.last[i], filled.last[i]);
  }

  scene.field = [](glm::dvec3) { return kNaN; };
  const RayImage nothing = marchWhole(marcher, scene, request);
  expectInvariants(nothing, request);
  EXPECT_EQ(nothing.first[9], noData);
  EXPECT_TRUE(std::isnan(nothing.mip[9]));
  EXPECT_EQ(nothing.transmittance[9], 1.0f);
  EXPECT_TRUE(std::isinf(nothing.depth[9]));
}

TEST_P(March, ScatteredNoDataKeepsTheBalance) {
  std::mt19937 random(3);
  std::vector<double> values(13 * 13 * 13);
  for (double& v : values) {
    v = std::uniform_real_distribution(0.0, 1.0)(random);
    if (v < 0.15) v = kNaN;
  }
  const Scene scene = Scene::even({13, 13, 13}, kUnit, [&](glm::dvec3 p) {
    const auto i = [](double x) { return std::size_t(std::lround(12.0 * x)); };
    return values[i(p.x) + 13 * (i(p.y) + 13 * i(p.z))];
  });
  for (const Camera& camera : {oblique(kUnit), perspective(kUnit)}) {
    MarchRequest request = requestAll(kUnit, 0.2, 0.9, 16, camera);
    request.stepLength = 0.04;
    const RayImage whole = marchWhole(marcher, scene, request);
    expectInvariants(whole, request);
    const RayImage parts =
        marchBlocks(marcher, scene, request, {{{0, 5, 12}, {0, 12}, {0, 4, 9, 12}}}, 3);
    EXPECT_LE(greatestDifference(whole.length, parts.length), 1e-5);
    EXPECT_LE(greatestDifference(whole.attenuation, parts.attenuation), 1e-5);
  }
}

TEST_P(March, ConstantFieldsAndValuesOnBoundsBelongToOneChannel) {
  for (double value : {0.0, 0.25, 1.0}) {
    const Scene scene = Scene::even({4, 4, 4}, kUnit, [=](glm::dvec3) { return value; });
    MarchRequest request = requestAll(kUnit, 0.0, 1.0, 4, oblique(kUnit));
    const RayImage image = marchWhole(marcher, scene, request);
    expectInvariants(image, request);
    const std::size_t channel = std::size_t(request.partition.channelOf(value));
    const std::size_t pixel = image.size.pixels() / 2 + 16;
    EXPECT_EQ(image.first[pixel], channel);
    EXPECT_EQ(image.last[pixel], channel);
    EXPECT_NEAR(image.length[channel * image.size.pixels() + pixel],
                chord(image, request.camera, pixel), 1e-5);
    EXPECT_NEAR(image.mip[pixel], value, 1e-6);
  }
}

}  // namespace
}  // namespace vestige
