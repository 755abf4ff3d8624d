// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/renderer/framing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "explorer/export/movie.h"
#include "explorer/picture/picture.h"

namespace vestige {
namespace {

const Box kDomain{{1.0, 2.0, 3.0}, {5.0, 4.0, 4.0}};
constexpr ImageSize kSize{320, 240};

Camera stored(Projection projection, double loose = 1.0) {
  Camera camera =
      frameBox(kDomain, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}, kSize.aspect(), projection, 0.6);
  camera.viewHeight *= loose;
  if (projection == Projection::Perspective) {
    camera.fieldOfView = 2.0 * std::atan(loose * std::tan(0.5 * camera.fieldOfView));
  }
  return camera;
}

Camera finalCamera(const Look& look, const Camera& camera) {
  return fittedCamera(framedCamera(look, camera, kSize, kDomain), kSize, look.size.value_or(kSize));
}

/// How far the corners of a box reach to the edges of the picture: 1 = to the nearest.
double reach(const Camera& camera, ImageSize size, const Box& box) {
  double most = 0.0;
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 pixel = camera.project(box.corner(i), size);
    EXPECT_GT(pixel.z, camera.nearDepth);
    EXPECT_LT(pixel.z, camera.farDepth);
    most = std::max({most, std::abs(2.0 * pixel.x / size.width - 1.0),
                     std::abs(2.0 * pixel.y / size.height - 1.0)});
  }
  return most;
}

double halfHeight(const Camera& camera) {
  const double distance = glm::dot(kDomain.center() - camera.position, camera.forward);
  return camera.projection == Projection::Perspective
             ? distance * std::tan(0.5 * camera.fieldOfView)
             : 0.5 * camera.viewHeight;
}

class Framing : public testing::TestWithParam<Projection> {};
INSTANTIATE_TEST_SUITE_P(Of, Framing,
                         testing::Values(Projection::Orthographic, Projection::Perspective),
                         [](const auto& of) {
                           return of.param == Projection::Perspective ? "perspective"
                                                                      : "orthographic";
                         });

TEST_P(Framing, TheUnturnedPictureKeepsTheStoredFrameToTheLastBit) {
  for (const double loose : {0.4, 1.0, 3.0}) {
    const Camera camera = stored(GetParam(), loose);
    EXPECT_EQ(framedCamera(Look{}, camera, kSize, kDomain), camera);
    Look equal;
    equal.scale = glm::dvec3(7.0);
    EXPECT_EQ(framedCamera(equal, camera, kSize, kDomain), camera);
  }
}

TEST_P(Framing, ATurnedPictureHoldsTheDomainWhereTheStoredOneDoes) {
  const Camera camera = stored(GetParam());
  for (const Rotation& rotation :
       {Rotation{30, 20, 0}, {90, 0, 0}, {45, 45, 30}, {180, 0, 90}, {-100, 80, 0}}) {
    for (const ImageSize size : {kSize, ImageSize{100, 300}, ImageSize{500, 100}}) {
      Look look;
      look.rotate = rotation;
      look.size = size;
      EXPECT_LE(reach(finalCamera(look, camera), size, kDomain), 1.0);
    }
  }
}

TEST_P(Framing, ASmallTurnChangesTheFrameLittleWhateverTheStoredOneHolds) {
  for (const double loose : {0.3, 1.0, 2.0}) {
    const Camera camera = stored(GetParam(), loose);
    double before = halfHeight(camera);
    for (double azimuth = 0.5; azimuth <= 90.0; azimuth += 0.5) {
      Look look;
      look.rotate = {azimuth, 0.3 * azimuth, 0.0};
      const double now = halfHeight(framedCamera(look, camera, kSize, kDomain));
      EXPECT_NEAR(now / before, 1.0, 0.02) << loose << ", " << azimuth;
      before = now;
    }
    if (loose == 2.0 && GetParam() == Projection::Orthographic) {
      EXPECT_EQ(before, halfHeight(camera)) << "there was room";
    }
  }
}

TEST_P(Framing, TheStoredFrameStaysWhereItIsAskedFor) {
  Look look;
  look.rotate = {40.0, 10.0, 0.0};
  look.frame = Frame::Stored;
  const Camera camera = stored(GetParam());
  EXPECT_NEAR(halfHeight(framedCamera(look, camera, kSize, kDomain)), halfHeight(camera), 1e-9);
}

TEST_P(Framing, FitIsTightOnTheDomainOrItsClipBoxAtAnySize) {
  const Box clip{{1.5, 2.0, 3.0}, {2.0, 2.5, 9.0}}, cut{{1.5, 2.0, 3.0}, {2.0, 2.5, 4.0}};
  for (const double loose : {0.3, 4.0}) {
    for (const ImageSize size : {kSize, ImageSize{100, 300}, ImageSize{500, 100}}) {
      Look look;
      look.rotate = {30.0, 40.0, 0.0};
      look.frame = Frame::Fit;
      look.size = size;
      const double whole = reach(finalCamera(look, stored(GetParam(), loose)), size, kDomain);
      EXPECT_LE(whole, 1.0);
      EXPECT_GT(whole, 0.95);
      look.clip = clip;
      const double part = reach(finalCamera(look, stored(GetParam(), loose)), size, cut);
      EXPECT_LE(part, 1.0);
      EXPECT_GT(part, 0.9);  // a wide-angle viewer must keep some distance
    }
  }
}

TEST_P(Framing, AMovieOfATurnHasOneFrameThatHoldsAllOfIt) {
  const Camera camera = stored(GetParam());
  Look start;
  start.rotate = {10.0, 20.0, 0.0};
  for (const double degrees : {40.0, 360.0}) {
    double one = 0.0, most = 0.0;
    for (const Look& look : looksOfTurn(start, degrees, 24)) {
      const Camera seen = finalCamera(look, camera);
      if (one == 0.0) one = halfHeight(seen);
      EXPECT_NEAR(halfHeight(seen), one, 1e-9 * one);
      most = std::max(most, reach(seen, kSize, kDomain));
    }
    EXPECT_LE(most, 1.0);
    EXPECT_GT(most, 0.9);
  }
  double one = 0.0;
  for (double azimuth = 0.0; azimuth < 360.0; azimuth += 24.0) {
    Look look = start;
    look.rotate.azimuth = azimuth;
    look.frame = Frame::Orbit;
    const Camera seen = finalCamera(look, camera);
    if (one == 0.0) one = halfHeight(seen);
    EXPECT_NEAR(halfHeight(seen), one, 1e-9 * one);
    EXPECT_LE(reach(seen, kSize, kDomain), 1.0);
  }
}

TEST_P(Framing, ZoomPanAndCentreMoveWhatIsSeenBySoMuch) {
  const Camera camera = stored(GetParam());
  const glm::dvec3 middle = kDomain.center(), aside = middle + glm::dvec3(0.4, 0.0, 0.2);
  for (const Rotation& rotation : {Rotation{}, {25, -15, 5}}) {
    for (const ImageSize size : {kSize, ImageSize{200, 200}}) {
      Look look;
      look.rotate = rotation;
      look.size = size;
      const auto pixel = [&](glm::dvec3 point) {
        return glm::dvec2(finalCamera(look, camera).project(point, size));
      };
      const glm::dvec2 center(0.5 * size.width, 0.5 * size.height);
      const glm::dvec2 plain = pixel(aside);
      look.zoom = 2.5;
      EXPECT_LT(glm::length(pixel(aside) - center - 2.5 * (plain - center)), 1e-6 * size.width);
      look.zoom = 1.0;
      look.pan = {0.1, 0.25};
      const glm::dvec2 moved = glm::dvec2(0.1, -0.25) * double(size.height);
      EXPECT_LT(glm::length(pixel(aside) - plain - moved), 1e-6 * size.width);
      look.zoom = 3.0;
      look.center = aside;
      EXPECT_LT(glm::length(pixel(aside) - center - moved), 1e-6 * size.width);
    }
  }
}

TEST_P(Framing, AnUnturnedFrameIsAWindowOfTheStoredPictureAndATurnedOneIsNot) {
  const Camera camera = stored(GetParam());
  Look look;
  look.zoom = 2.0;
  look.pan = {0.25, 0.0};
  const auto window = windowOf(camera, kSize, finalCamera(look, camera), kSize);
  ASSERT_TRUE(window);
  // Half of the picture each way; what is seen went right by a quarter of 240 pixels, hence 30.
  const glm::dvec2 middle = 0.5 * (window->low + window->high);
  EXPECT_NEAR(window->high.x - window->low.x, 160.0, 1e-6);
  EXPECT_NEAR(window->high.y - window->low.y, 120.0, 1e-6);
  EXPECT_NEAR(middle.x, 160.0 - 30.0, 1e-6);
  EXPECT_NEAR(middle.y, 120.0, 1e-6);
  look.rotate.azimuth = 0.01;
  EXPECT_FALSE(windowOf(camera, kSize, finalCamera(look, camera), kSize));
}

TEST(Windows, AreTheSamePixelsEnlargedAndEmptyBeyondThePicture) {
  Picture picture = Picture::blank({8, 4});
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 8; ++x) picture.pixel(x, y)[0] = float(x), picture.pixel(x, y)[3] = 1.0f;
  }
  const Picture part = windowed(picture, {2.0, 1.0}, {6.0, 3.0}, {8, 4});
  for (int x = 0; x < 8; ++x) EXPECT_NEAR(part.pixel(x, 2)[0], 1.75 + 0.5 * x, 1e-5);
  const Picture beyond = windowed(picture, {-8.0, 0.0}, {8.0, 4.0}, {16, 4});
  for (int x = 0; x < 16; ++x) EXPECT_NEAR(beyond.pixel(x, 1)[3], x < 8 ? 0.0 : 1.0, 1e-6) << x;
}

TEST(Stretching, KeepsTheDiagonalAndTheMiddleAndItsPlanes) {
  const Stretch stretch({1.0, 1.0, 50.0}, kDomain);
  EXPECT_FALSE(stretch.none());
  EXPECT_NEAR(stretch.box(kDomain).diagonal(), kDomain.diagonal(), 1e-12);
  EXPECT_LT(glm::length(stretch.box(kDomain).center() - kDomain.center()), 1e-12);
  EXPECT_NEAR(stretch.factors().z / stretch.factors().x, 50.0, 1e-9);
  const glm::dvec4 plane(1.0, -2.0, 3.0, 0.5);
  for (const glm::dvec3 at : {glm::dvec3(1, 2, 3), {0.3, -0.1, 4.0}, {5, 5, 5}}) {
    const glm::dvec4 seen = stretch.plane(plane);
    EXPECT_NEAR(glm::dot(glm::dvec3(seen), stretch.point(at)) - seen.w,
                glm::dot(glm::dvec3(plane), at) - plane.w, 1e-9);
  }
  EXPECT_TRUE(Stretch({3.0, 3.0, 3.0}, kDomain).none());
  EXPECT_TRUE(Stretch({1.0, 2.0, 3.0}, {}).none());
}

}  // namespace
}  // namespace vestige
