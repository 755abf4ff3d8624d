// SPDX-License-Identifier: BSD-3-Clause
// Passing over bricks and tiles in which nothing happens changes nothing.
#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "tests/adaptor/march/march_scene.h"

namespace vestige {
namespace {

const Box kUnit{{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}};

/// Two balls and a sheet in a calm.
double objects(glm::dvec3 p) {
  const auto ball = [&](glm::dvec3 at, double radius) {
    return std::max(0.0, 1.0 - glm::length(p - at) / radius);
  };
  const double sheet = std::max(0.0, 1.0 - std::abs(p.z - 0.82) / 0.05);
  return ball({0.3, 0.4, 0.4}, 0.2) + ball({0.65, 0.7, 0.5}, 0.13) + 0.4 * sheet * p.x;
}

class EmptySpaceSkipping : public testing::TestWithParam<std::string> {
 protected:
  Marcher marcher{sharedDevice(GetParam())};

  void expectNoDifference(const Scene& scene, MarchRequest request) {
    request.skipEmptySpace = true;
    const RayImage with = marchWhole(marcher, scene, request);
    request.skipEmptySpace = false;
    const RayImage without = marchWhole(marcher, scene, request);
    EXPECT_EQ(with.entry, without.entry);
    EXPECT_EQ(with.exit, without.exit);
    EXPECT_EQ(with.first, without.first);
    EXPECT_EQ(with.last, without.last);
    EXPECT_EQ(with.runs, without.runs);
    EXPECT_LE(greatestDifference(with.length, without.length), 1e-6);
    EXPECT_LE(greatestDifference(with.moment, without.moment), 1e-6);
    EXPECT_LE(greatestDifference(with.attenuation, without.attenuation), 1e-6);
    EXPECT_LE(greatestDifference(with.transmittance, without.transmittance), 1e-6);
    EXPECT_LE(greatestDifference(with.depth, without.depth), 1e-6);
    EXPECT_LE(greatestDifference(with.normal, without.normal), 1e-4);
    EXPECT_LE(greatestDifference(with.reference, without.reference), 1e-6);
    EXPECT_LE(greatestDifference(with.mip, without.mip),
              1e-6 * (request.partition.high() - request.partition.low()));
  }

  static Camera camera(Projection projection, glm::dvec3 forward, ImageSize size) {
    return frameBox(kUnit, forward, {0.0, 0.0, 1.0}, size.aspect(), projection, 0.7);
  }
};

INSTANTIATE_TEST_SUITE_P(Backends, EmptySpaceSkipping, testing::Values("osmesa", "egl"),
                         [](const auto& backend) { return backend.param; });

TEST_P(EmptySpaceSkipping, FromEverySide) {
  const Scene scene = Scene::even({67, 61, 70}, kUnit, objects);
  const ImageSize size{90, 70};
  for (const auto projection :
       {Projection::Orthographic, Projection::Perspective, Projection::MultiPerspective}) {
    for (glm::dvec3 forward : {glm::dvec3(0, 1, 0), glm::dvec3(-1, 0, 0),
                               glm::dvec3(0.7, 0.8, -0.5), glm::dvec3(-0.3, -0.9, 0.4)}) {
      expectNoDifference(scene,
                         requestAll(kUnit, 0.0, 1.0, 12, camera(projection, forward, size), size));
    }
  }
}

TEST_P(EmptySpaceSkipping, LitReference) {
  const Scene scene = Scene::even({64, 64, 64}, kUnit, objects);
  const ImageSize size{64, 64};
  auto request = requestAll(kUnit, 0.0, 1.0, 12,
                            camera(Projection::Orthographic, {0.5, 1.0, -0.3}, size), size);
  request.phong = true;
  expectNoDifference(scene, request);
}

TEST_P(EmptySpaceSkipping, ACalmThatIsNotQuiteConstant) {
  const Scene scene = Scene::even({60, 60, 60}, kUnit, [](glm::dvec3 p) {
    return objects(p) + 0.01 * std::sin(5.0 * p.x) * std::cos(4.0 * p.y + p.z);
  });
  const ImageSize size{64, 64};
  expectNoDifference(scene,
                     requestAll(kUnit, -0.05, 1.0, 8,
                                camera(Projection::Orthographic, {0.2, 1.0, 0.1}, size), size));
}

TEST_P(EmptySpaceSkipping, NodesThatAreNotEven) {
  Scene scene = Scene::even({64, 60, 66}, kUnit, objects);
  for (double& x : scene.nodes[0]) x = x * x * (2.0 - x);
  for (double& z : scene.nodes[2]) z = 0.5 * (z + std::sqrt(z));
  const ImageSize size{64, 48};
  for (glm::dvec3 forward : {glm::dvec3(0, 0.2, -1), glm::dvec3(0.7, 0.8, -0.5)}) {
    expectNoDifference(scene, requestAll(kUnit, 0.0, 1.0, 8,
                                         camera(Projection::Orthographic, forward, size), size));
  }
}

TEST_P(EmptySpaceSkipping, RegionsWithoutData) {
  const auto holes = [](glm::dvec3 p) {
    if (p.x > 0.75 || glm::length(p - glm::dvec3(0.5, 0.2, 0.7)) < 0.1) {
      return std::numeric_limits<double>::quiet_NaN();
    }
    return objects(p);
  };
  const Scene scene = Scene::even({66, 66, 66}, kUnit, holes);
  const ImageSize size{64, 64};
  expectNoDifference(
      scene,
      requestAll(kUnit, 0.0, 1.0, 8, camera(Projection::Perspective, {0.6, 1.0, 0.3}, size), size));
}

TEST_P(EmptySpaceSkipping, EveryProxyAlone) {
  const Scene scene = Scene::even({64, 64, 64}, kUnit, objects);
  const ImageSize size{64, 64};
  for (int kind = 0; kind < 5; ++kind) {
    auto request = requestAll(kUnit, 0.0, 1.0, 8,
                              camera(Projection::Orthographic, {0.5, 1.0, -0.3}, size), size);
    request.attenuation = kind == 0;
    request.length = kind == 1;
    request.mip = kind == 2;
    request.reference = kind == 3;
    if (kind != 4) request.isovalues.clear();
    expectNoDifference(scene, request);
  }
}

TEST_P(EmptySpaceSkipping, BlocksThatAreAllBackground) {
  const Scene scene = Scene::even({65, 65, 65}, kUnit, objects);
  const ImageSize size{80, 60};
  auto request = requestAll(kUnit, 0.0, 1.0, 8,
                            camera(Projection::Orthographic, {0.5, 1.0, -0.3}, size), size);
  request.stepLength = 1.0 / 64.0;
  const RayImage whole = marchWhole(marcher, scene, request);
  const RayImage blocks =
      marchBlocks(marcher, scene, request, {{{0, 20, 64}, {0, 33, 64}, {0, 9, 40, 64}}}, 1);
  EXPECT_LE(greatestDifference(whole.length, blocks.length), 1e-5);
  EXPECT_LE(greatestDifference(whole.attenuation, blocks.attenuation), 1e-5);
  EXPECT_LE(greatestDifference(whole.reference, blocks.reference), 1e-5);
  EXPECT_LE(greatestDifference(whole.depth, blocks.depth), 1e-5);
  EXPECT_LE(greatestDifference(whole.mip, blocks.mip), 1e-5);
}

}  // namespace
}  // namespace vestige
