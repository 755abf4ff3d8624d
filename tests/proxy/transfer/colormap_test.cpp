// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/transfer/colormap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "proxy/base/error.h"

namespace vestige {
namespace {

/// sRGB colour number `index` of the 256 that a map's authors publish.
struct Published {
  const char* map;
  int index;
  glm::dvec3 srgb;
};
const Published kPublished[] = {
    {"viridis", 0, {0.267004, 0.004874, 0.329415}},
    {"viridis", 37, {0.274128, 0.199721, 0.498911}},
    {"viridis", 101, {0.165117, 0.467423, 0.558141}},
    {"viridis", 128, {0.127568, 0.566949, 0.550556}},
    {"viridis", 170, {0.20803, 0.718701, 0.472873}},
    {"viridis", 222, {0.657642, 0.860219, 0.203082}},
    {"viridis", 255, {0.993248, 0.906157, 0.143936}},
    {"inferno", 0, {0.001462, 0.000466, 0.013866}},
    {"inferno", 37, {0.162689, 0.043554, 0.333277}},
    {"inferno", 101, {0.572081, 0.145797, 0.406369}},
    {"inferno", 128, {0.735683, 0.215906, 0.330245}},
    {"inferno", 170, {0.929644, 0.411479, 0.145367}},
    {"inferno", 222, {0.977497, 0.782258, 0.185923}},
    {"inferno", 255, {0.988362, 0.998364, 0.644924}},
    {"plasma", 0, {0.050383, 0.029803, 0.527975}},
    {"plasma", 37, {0.331426, 0.006261, 0.641316}},
    {"plasma", 101, {0.688318, 0.160709, 0.568103}},
    {"plasma", 128, {0.798216, 0.280197, 0.469538}},
    {"plasma", 170, {0.928329, 0.472975, 0.326067}},
    {"plasma", 222, {0.993851, 0.759304, 0.159092}},
    {"plasma", 255, {0.940015, 0.975158, 0.131326}},
    {"magma", 0, {0.001462, 0.000466, 0.013866}},
    {"magma", 37, {0.140858, 0.068654, 0.324538}},
    {"magma", 101, {0.544015, 0.159033, 0.506159}},
    {"magma", 128, {0.716387, 0.214982, 0.47529}},
    {"magma", 170, {0.944006, 0.377643, 0.365136}},
    {"magma", 222, {0.997138, 0.75519, 0.522806}},
    {"magma", 255, {0.987053, 0.991438, 0.749504}},
    {"cividis", 0, {0, 0.135112, 0.304751}},
    {"cividis", 37, {0.13683, 0.234216, 0.432148}},
    {"cividis", 101, {0.397991, 0.409011, 0.439848}},
    {"cividis", 128, {0.488697, 0.485318, 0.471008}},
    {"cividis", 170, {0.648222, 0.610553, 0.454801}},
    {"cividis", 222, {0.862105, 0.782494, 0.350011}},
    {"cividis", 255, {0.995737, 0.909344, 0.217772}},
    {"coolwarm", 0, {0.229806, 0.298718, 0.753683}},
    {"coolwarm", 37, {0.409611, 0.540759, 0.935545}},
    {"coolwarm", 101, {0.748682, 0.827679, 0.963334}},
    {"coolwarm", 128, {0.867428, 0.864377, 0.862602}},
    {"coolwarm", 170, {0.968203, 0.720844, 0.612293}},
    {"coolwarm", 222, {0.873402, 0.38696, 0.306332}},
    {"coolwarm", 255, {0.705673, 0.015556, 0.150233}},
    {"turbo", 0, {0.18995, 0.07176, 0.23217}},
    {"turbo", 37, {0.2768, 0.47151, 0.94214}},
    {"turbo", 101, {0.2618, 0.96765, 0.52981}},
    {"turbo", 128, {0.64362, 0.98999, 0.23356}},
    {"turbo", 170, {0.98, 0.73, 0.22161}},
    {"turbo", 222, {0.83172, 0.19912, 0.02131}},
    {"turbo", 255, {0.4796, 0.01583, 0.01055}},
    {"rainbow", 0, {0.5, 0, 1}},
    {"rainbow", 37, {0.209804, 0.440216, 0.974139}},
    {"rainbow", 101, {0.292157, 0.947177, 0.812622}},
    {"rainbow", 128, {0.503922, 0.999981, 0.704926}},
    {"rainbow", 170, {0.833333, 0.866025, 0.5}},
    {"rainbow", 222, {1, 0.395451, 0.201882}},
    {"rainbow", 255, {1, 0, 0}},
    {"hot", 0, {0.0416, 0, 0}},
    {"hot", 37, {0.422509, 0, 0}},
    {"hot", 101, {1, 0.081373, 0}},
    {"hot", 128, {1, 0.359314, 0}},
    {"hot", 170, {1, 0.791666, 0}},
    {"hot", 222, {1, 1, 0.490441}},
    {"hot", 255, {1, 1, 1}},
};

TEST(Colormap, ReproducesThePublishedColours) {
  for (const Published& p : kPublished) {
    const glm::dvec3 srgb = srgbFromLinear(Colormap::named(p.map).at(p.index / 255.0));
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(srgb[i], p.srgb[i], 1.0 / 255.0) << p.map << " " << p.index;
  }
}

TEST(Colormap, IsContinuousAndInGamutForEveryName) {
  EXPECT_EQ(Colormap::names().size(), 10u);
  for (const std::string& name : Colormap::names()) {
    const Colormap map = Colormap::named(name);
    EXPECT_EQ(map.name(), name);
    glm::dvec3 before = srgbFromLinear(map.at(0.0));
    for (int i = 1; i <= 2000; ++i) {
      const glm::dvec3 now = srgbFromLinear(map.at(i / 2000.0));
      for (int c = 0; c < 3; ++c) {
        ASSERT_TRUE(now[c] >= -1e-12 && now[c] <= 1.0 + 1e-12);
        ASSERT_NEAR(now[c], before[c], 0.01) << name << " " << i;
      }
      before = now;
    }
  }
}

TEST(Colormap, ReversesWithASuffix) {
  for (const std::string& name : Colormap::names()) {
    const Colormap map = Colormap::named(name), reversed = Colormap::named(name + "_r");
    EXPECT_EQ(reversed.name(), name + "_r");
    for (double t = 0.0; t <= 1.0; t += 0.03125)
      EXPECT_NEAR(glm::length(map.at(t) - reversed.at(1.0 - t)), 0.0, 1e-12);
  }
}

TEST(Colormap, ClampsOutsideItsRange) {
  const Colormap map = Colormap::named("viridis");
  EXPECT_EQ(map.at(-5.0), map.at(0.0));
  EXPECT_EQ(map.at(5.0), map.at(1.0));
  EXPECT_EQ(map.at(std::numeric_limits<double>::infinity()), map.at(1.0));
  EXPECT_EQ(map.at(std::numeric_limits<double>::quiet_NaN()), map.at(0.0));
}

TEST(Colormap, InterpolatesInSrgbAndReturnsLinear) {
  const Colormap grey = Colormap::named("grey");
  EXPECT_NEAR(grey.at(0.5).x, 0.21404114, 1e-8);
  EXPECT_EQ(Colormap::named("gray").name(), "grey");
  const Colormap one = Colormap::fromSrgb("one", {{1.0, 0.5, 0.0}});
  EXPECT_EQ(one.at(0.0), one.at(1.0));
  EXPECT_EQ(Colormap().at(1.0), glm::dvec3(1.0));
}

TEST(Colormap, SrgbCurveAndItsInverseAgree) {
  for (double v = 0.0; v <= 1.0; v += 1.0 / 4096)
    EXPECT_NEAR(srgbFromLinear(linearFromSrgb(glm::dvec3(v))).x, v, 1e-7);
  EXPECT_EQ(linearFromSrgb(glm::dvec3(0.0)), glm::dvec3(0.0));
  EXPECT_NEAR(linearFromSrgb(glm::dvec3(1.0)).x, 1.0, 1e-15);
}

TEST(Colormap, NamesTheChoicesWhenTheNameIsUnknown) {
  for (const char* name : {"", "jet", "Viridis", "viridis_r_r", "_r"}) {
    try {
      Colormap::named(name);
      FAIL() << name;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::Config);
      EXPECT_NE(std::string(e.what()).find("cividis"), std::string::npos);
    }
  }
}

TEST(Colormap, RefusesColoursOutsideTheGamut) {
  for (const double bad : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(Colormap::fromSrgb("bad", {{0.0, bad, 0.0}}), Error);
  EXPECT_THROW(Colormap::fromSrgb("none", {}), Error);
}

}  // namespace
}  // namespace vestige
