// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/camera/view_set.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "proxy/base/error.h"

namespace vestige {
namespace {

const Box kBox{{-1, -2, -3}, {2, 2, 2}};

void expectDirections(const std::string& name, glm::dvec3 forward, glm::dvec3 up) {
  const std::vector<View> views = viewSet(name, kBox, 1.5);
  ASSERT_EQ(views.size(), 1u);
  EXPECT_EQ(views[0].name, name);
  EXPECT_NEAR(glm::length(views[0].camera.forward - forward), 0.0, 1e-14) << name;
  EXPECT_NEAR(glm::length(views[0].camera.up - up), 0.0, 1e-14) << name;
}

TEST(ViewSet, HasTheSixAxisViews) {
  expectDirections("front", {0, 1, 0}, {0, 0, 1});
  expectDirections("back", {0, -1, 0}, {0, 0, 1});
  expectDirections("left", {1, 0, 0}, {0, 0, 1});
  expectDirections("right", {-1, 0, 0}, {0, 0, 1});
  expectDirections("top", {0, 0, -1}, {0, 1, 0});
  expectDirections("bottom", {0, 0, 1}, {0, 1, 0});
  EXPECT_EQ(viewSet("axes", kBox, 1.0).size(), 6u);
  EXPECT_EQ(viewSet("front", kBox, 1.0)[0].camera.position.y < kBox.low.y, true);
}

TEST(ViewSet, SpreadsSphereViewsEvenlyWithNamesOfTheirOwn) {
  for (const int n : {1, 2, 7, 64}) {
    const std::vector<View> views = viewSet("sphere:" + std::to_string(n), kBox, 1.0);
    ASSERT_EQ(int(views.size()), n);
    std::set<std::string> names;
    glm::dvec3 sum(0.0);
    double closest = -1.0;
    for (const View& a : views) {
      names.insert(a.name);
      sum += a.camera.forward;
      for (const View& b : views)
        if (&a != &b) closest = std::max(closest, glm::dot(a.camera.forward, b.camera.forward));
    }
    EXPECT_EQ(int(names.size()), n);
    EXPECT_EQ(views[0].name, "sphere000");
    if (n == 64) {
      EXPECT_LT(glm::length(sum) / n, 0.02);
      EXPECT_LT(closest, 0.95);  // 18 degrees apart; 64 caps of equal area have radius 14
    }
  }
}

TEST(ViewSet, OrbitsTheFrontViewByDegrees) {
  const View view = viewSet("orbit:90,0", kBox, 1.0)[0];
  EXPECT_EQ(view.name, "orbit_90_0");
  EXPECT_NEAR(glm::length(view.camera.forward - glm::dvec3(-1, 0, 0)), 0.0, 1e-14);
  EXPECT_EQ(viewSet("orbit: -22.5, +10", kBox, 1.0)[0].name, "orbit_-22.5_10");
  EXPECT_EQ(viewSet("orbit:-0,-0", kBox, 1.0)[0].name, "orbit_0_0");
}

TEST(ViewSet, ShowsTheWholeBoxInEveryView) {
  for (const char* name : {"axes", "sphere:32", "orbit:30,20", "orbit:10,90"})
    for (const Projection p : {Projection::Orthographic, Projection::Perspective})
      for (const View& view : viewSet(name, kBox, 0.75, p))
        for (int i = 0; i < 8; ++i) {
          const glm::dvec3 pixel = view.camera.project(kBox.corner(i), {300, 400});
          EXPECT_TRUE(pixel.x > 0 && pixel.x < 300 && pixel.y > 0 && pixel.y < 400) << view.name;
        }
}

TEST(ViewSet, MultiPerspectiveViewsHaveNamesOfTheirOwn) {
  const auto views = viewSet("axes", kBox, 1.0, Projection::MultiPerspective, 0.5, 2.0);
  ASSERT_EQ(views.size(), 6u);
  EXPECT_EQ(views[0].name, "front_distorted");
  EXPECT_EQ(views[0].camera, frameBoxDistorted(kBox, {0, 1, 0}, {0, 0, 1}, 1.0, 2.0));
  EXPECT_EQ(viewSet("orbit:30,20", kBox, 1.0, Projection::MultiPerspective)[0].name,
            "orbit_30_20_distorted");
}

TEST(ViewSet, NamesUseOnlyLettersThatFileNamesMayHave) {
  for (const char* name : {"axes", "sphere:12", "orbit:1e-5,-20.25"})
    for (const View& view : viewSet(name, kBox, 1.0))
      EXPECT_TRUE(std::all_of(view.name.begin(), view.name.end(), [](char c) {
        return std::string_view("abcdefghijklmnopqrstuvwxyz0123456789_+-.").find(c) !=
               std::string_view::npos;
      })) << view.name;
}

TEST(ViewSet, RefusesOtherNamesAndSaysWhatThereIs) {
  for (const char* name :
       {"", "Front", "side", "sphere", "sphere:", "sphere:0", "sphere:-1", "sphere:2.5",
        "sphere:1e9", "sphere:4x", "sphere:nan", "orbit:", "orbit:10", "orbit:10,", "orbit:a,b",
        "orbit:1,2,3", "orbit:inf,0", "orbit:400,0"}) {
    try {
      viewSet(name, kBox, 1.0);
      FAIL() << name;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::Config) << name;
      EXPECT_NE(std::string(e.what()).find("'" + std::string(name) + "'"), std::string::npos);
      EXPECT_NE(std::string(e.what()).find("choose front"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace vestige
