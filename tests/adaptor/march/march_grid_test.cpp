// SPDX-License-Identifier: BSD-3-Clause
//
// Grids and cameras: where samples stand, where rays run, what surfaces they meet.
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "proxy/base/error.h"
#include "tests/adaptor/march/march_fixture.h"

namespace vestige {
namespace {

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
  Marcher empty = make();
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

TEST_P(March, StretchedNodesDoNotTurnNormals) {
  // A slanted plane on nodes whose gaps grow: the normal is the plane's, to the border.
  const glm::dvec3 slope{0.6, 0.64, 0.48};
  Scene scene = Scene::even({4, 4, 4}, kUnit, [&](glm::dvec3 p) { return glm::dot(slope, p); });
  for (std::size_t axis = 0; axis < 3; ++axis) {
    scene.nodes[axis] = {0.0};
    for (double width = 0.01 * double(axis + 1); scene.nodes[axis].back() < 1.0; width *= 1.6) {
      scene.nodes[axis].push_back(std::min(1.0, scene.nodes[axis].back() + width));
    }
  }
  MarchRequest request = requestAll(kUnit, 0.0, 1.8, 4, oblique(kUnit));
  request.stepLength = 0.02;
  request.isovalues = {0.9};
  const RayImage image = marchWhole(marcher, scene, request);
  const glm::dvec3 normal =
      -glm::normalize(glm::dmat3(request.camera.eyeFromWorld()) * slope);  // to the viewer: z > 0
  const std::size_t pixels = image.size.pixels();
  int hits = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    if (std::isinf(image.depth[i])) continue;
    ++hits;
    for (std::size_t c = 0; c < 3; ++c) {
      ASSERT_NEAR(image.normal[c * pixels + i], std::copysign(1.0, normal.z) * normal[int(c)],
                  1e-4);
    }
  }
  EXPECT_GT(hits, 100);
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

TEST_P(March, DistortedRaysEndAtThePoleLine) {
  const Scene scene = Scene::even({5, 5, 5}, kUnit, [](glm::dvec3) { return 0.5; });
  for (const double convergence : {0.4, 1.0, 3.0}) {
    const Camera camera =
        frameBoxDistorted(kUnit, {0.2, 1.0, -0.1}, {0, 0, 1}, 4.0 / 3.0, convergence);
    const MarchRequest request = requestAll(kUnit, 0.0, 1.0, 1, camera);
    const RayImage image = marchWhole(marcher, scene, request);
    int ended = 0;
    for (int y = 0; y < 24; ++y) {
      for (int x = 0; x < 32; ++x) {
        const Ray ray = camera.rayThrough({x + 0.5, y + 0.5}, request.size);
        const double end = ray.lastDepth / ray.depthPerLength;
        double from = 0.0, to = end;
        for (int axis = 0; axis < 3; ++axis) {
          const double a = (kUnit.low[axis] - ray.origin[axis]) / ray.direction[axis];
          const double b = (kUnit.high[axis] - ray.origin[axis]) / ray.direction[axis];
          from = std::max(from, std::min(a, b));
          to = std::min(to, std::max(a, b));
        }
        ended += from < to && to == end;
        EXPECT_NEAR(image.length[std::size_t(y * 32 + x)], std::max(0.0, to - from), 1e-5);
      }
    }
    EXPECT_GT(ended, 50);
  }
}

TEST_P(March, LayersAndSlabsOfADistortedCameraAreRefused) {
  const Scene scene = Scene::even({5, 5, 5}, kUnit, waves);
  const MarchRequest request =
      requestAll(kUnit, 0.0, 1.0, 4, frameBoxDistorted(kUnit, {0, 1, 0}, {0, 0, 1}, 1.0), {8, 8});
  const RayImage rays = marchWhole(marcher, scene, request);
  EXPECT_THROW(marcher.marchLayers(request, LayerGatherer(2, rays.transmittance).request(nullptr)),
               Error);
  EXPECT_THROW(marcher.marchSlabs(request, std::vector<double>{0.0, 1.0}, [](int, SlabRays) {}),
               Error);
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

TEST_P(March, SpheresHaveTheirDepthAndNormal) {
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  const Scene scene = Scene::even({65, 65, 65}, box, [](glm::dvec3 p) { return glm::dot(p, p); });
  for (const Camera& camera : {oblique(box, {40, 40}), perspective(box, {40, 40}),
                               frameBoxDistorted(box, {0.8, 1.0, -0.6}, {0, 0, 1}, 1.0)}) {
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
        if (std::abs(rest) < 0.02) continue;                          // grazing
        if (b * ray.depthPerLength > ray.lastDepth - 0.05) continue;  // around its end
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

}  // namespace
}  // namespace vestige
