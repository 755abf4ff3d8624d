// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/renderer/view_effects.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/trigonometric.hpp>

#include "proxy/base/error.h"
#include "proxy/gl/device.h"
#include "tests/explorer/synthetic.h"

namespace vestige {
namespace {

Camera turned(const Camera& camera, const Rotation& by) {
  return camera.orbited({1.0, 2.0, 3.0}, glm::radians(by.azimuth), glm::radians(by.elevation),
                        glm::radians(by.roll));
}

TEST(ViewEffects, ComposedTurnsAreOneAfterTheOther) {
  Camera camera;
  camera.position = {1.0, -3.0, 3.0};
  for (const Rotation& first : {Rotation{0, 0, 0}, {30, 0, 0}, {-50, 70, 0}, {120, -40, 25}}) {
    for (const Rotation& then : {Rotation{2, 0, 0}, {0, -3, 0}, {10, 20, -30}}) {
      const Camera wanted = turned(turned(camera, first), then);
      const Camera made = turned(camera, composed(first, then));
      EXPECT_LT(glm::length(wanted.position - made.position), 1e-9);
      EXPECT_LT(glm::length(wanted.forward - made.forward), 1e-9);
      EXPECT_LT(glm::length(wanted.up - made.up), 1e-9);
    }
  }
}

class ViewEffectsOfArchive : public testing::Test {
 protected:
  void SetUp() override {
    synthetic::writeArchive(folder_.path() / "a.cdb", {40, 30}, 1);
    renderer_ = std::make_unique<Renderer>(
        gl::Device::create(), std::make_shared<const Archive>(folder_.path() / "a.cdb"));
    look_.rotate = {20.0, 10.0, 0.0};
  }
  Picture plain(const Rotation& rotation) {
    Look look = look_;
    look.rotate = rotation;
    look.frameFor = {look_.rotate};  // all views of an effect have one frame
    return renderer_->render(look).picture;
  }

  synthetic::TemporaryFolder folder_;
  std::unique_ptr<Renderer> renderer_;
  Look look_;
};

TEST_F(ViewEffectsOfArchive, StereoIsTheTwoEyesSideBySide) {
  const Picture pair = renderWithEffects(*renderer_, look_, {.stereo = 6.0}).picture;
  ASSERT_EQ(pair.size, (ImageSize{80, 30}));
  const Picture left = plain(composed(look_.rotate, {-3.0, 0.0, 0.0}));
  const Picture right = plain(composed(look_.rotate, {3.0, 0.0, 0.0}));
  bool differ = false;
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      for (int c = 0; c < 4; ++c) {
        EXPECT_EQ(pair.pixel(x, y)[c], left.pixel(x, y)[c]);
        EXPECT_EQ(pair.pixel(x + 40, y)[c], right.pixel(x, y)[c]);
        differ = differ || left.pixel(x, y)[c] != right.pixel(x, y)[c];
      }
    }
  }
  EXPECT_TRUE(differ);
}

TEST_F(ViewEffectsOfArchive, LensAndShutterAreMeansOfTheirViews) {
  for (const ViewEffects& effects :
       {ViewEffects{.aperture = 4.0, .samples = 5},
        ViewEffects{.shutter = {8.0, 0.0, 3.0}, .samples = 4},
        ViewEffects{.aperture = 2.0, .shutter = {0.0, 5.0, 0.0}, .samples = 3}}) {
    const Rendered made = renderWithEffects(*renderer_, look_, effects);
    const auto views = viewsOf(look_.rotate, effects, 0);
    ASSERT_EQ(views.size(), std::size_t(effects.samples));
    std::vector<double> mean(made.picture.rgba.size());
    for (const Rotation& view : views) {
      const Picture one = plain(view);
      for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += one.rgba[i] / double(views.size());
    }
    for (std::size_t i = 0; i < mean.size(); ++i) ASSERT_NEAR(made.picture.rgba[i], mean[i], 1e-6);
    EXPECT_FALSE(made.notes.empty());
  }
}

TEST(ViewEffects, ViewsOfALensStayWithinItAndSurroundItsMiddle) {
  const Rotation own{10.0, -5.0, 0.0};
  double azimuth = 0.0, elevation = 0.0;
  const auto views = viewsOf(own, {.aperture = 6.0, .samples = 64}, 0);
  for (const Rotation& view : views) {
    EXPECT_LE(std::hypot(view.azimuth - own.azimuth, view.elevation - own.elevation), 3.1);
    azimuth += (view.azimuth - own.azimuth) / 64.0;
    elevation += (view.elevation - own.elevation) / 64.0;
  }
  EXPECT_NEAR(azimuth, 0.0, 0.2);
  EXPECT_NEAR(elevation, 0.0, 0.2);
}

TEST(ViewEffects, WrongValuesAreNamed) {
  for (const ViewEffects& effects :
       {ViewEffects{.stereo = NAN}, ViewEffects{.aperture = -1.0}, ViewEffects{.aperture = 91.0},
        ViewEffects{.shutter = {400.0, 0.0, 0.0}}, ViewEffects{.aperture = 1.0, .samples = 1}}) {
    EXPECT_THROW(effects.validate(), Error);
  }
  ViewEffects{}.validate();
}

}  // namespace
}  // namespace vestige
