// SPDX-License-Identifier: BSD-3-Clause
//
// What does not change: sums, and pictures under splits, turns and moves.
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "proxy/base/error.h"
#include "tests/adaptor/march/march_fixture.h"

namespace vestige {
namespace {

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
