// SPDX-License-Identifier: BSD-3-Clause
//
// Samples without data: those beside them stay as they are at their own places (method §1).
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "proxy/format/layout/proxy_layout.h"
#include "tests/adaptor/march/march_fixture.h"

namespace vestige {
namespace {

constexpr int kNodes = 13;
constexpr double kSpacing = 1.0 / (kNodes - 1);

/// Values at the nodes of the unit cube; NaN = no data.
struct NodeValues {
  std::vector<double> values = std::vector<double>(kNodes * kNodes * kNodes);

  double& at(int x, int y, int z) { return values[std::size_t(x + kNodes * (y + kNodes * z))]; }
  Scene scene() const {
    return Scene::even({kNodes, kNodes, kNodes}, kUnit, [this](glm::dvec3 p) {
      const auto i = [](double x) { return std::size_t(std::lround(x / kSpacing)); };
      return values[i(p.x) + kNodes * (i(p.y) + kNodes * i(p.z))];
    });
  }
};

/// Half of all samples have none, at random.
NodeValues sieve() {
  NodeValues nodes;
  std::mt19937 random(11);
  for (double& v : nodes.values) {
    v = std::uniform_real_distribution(0.05, 0.95)(random);
    if (random() % 2 == 0) v = kNaN;
  }
  return nodes;
}

/// Land along a coast that falls off: the sea is the deeper the farther out, z = 1 at its surface.
NodeValues coast() {
  NodeValues nodes;
  for (int z = 0; z < kNodes; ++z)
    for (int y = 0; y < kNodes; ++y)
      for (int x = 0; x < kNodes; ++x) {
        const int depth = std::max(0, x - 2) + (y % 3 == 0 ? 1 : 0);
        nodes.at(x, y, z) = kNodes - 1 - z < depth ? 0.1 + 0.05 * z : kNaN;
      }
  return nodes;
}

/// A camera whose pixels stand on the nodes, and the node of a pixel at a depth.
struct OnNodes {
  Camera camera;
  ImageSize size{kNodes, kNodes};
  glm::dvec3 forward;

  explicit OnNodes(glm::dvec3 way) : forward(way) {
    camera = frameBox(kUnit, way, std::abs(way.z) > 0.5 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1),
                      1.0);
    camera.viewHeight = 1.0 + kSpacing;
  }
  double value(NodeValues& nodes, std::size_t pixel, int depth) const {
    const double x = double(pixel % kNodes) + 0.5, y = double(pixel / kNodes) + 0.5;
    const Ray ray = camera.rayThrough({x, y}, size);
    glm::ivec3 at;
    for (int a = 0; a < 3; ++a) at[a] = int(std::lround(ray.origin[a] / kSpacing));
    for (int a = 0; a < 3; ++a)
      if (forward[a] != 0.0) at[a] = forward[a] > 0.0 ? depth : kNodes - 1 - depth;
    return nodes.at(at.x, at.y, at.z);
  }
};

const std::vector<glm::dvec3> kWays{{0, 1, 0}, {0, 0, -1}, {-1, 0, 0}};

TEST_P(March, EverySampleWithDataIsHalfAStepOfItsRayToEachSide) {
  for (NodeValues nodes : {sieve(), coast()}) {
    const Scene scene = nodes.scene();
    for (const glm::dvec3& way : kWays) {
      const OnNodes view(way);
      const MarchRequest request = requestAll(kUnit, 0.0, 1.0, 8, view.camera, view.size);
      const RayImage image = marchWhole(marcher, scene, request);
      expectInvariants(image, request);
      const std::size_t noData = std::size_t(request.partition.noData());
      const std::size_t pixels = image.size.pixels();
      for (std::size_t p = 0; p < pixels; ++p) {
        double length = 0.0, greatest = kNaN;
        for (int i = 0; i < kNodes; ++i) {
          const double v = view.value(nodes, p, i);
          if (std::isnan(v)) continue;
          length += i == 0 || i == kNodes - 1 ? 0.5 * kSpacing : kSpacing;
          if (!(v <= greatest)) greatest = v;
        }
        ASSERT_NEAR(image.length[noData * pixels + p], 1.0 - length, 2e-5) << p;
        if (std::isnan(greatest)) {
          ASSERT_TRUE(std::isnan(image.mip[p])) << p;
        } else {
          ASSERT_NEAR(image.mip[p], greatest, 1e-5) << p;
        }
      }
    }
  }
}

TEST_P(March, ASlabAroundASampleHoldsItsValue) {
  for (NodeValues nodes : {sieve(), coast()}) {
    const Scene scene = nodes.scene();
    for (const glm::dvec3& way : kWays) {
      const OnNodes view(way);
      MarchRequest request = requestAll(kUnit, 0.0, 1.0, 8, view.camera, view.size);
      request.attenuation = request.mip = request.reference = false;
      request.isovalues.clear();
      const DepthRange range = depthRange(view.camera, kUnit);
      std::vector<double> depths{range.low};
      for (int i = 0; i + 1 < kNodes; ++i) depths.push_back(range.low + (i + 0.5) * kSpacing);
      depths.push_back(range.high);
      const auto slabs = marchSlabs(marcher, scene, request, depths, scene.whole(), 0);
      for (std::size_t p = 0; p < view.size.pixels(); ++p) {
        for (int i = 0; i < kNodes; ++i) {
          const SlabCell& cell = slabs[std::size_t(i)].cells[p];
          const double v = view.value(nodes, p, i);
          const double thick = i == 0 || i == kNodes - 1 ? 0.5 * kSpacing : kSpacing;
          ASSERT_NEAR(cell.noData, std::isnan(v) ? thick : 0.0, 2e-6) << p << ' ' << i;
          if (std::isnan(v)) continue;
          // Its own interval is among those of its slab.
          const int rank = request.partition.rankOf(request.partition.channelOf(v));
          ASSERT_LE(cell.lowest, rank);
          ASSERT_GE(cell.highest, rank);
        }
      }
    }
  }
}

TEST_P(March, GapsDoNotDependOnTheBlocks) {
  NodeValues nodes = coast();
  const Scene scene = nodes.scene();
  for (const Camera& camera : {oblique(kUnit), perspective(kUnit)}) {
    MarchRequest request = requestAll(kUnit, 0.0, 1.0, 8, camera);
    request.stepLength = 0.04;
    request.phong = true;
    const RayImage whole = marchWhole(marcher, scene, request);
    const RayImage parts =
        marchBlocks(marcher, scene, request, {{{0, 5, 12}, {0, 12}, {0, 4, 9, 12}}}, 3);
    EXPECT_LE(greatestDifference(whole.length, parts.length), 1e-5);
    EXPECT_LE(greatestDifference(whole.reference, parts.reference), 1e-4);
  }
}

}  // namespace
}  // namespace vestige
