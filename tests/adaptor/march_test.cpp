// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "proxy/error.h"
#include "tests/adaptor/march_scene.h"

namespace vestige {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
const Box kUnit{{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}};

double waves(glm::dvec3 p) {
  return 0.5 + 0.25 * std::sin(9.0 * p.x + 2.0 * p.y) * std::cos(7.0 * p.z - 3.0 * p.y) +
         0.2 * std::sin(11.0 * p.y + p.x);
}

Camera oblique(const Box& box, ImageSize size = {32, 24}) {
  return frameBox(box, {0.8, 1.0, -0.6}, {0.0, 0.0, 1.0}, size.aspect());
}

Camera perspective(const Box& box, ImageSize size = {32, 24}) {
  return frameBox(box, {-0.5, 1.0, 0.4}, {0.0, 0.0, 1.0}, size.aspect(), Projection::Perspective,
                  0.7);
}

/// World length of the ray of a pixel between two planar depths.
double chord(const RayImage& image, const Camera& camera, std::size_t pixel) {
  if (image.entry[pixel] > image.exit[pixel]) return 0.0;
  const glm::dvec2 at{double(pixel % std::size_t(image.size.width)) + 0.5,
                      double(pixel / std::size_t(image.size.width)) + 0.5};
  return (double(image.exit[pixel]) - double(image.entry[pixel])) /
         camera.rayThrough(at, image.size).depthPerLength;
}

double sumOfChannels(const std::vector<float>& planes, const RayImage& image, std::size_t pixel) {
  double sum = 0.0;
  for (int c = 0; c < image.channels; ++c) sum += planes[c * image.size.pixels() + pixel];
  return sum;
}

void expectInvariants(const RayImage& image, const MarchRequest& request) {
  std::size_t hits = 0;
  for (std::size_t i = 0; i < image.size.pixels(); ++i) {
    const double whole = sumOfChannels(image.attenuation, image, i) + image.transmittance[i];
    ASSERT_NEAR(whole, 1.0, 1e-5) << "pixel " << i;
    const double length = chord(image, request.camera, i);
    ASSERT_NEAR(sumOfChannels(image.length, image, i), length, 1e-5 * request.domain.diagonal());
    hits += image.entry[i] < image.exit[i];
    for (int c = 0; c < image.channels; ++c) {
      const std::size_t at = c * image.size.pixels() + i;
      ASSERT_GE(image.attenuation[at], -1e-6f);
      ASSERT_GE(image.length[at], 0.0f);
      ASSERT_EQ(image.runs[at] == 0.0f, image.length[at] == 0.0f);
      if (image.length[at] < 1e-4f * request.domain.diagonal()) continue;
      const double mean = double(image.moment[at]) / image.length[at];
      ASSERT_GE(mean, image.entry[i] - 1e-4 * request.domain.diagonal());
      ASSERT_LE(mean, image.exit[i] + 1e-4 * request.domain.diagonal());
    }
  }
  EXPECT_GT(hits, image.size.pixels() / 8);
}

void expectSame(const RayImage& a, const RayImage& b, double tolerance) {
  EXPECT_LE(greatestDifference(a.entry, b.entry), tolerance) << "entry";
  EXPECT_LE(greatestDifference(a.exit, b.exit), tolerance) << "exit";
  EXPECT_LE(greatestDifference(a.attenuation, b.attenuation), tolerance) << "attenuation";
  EXPECT_LE(greatestDifference(a.transmittance, b.transmittance), tolerance) << "transmittance";
  EXPECT_LE(greatestDifference(a.length, b.length), tolerance) << "length";
  EXPECT_LE(greatestDifference(a.moment, b.moment), 4.0 * tolerance) << "moment";
  EXPECT_LE(greatestDifference(a.depth, b.depth), 10.0 * tolerance) << "depth";
  EXPECT_LE(greatestDifference(a.normal, b.normal), 1e3 * tolerance) << "normal";
  EXPECT_LE(greatestDifference(a.mip, b.mip), tolerance) << "mip";
  EXPECT_LE(greatestDifference(a.reference, b.reference), tolerance) << "reference";
}

class March : public testing::TestWithParam<std::string> {
 protected:
  Marcher marcher{sharedDevice(GetParam())};
};

INSTANTIATE_TEST_SUITE_P(Backends, March, testing::Values("osmesa", "egl"),
                         [](const auto& backend) { return backend.param; });

TEST_P(March, ConservesLengthAndLight) {
  const Scene scene = Scene::even({20, 17, 23}, {{-1, 2, 3}, {1, 3, 5}},
                                  [](glm::dvec3 p) { return waves(0.5 * p); });
  const Box box = scene.box();
  for (const Camera& camera :
       {oblique(box), perspective(box), frameBox(box, {0, 1, 0}, {0, 0, 1}, 32.0 / 24.0)}) {
    MarchRequest request = requestAll(box, 0.2, 0.7, 9, camera);
    expectInvariants(marchWhole(marcher, scene, request), request);
    request.stepLength = 0.031;
    expectInvariants(marchWhole(marcher, scene, request), request);
  }
}

TEST_P(March, UniformMediumAttenuatesExponentially) {
  const Scene scene = Scene::even({5, 5, 5}, kUnit, [](glm::dvec3) { return 0.8; });
  MarchRequest request = requestAll(kUnit, 0.0, 1.0, 4, perspective(kUnit));
  const double extinction = request.base.extinction(0.8);
  ASSERT_GT(extinction, 0.1);
  const RayImage image = marchWhole(marcher, scene, request);
  for (std::size_t i = 0; i < image.size.pixels(); ++i) {
    const double length = chord(image, request.camera, i);
    EXPECT_NEAR(image.transmittance[i], std::exp(-extinction * length), 1e-5);
    EXPECT_NEAR(image.attenuation[3 * image.size.pixels() + i],
                1.0 - std::exp(-extinction * length), 1e-5);
    EXPECT_EQ(image.runs[3 * image.size.pixels() + i], length > 0.0 ? 1.0f : 0.0f);
    EXPECT_EQ(image.first[i], length > 0.0 ? 3 : 255);
    for (int c = 0; c < 3; ++c) {
      const glm::dvec3 color = request.base.color(0.8);
      EXPECT_NEAR(image.reference[c * image.size.pixels() + i],
                  color[c] * (1.0 - std::exp(-extinction * length)), 1e-4);
    }
  }
}

TEST_P(March, SplittingTheDomainIntoBlocksChangesNothing) {
  const Scene scene = Scene::even({25, 22, 19}, kUnit, waves);
  std::mt19937 random(7);
  for (int trial = 0; trial < 6; ++trial) {
    const Camera camera = trial % 2 ? perspective(kUnit) : oblique(kUnit);
    MarchRequest request = requestAll(kUnit, 0.15, 0.8, 11, camera);
    request.stepLength = 1.0 / 30.0;
    std::array<std::vector<int>, 3> cuts;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int last = int(scene.nodes[axis].size()) - 1;
      cuts[axis] = {0, last};
      if ((trial + 1) >> axis & 1) {
        cuts[axis].insert(cuts[axis].begin() + 1,
                          std::uniform_int_distribution(1, last - 1)(random));
      }
    }
    const RayImage whole = marchWhole(marcher, scene, request);
    const RayImage parts = marchBlocks(marcher, scene, request, cuts, 3);
    SCOPED_TRACE("trial " + std::to_string(trial));
    expectSame(whole, parts, 1e-5);
    EXPECT_EQ(greatestDifference(whole.runs, parts.runs), 0.0);
    EXPECT_EQ(whole.first, parts.first);
    EXPECT_EQ(whole.last, parts.last);
  }
}

TEST_P(March, TurningCameraAndVolumeTogetherChangesNothing) {
  const Scene scene = Scene::even({14, 17, 21}, {{0, 0, 0}, {0.8, 1, 1.3}}, waves);
  // A quarter turn about z: (x, y, z) -> (-y, x, z).
  Scene turned = scene;
  turned.field = [](glm::dvec3 p) { return waves({p.y, -p.x, p.z}); };
  turned.nodes[1] = scene.nodes[0];
  turned.nodes[0].clear();
  for (auto y = scene.nodes[1].rbegin(); y != scene.nodes[1].rend(); ++y) {
    turned.nodes[0].push_back(-*y);
  }
  const auto turn = [](glm::dvec3 v) { return glm::dvec3(-v.y, v.x, v.z); };
  for (Camera camera : {oblique(scene.box()), perspective(scene.box())}) {
    MarchRequest request = requestAll(scene.box(), 0.15, 0.8, 8, camera);
    request.phong = true;
    const RayImage before = marchWhole(marcher, scene, request);
    request.camera.position = turn(camera.position);
    request.camera.forward = turn(camera.forward);
    request.camera.up = turn(camera.up);
    request.domain = turned.box();
    expectSame(before, marchWhole(marcher, turned, request), 1e-5);
  }
}

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

TEST_P(March, AttenuationIsTheIntegralUnderTheBaseFunction) {
  // f = y along the ray; a_k from the extinction integrated finely in double.
  const Scene scene = Scene::even({4, 12, 4}, kUnit, [](glm::dvec3 p) { return p.y; });
  MarchRequest request =
      requestAll(kUnit, 0.0, 1.0, 5, frameBox(kUnit, {0, 1, 0}, {0, 0, 1}, 1.0), {4, 4});
  const RayImage image = marchWhole(marcher, scene, request);
  std::vector<double> expected(5);
  glm::dvec3 light{0.0};
  double depth = 0.0;
  constexpr int kSteps = 200000;
  for (int i = 0; i < kSteps; ++i) {
    const double f = (i + 0.5) / kSteps;
    const double next = depth + request.base.extinction(f) / kSteps;
    expected[std::size_t(request.partition.channelOf(f))] += std::exp(-depth) - std::exp(-next);
    light += request.base.color(f) * (std::exp(-depth) - std::exp(-next));
    depth = next;
  }
  const std::size_t pixel = 5, pixels = image.size.pixels();
  for (std::size_t c = 0; c < 5; ++c) {
    EXPECT_NEAR(image.attenuation[c * pixels + pixel], expected[c], 2e-5) << c;
  }
  EXPECT_NEAR(image.transmittance[pixel], std::exp(-depth), 2e-5);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(image.reference[c * pixels + pixel], light[int(c)], 1.0 / 255.0);
  }
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
    // Nodes 7..12 have no data, nor do the cells beside them; samples fall on nodes here, and one
    // on node 6 or 13 may or may not look at node 7 or 12.
    EXPECT_NEAR(image.length[noData * image.size.pixels() + i], 0.4, 0.0501);
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

TEST_P(March, OneNodeThickMeansConstantAlongThatAxis) {
  Scene scene = Scene::even({16, 1, 16}, kUnit, [](glm::dvec3 p) { return p.x; });
  MarchRequest request = requestAll(kUnit, 0.0, 1.0, 4, oblique(kUnit));
  request.stepLength = 0.05;
  const RayImage thin = marchWhole(marcher, scene, request);
  expectInvariants(thin, request);
  const Scene thick = Scene::even({16, 9, 16}, kUnit, scene.field);
  expectSame(thin, marchWhole(marcher, thick, request), 1e-5);
}

TEST_P(March, EmptyBlocksMissEveryRay) {
  Marcher empty(sharedDevice(GetParam()));
  empty.upload(BlockGrid{}, [](int, int, float*) { FAIL() << "nothing to fill"; });
  const MarchRequest request = requestAll(kUnit, 0.0, 1.0, 4, oblique(kUnit));
  RayImage nothing = empty.march(request);
  for (std::size_t i = 0; i < nothing.size.pixels(); ++i) {
    EXPECT_GT(nothing.entry[i], nothing.exit[i]);
    EXPECT_EQ(nothing.first[i], 255);
  }
  // The neutral element of compositing.
  const Scene scene = Scene::even({8, 8, 8}, kUnit, waves);
  const RayImage image = marchWhole(marcher, scene, request);
  compositeUnder(nothing, image);
  expectSame(nothing, image, 0.0);
  RayImage other = image;
  compositeUnder(other, empty.march(request));
  expectSame(other, image, 0.0);
}

TEST_P(March, UnevenAxesWithEvenNodesAreEvenAxes) {
  const Scene scene = Scene::even({18, 15, 21}, kUnit, waves);
  Scene uneven = scene;
  // Just beyond what passes for even, on one axis at a time.
  for (std::size_t axis = 0; axis < 3; ++axis) uneven.nodes[axis][1] += 3e-6 / 20.0;
  MarchRequest request = requestAll(kUnit, 0.15, 0.8, 8, oblique(kUnit));
  request.stepLength = 0.04;
  expectSame(marchWhole(marcher, scene, request), marchWhole(marcher, uneven, request), 2e-5);
}

TEST_P(March, StretchedNodesAreWhereTheyAre) {
  // f = y on nodes that stretch a thousandfold: trilinear is exact, whatever the nodes.
  Scene scene = Scene::even({4, 4, 4}, kUnit, [](glm::dvec3 p) { return p.y; });
  scene.nodes[1] = {0.0};
  for (double width = 1e-4; scene.nodes[1].back() < 1.0; width *= 1.3) {
    scene.nodes[1].push_back(std::min(1.0, scene.nodes[1].back() + width));
  }
  MarchRequest request =
      requestAll(kUnit, 0.0, 1.0, 10, frameBox(kUnit, {0, 1, 0}, {0, 0, 1}, 1.0), {6, 6});
  request.stepLength = 0.013;
  request.isovalues = {0.337};
  const RayImage image = marchWhole(marcher, scene, request);
  const std::size_t pixels = image.size.pixels();
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t c = 0; c < 10; ++c) {
      EXPECT_NEAR(image.length[c * pixels + i], 0.1, 1e-5) << c;
    }
    EXPECT_NEAR(image.depth[i] - image.entry[i], 0.337, 1e-5);
    EXPECT_NEAR(image.normal[2 * pixels + i], 1.0, 1e-5);
  }
  expectInvariants(image, request);
  request.camera = oblique(kUnit);
  request.size = {32, 24};
  const RayImage slanted = marchWhole(marcher, scene, request);
  expectInvariants(slanted, request);
}

TEST_P(March, ScaleAndPlaceOfTheDomainDoNotMatter) {
  const Scene scene = Scene::even({17, 17, 17}, kUnit, waves);
  const MarchRequest request = requestAll(kUnit, 0.15, 0.8, 8, oblique(kUnit));
  const RayImage unit = marchWhole(marcher, scene, request);
  const auto place = [&](double size, double offset, double low, double range) {
    const Box box{glm::dvec3(offset), glm::dvec3(offset + size)};
    const Scene moved = Scene::even(
        {17, 17, 17}, box, [=](glm::dvec3 p) { return low + range * waves((p - offset) / size); });
    MarchRequest there = requestAll(box, low + 0.15 * range, low + 0.8 * range, 8, oblique(box));
    const RayImage image = marchWhole(marcher, moved, there);
    SCOPED_TRACE("size " + std::to_string(size) + " at " + std::to_string(offset));
    EXPECT_LE(greatestDifference(image.attenuation, unit.attenuation), 2e-5);
    EXPECT_LE(greatestDifference(image.reference, unit.reference), 2e-4);
    std::vector<float> lengths = image.length;
    for (float& l : lengths) l = float(l / size);
    EXPECT_LE(greatestDifference(lengths, unit.length), 2e-5);
    EXPECT_LE(greatestDifference(image.runs, unit.runs), 0.0);
    EXPECT_LE(greatestDifference(image.normal, unit.normal), 5e-3);
  };
  place(1e-3, 0.0, 0.0, 1.0);
  place(1e-3, 1.0, 0.0, 1.0);
  place(1e6, 0.0, 0.0, 1.0);
  place(1.0, 1e6, 0.0, 1.0);
  place(1.0, 0.0, 101325.0, 0.01);
}

TEST_P(March, PerspectiveRaysHaveTheirChord) {
  const Scene scene = Scene::even({5, 5, 5}, kUnit, [](glm::dvec3) { return 0.5; });
  const MarchRequest request = requestAll(kUnit, 0.0, 1.0, 1, perspective(kUnit));
  const RayImage image = marchWhole(marcher, scene, request);
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 32; ++x) {
      const Ray ray = request.camera.rayThrough({x + 0.5, y + 0.5}, request.size);
      double from = 0.0, to = 1e300;
      for (int axis = 0; axis < 3; ++axis) {
        const double a = (kUnit.low[axis] - ray.origin[axis]) / ray.direction[axis];
        const double b = (kUnit.high[axis] - ray.origin[axis]) / ray.direction[axis];
        from = std::max(from, std::min(a, b));
        to = std::min(to, std::max(a, b));
      }
      const double length = std::max(0.0, to - from);
      EXPECT_NEAR(image.length[std::size_t(y * 32 + x)], length, 1e-5);
    }
  }
}

TEST_P(March, RaysStartAtTheCamera) {
  const Scene scene = Scene::even({5, 5, 5}, kUnit, [](glm::dvec3) { return 0.5; });
  Camera inside = frameBox(kUnit, {0, 1, 0}, {0, 0, 1}, 1.0);
  inside.position = {0.5, 0.25, 0.5};
  MarchRequest request = requestAll(kUnit, 0.0, 1.0, 1, inside, {5, 5});
  EXPECT_NEAR(marchWhole(marcher, scene, request).length[12], 0.75, 1e-5);
  request.camera.position.y = 2.0;
  EXPECT_EQ(marchWhole(marcher, scene, request).length[12], 0.0f);
}

TEST_P(March, OnlyWhatIsAskedForIsMade) {
  const Scene scene = Scene::even({12, 12, 12}, kUnit, waves);
  MarchRequest all = requestAll(kUnit, 0.15, 0.8, 8, oblique(kUnit));
  const RayImage full = marchWhole(marcher, scene, all);
  for (int only = 0; only < 5; ++only) {
    MarchRequest request = all;
    request.attenuation = only == 0;
    request.length = only == 1;
    request.mip = only == 2;
    request.reference = only == 3;
    if (only != 4) request.isovalues.clear();
    const RayImage image = marchWhole(marcher, scene, request);
    EXPECT_EQ(image.attenuation.empty(), only != 0);
    EXPECT_EQ(image.length.empty(), only != 1);
    EXPECT_EQ(image.mip.empty(), only != 2);
    EXPECT_EQ(image.reference.empty(), only != 3);
    EXPECT_EQ(image.depth.empty(), only != 4);
    const auto expectAsBefore = [](const std::vector<float>& planes,
                                   const std::vector<float>& before) {
      if (planes.empty()) return;
      EXPECT_LE(greatestDifference(planes, before), 1e-6);
    };
    expectAsBefore(image.attenuation, full.attenuation);
    expectAsBefore(image.moment, full.moment);
    expectAsBefore(image.mip, full.mip);
    expectAsBefore(image.reference, full.reference);
    expectAsBefore(image.depth, full.depth);
  }
}

TEST_P(March, LargePicturesComeInBandsWithoutSeams) {
  const Scene scene = Scene::even({9, 9, 9}, kUnit, waves);
  const MarchRequest request = requestAll(kUnit, 0.15, 0.8, 16, oblique(kUnit), {300, 203});
  const RayImage image = marchWhole(marcher, scene, request);
  expectInvariants(image, request);
}

TEST_P(March, SpheresHaveTheirDepthAndNormal) {
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  const Scene scene = Scene::even({65, 65, 65}, box, [](glm::dvec3 p) { return glm::dot(p, p); });
  for (const Camera& camera : {oblique(box, {40, 40}), perspective(box, {40, 40})}) {
    MarchRequest request = requestAll(box, 0.0, 1.0, 4, camera, {40, 40});
    request.isovalues = {0.36, 0.64};
    const RayImage image = marchWhole(marcher, scene, request);
    const std::size_t pixels = image.size.pixels();
    int hits = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      const glm::dvec2 at{double(i % 40) + 0.5, double(i / 40) + 0.5};
      const Ray ray = camera.rayThrough(at, image.size);
      for (std::size_t layer = 0; layer < 2; ++layer) {
        const double radius = layer ? 0.8 : 0.6;
        const double b = -glm::dot(ray.origin, ray.direction);
        const double rest = b * b - glm::dot(ray.origin, ray.origin) + radius * radius;
        if (std::abs(rest) < 0.02) continue;  // grazing
        const float depth = image.depth[layer * pixels + i];
        if (rest < 0.0) {
          EXPECT_TRUE(std::isinf(depth));
          continue;
        }
        ++hits;
        const double s = b - std::sqrt(rest);
        EXPECT_NEAR(depth, s * ray.depthPerLength, 4e-3);
        const glm::dvec3 normal = glm::normalize(ray.origin + s * ray.direction);
        const glm::dvec3 eye = glm::dmat3(camera.eyeFromWorld()) * normal;
        for (int c = 0; c < 3; ++c) {
          EXPECT_NEAR(image.normal[(3 * layer + std::size_t(c)) * pixels + i], eye[c], 2e-2);
        }
      }
    }
    EXPECT_GT(hits, 200);
  }
}

TEST_P(March, RefusesWhatMakesNoSense) {
  const auto codeOf = [&](const MarchRequest& request) {
    try {
      marcher.march(request);
    } catch (const Error& e) {
      return e.code();
    }
    ADD_FAILURE() << "nothing was thrown";
    return ErrorCode::Internal;
  };
  const Scene scene = Scene::even({5, 5, 5}, kUnit, waves);
  const MarchRequest good = requestAll(kUnit, 0.0, 1.0, 4, oblique(kUnit));
  marchWhole(marcher, scene, good);
  MarchRequest bad = good;
  bad.stepLength = -1.0;
  EXPECT_EQ(codeOf(bad), ErrorCode::InvalidArgument);
  bad.stepLength = 1e-9;
  EXPECT_EQ(codeOf(bad), ErrorCode::InvalidArgument);
  bad = good;
  bad.isovalues = {kNaN};
  EXPECT_EQ(codeOf(bad), ErrorCode::InvalidArgument);
  bad = good;
  bad.size = {0, 5};
  EXPECT_EQ(codeOf(bad), ErrorCode::InvalidArgument);
  bad = good;
  bad.camera.viewHeight = 0.0;
  EXPECT_EQ(codeOf(bad), ErrorCode::InvalidArgument);

  BlockGrid huge;
  for (int i = 0; i < 70000; ++i) huge.nodes[0].push_back(i);
  huge.nodes[1] = huge.nodes[2] = {0.0};
  try {
    marcher.upload(huge, [](int, int, float*) { FAIL() << "must not be filled"; });
    ADD_FAILURE() << "nothing was thrown";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::Gl);
    EXPECT_NE(std::string(e.what()).find("70000"), std::string::npos) << e.what();
  }
  // And it goes on after all that.
  EXPECT_FALSE(marchWhole(marcher, scene, good).entry.empty());
}

TEST_P(March, ExceptionsOfTheFillPassThrough) {
  BlockGrid grid;
  grid.nodes = {{{0.0, 1.0}, {0.0, 1.0}, {0.0, 1.0}}};
  grid.owned = kUnit;
  EXPECT_THROW(marcher.upload(grid, [](int, int, float*) { throw std::out_of_range("eight"); }),
               std::out_of_range);
}

TEST(MarchBackends, Agree) {
  Marcher osmesa(sharedDevice("osmesa")), egl(sharedDevice("egl"));
  const Scene scene = Scene::even({24, 24, 24}, kUnit, waves);
  MarchRequest request = requestAll(kUnit, 0.15, 0.8, 16, perspective(kUnit));
  request.phong = true;
  expectSame(marchWhole(osmesa, scene, request), marchWhole(egl, scene, request), 1e-6);
}

}  // namespace
}  // namespace vestige
