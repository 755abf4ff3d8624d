// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/camera/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

#include "proxy/base/error.h"

namespace vestige {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Random boxes, directions, pictures and projections over twelve orders of magnitude.
struct Scenes {
  std::mt19937_64 engine{7};
  double uniform(double a, double b) { return std::uniform_real_distribution(a, b)(engine); }
  glm::dvec3 vector() { return {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}; }

  Box box;
  ImageSize size;
  Camera camera;
  void next() {
    const double scale = std::pow(10.0, uniform(-6, 6));
    const glm::dvec3 low = scale * 3.0 * vector();
    box = {low, low + scale * (0.5 * vector() + 0.5)};
    size = {1 + int(uniform(0, 2000)), 1 + int(uniform(0, 2000))};
    const double pixelAspect = uniform(0, 1) < 0.5 ? 1.0 : std::exp(uniform(-2, 2));
    camera = frameBox(box, vector() * std::pow(10.0, uniform(-6, 6)), vector(),
                      size.aspect() * pixelAspect,
                      uniform(0, 1) < 0.5 ? Projection::Orthographic : Projection::Perspective,
                      uniform(0.01, 3.0));
    camera.pixelAspect = pixelAspect;
  }
  glm::dvec3 pointInBox() {
    return {uniform(box.low.x, box.high.x), uniform(box.low.y, box.high.y),
            uniform(box.low.z, box.high.z)};
  }
};

void expectNear(glm::dvec3 a, glm::dvec3 b, double tolerance) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

TEST(Camera, FramesTheWholeBoxFromAnyDirectionWithTwoPercentToSpare) {
  Scenes s;
  for (int i = 0; i < 3000; ++i) {
    s.next();
    double widest = 0.0;
    for (int c = 0; c < 8; ++c) {
      const glm::dvec3 p = s.camera.project(s.box.corner(c), s.size);
      const glm::dvec2 ndc(2.0 * p.x / s.size.width - 1.0, 1.0 - 2.0 * p.y / s.size.height);
      widest = std::max({widest, std::abs(ndc.x), std::abs(ndc.y)});
      EXPECT_GT(p.z, s.camera.nearDepth);
      EXPECT_LT(p.z, s.camera.farDepth);
    }
    ASSERT_LE(widest, (1.0 + 1e-9) / 1.02);
    // No more room than asked for; a wide-angle camera may have to stand back from the box.
    if (s.camera.projection == Projection::Orthographic) {
      ASSERT_GE(widest, (1.0 - 1e-9) / 1.02);
    }
  }
}

TEST(Camera, ProjectsAndUnprojectsAsExactInverses) {
  Scenes s;
  for (int i = 0; i < 3000; ++i) {
    s.next();
    s.camera.shift = 0.5 * glm::dvec2(s.vector());
    const glm::dvec3 world = s.pointInBox();
    const glm::dvec3 back = s.camera.unproject(s.camera.project(world, s.size), s.size);
    const double magnitude = glm::length(s.camera.position) + s.camera.farDepth;
    expectNear(back, world, 1e-13 * magnitude);
  }
}

TEST(Camera, ClipSpaceAgreesWithPixelsAndDepth) {
  Scenes s;
  for (int i = 0; i < 500; ++i) {
    s.next();
    s.camera.shift = 0.5 * glm::dvec2(s.vector());
    const Camera& c = s.camera;
    const glm::dvec3 p = s.pointInBox();
    const glm::dvec4 clip = c.clipFromWorld(s.size.aspect()) * glm::dvec4(p, 1.0);
    const glm::dvec3 ndc = glm::dvec3(clip) / clip.w;
    const glm::dvec3 pixel = c.project(p, s.size);
    EXPECT_NEAR((ndc.x + 1.0) / 2.0, pixel.x / s.size.width, 1e-9);
    EXPECT_NEAR((1.0 - ndc.y) / 2.0, pixel.y / s.size.height, 1e-9);
    const auto clipAt = [&](double depth) {
      const glm::dvec4 v = c.clipFromEye(s.size.aspect()) * glm::dvec4(0.0, 0.0, -depth, 1.0);
      return v.z / v.w;
    };
    EXPECT_NEAR(clipAt(c.nearDepth), -1.0, 1e-9);
    EXPECT_NEAR(clipAt(c.farDepth), 1.0, 1e-9);
  }
}

TEST(Camera, MatricesAndTheirInversesMultiplyToOne) {
  Scenes s;
  for (int i = 0; i < 300; ++i) {
    s.next();
    s.camera.shift = 0.5 * glm::dvec2(s.vector());
    const double a = s.size.aspect();
    const glm::dmat4 eye = s.camera.eyeFromWorld() * s.camera.worldFromEye();
    const glm::dmat4 clip = s.camera.clipFromEye(a) * s.camera.eyeFromClip(a);
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 4; ++row) {
        const double one = column == row ? 1.0 : 0.0;
        const double scale = column == 3 ? glm::length(s.camera.position) + 1.0 : 1.0;
        EXPECT_NEAR(eye[column][row], one, 1e-13 * scale);
        const double depths = 1.0 + s.camera.farDepth + 1.0 / s.camera.nearDepth;
        EXPECT_NEAR(clip[column][row], one, 1e-12 * depths);
      }
  }
}

TEST(Camera, LooksAlongMinusZOfEyeSpaceWithXRightAndYUp) {
  const Camera c;  // at (0, -1, 0), looking along +y, z up
  expectNear(c.right(), {1, 0, 0}, 0.0);
  const glm::dvec3 eye(c.eyeFromWorld() * glm::dvec4(0.25, 2.0, 0.5, 1.0));
  expectNear(eye, {0.25, 0.5, -3.0}, 1e-15);
  const glm::dvec3 pixel = c.project({0.25, 2.0, 0.5}, {100, 100});
  expectNear(pixel, {75.0, 0.0, 3.0}, 1e-12);
}

TEST(Camera, RaysPassThroughThePointsOfTheirPixel) {
  Scenes s;
  for (int i = 0; i < 1000; ++i) {
    s.next();
    s.camera.shift = 0.5 * glm::dvec2(s.vector());
    const glm::dvec3 p = s.pointInBox();
    const glm::dvec3 pixel = s.camera.project(p, s.size);
    const Ray ray = s.camera.rayThrough({pixel.x, pixel.y}, s.size);
    EXPECT_NEAR(glm::length(ray.direction), 1.0, 1e-14);
    EXPECT_NEAR(ray.depthPerLength, glm::dot(ray.direction, s.camera.forward), 1e-14);
    const glm::dvec3 reached = ray.origin + pixel.z / ray.depthPerLength * ray.direction;
    expectNear(reached, p, 1e-12 * (glm::length(s.camera.position) + s.camera.farDepth));
  }
}

TEST(Camera, SquarePixelsAreNoFewerAndOfTheSameShape) {
  EXPECT_EQ(squarePixels({256, 108}, 1.0), (ImageSize{256, 108}));
  EXPECT_EQ(squarePixels({256, 108}, 0.5), (ImageSize{256, 216}));
  EXPECT_EQ(squarePixels({256, 108}, 1.5), (ImageSize{384, 108}));
  // What a hostile file claims must not ask for more memory than a screen has.
  EXPECT_EQ(squarePixels({256, 108}, 1e300), (ImageSize{4096, 108}));
  EXPECT_EQ(squarePixels({5000, 108}, 1e-300), (ImageSize{5000, 4096}));
}

/// A random multi-perspective camera before a random box.
Camera distorted(Scenes& s) {
  s.next();
  return frameBoxDistorted(s.box, s.camera.forward, s.camera.up, s.size.aspect(),
                           std::pow(10.0, s.uniform(-1.5, 2.0)));
}

TEST(DistortedCamera, ProjectsAndUnprojectsAsExactInverses) {
  Scenes s;
  for (int i = 0; i < 2000; ++i) {
    const Camera camera = distorted(s);
    const glm::dvec3 world = s.pointInBox();
    const glm::dvec3 seen = camera.project(world, s.size);
    EXPECT_GE(seen.z, -1e-12 * s.box.diagonal());
    const double magnitude = glm::length(camera.position) + camera.farDepth + camera.viewHeight;
    expectNear(camera.unproject(seen, s.size), world, 1e-12 * magnitude);
  }
}

TEST(DistortedCamera, SeesAPointWhereItsRadiusAndItsDistortionSay) {
  // Method §3: r = ρ + Z/κ, in the direction of the point from the pole.
  Camera c;  // at (0, -1, 0), looking along +y, z up
  c.projection = Projection::MultiPerspective;
  c.convergence = 2.0;
  c.viewHeight = 10.0;
  expectNear(c.project({0.6, 2.0, 0.8}, {100, 100}), {50.0 + 15.0, 50.0 - 20.0, 3.0}, 1e-12);
  expectNear(c.project({0.0, 2.0, 0.0}, {100, 100}), {50.0 + 15.0, 50.0, 3.0}, 1e-12);
}

TEST(DistortedCamera, RaysRunFromTheCameraPlaneThroughTheirPointsToThePoleLine) {
  Scenes s;
  for (int i = 0; i < 1000; ++i) {
    const Camera camera = distorted(s);
    const glm::dvec3 p = s.pointInBox();
    const glm::dvec3 pixel = camera.project(p, s.size);
    const Ray ray = camera.rayThrough({pixel.x, pixel.y}, s.size);
    const double tolerance =
        1e-11 * (glm::length(camera.position) + camera.farDepth + camera.viewHeight);
    EXPECT_NEAR(glm::length(ray.direction), 1.0, 1e-14);
    EXPECT_NEAR(ray.depthPerLength, glm::dot(ray.direction, camera.forward), 1e-14);
    EXPECT_NEAR(glm::dot(ray.origin - camera.position, camera.forward), 0.0, tolerance);
    expectNear(ray.origin + pixel.z / ray.depthPerLength * ray.direction, p, tolerance);
    EXPECT_GE(ray.lastDepth, pixel.z - tolerance);
    const glm::dvec3 end = ray.origin + ray.lastDepth / ray.depthPerLength * ray.direction;
    expectNear(end, camera.position + ray.lastDepth * camera.forward, 3.0 * tolerance);
  }
  // The ray of the pole itself ends where it starts.
  EXPECT_EQ(
      distorted(s).rayThrough(0.5 * glm::dvec2(s.size.width, s.size.height), s.size).lastDepth,
      0.0);
}

TEST(DistortedCamera, ApproachesAnOrthographicOneAsItsRaysConvergeFartherAway) {
  const Box box{{-1, -2, -1}, {1, 2, 1}};
  const ImageSize size{200, 200};
  for (const double convergence : {1.0, 10.0, 100.0, 1000.0, 1e6}) {
    const Camera camera = frameBoxDistorted(box, {0, 1, 0}, {0, 0, 1}, 1.0, convergence);
    Camera parallel = camera;
    parallel.projection = Projection::Orthographic;
    const glm::dvec3 p(0.3, 1.5, -0.4);
    const double apart = glm::length(camera.project(p, size) - parallel.project(p, size)) *
                         camera.viewHeight / size.height;
    EXPECT_NEAR(apart, 3.5 / convergence, 1e-9) << "the distortion Z/κ";
    if (convergence == 1e6) {
      EXPECT_NEAR(camera.viewHeight, frameBox(box, {0, 1, 0}, {0, 0, 1}, 1.0).viewHeight, 1e-4);
    }
  }
}

TEST(DistortedCamera, FramesABallWithItsSides) {
  // Of a ball of radius 1 its rays reach what is up to 45 degrees behind its widest; the picture
  // reaches 1 + √2 radii from the pole, and its plane touches the box.
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  const Camera camera = frameBoxDistorted(box, {0, 1, 0}, {0, 0, 1}, 1.0);
  EXPECT_NEAR(camera.viewHeight, 2.0 * 1.02 * (1.0 + std::numbers::sqrt2), 1e-12);
  EXPECT_NEAR(camera.position.y, -1.0, 1e-12);
  Scenes s;
  for (int i = 0; i < 300; ++i) {
    const Camera any = distorted(s);
    const glm::dvec3 half = 0.5 * s.box.size();
    const glm::dvec3 onEllipsoid = s.box.center() + half * glm::normalize(s.vector());
    const glm::dvec3 pixel = any.project(onEllipsoid, s.size);
    EXPECT_TRUE(pixel.x >= 0 && pixel.x <= s.size.width && pixel.y >= 0 &&
                pixel.y <= s.size.height);
    for (int c = 0; c < 8; ++c) {
      const double depth = any.project(s.box.corner(c), s.size).z;
      EXPECT_GT(depth, any.nearDepth);
      EXPECT_LT(depth, any.farDepth);
      EXPECT_GT(depth, -1e-9 * s.box.diagonal());
    }
    EXPECT_EQ(undistorted(any, s.box, s.size.aspect()),
              frameBox(s.box, any.forward, any.up, s.size.aspect()));
    EXPECT_EQ(undistorted(s.camera, s.box, 1.0), s.camera);
  }
}

TEST(DistortedCamera, HasNoProjectionMatrixAndSaysSo) {
  const Camera camera =
      frameBox({{0, 0, 0}, {1, 1, 1}}, {0, 1, 0}, {0, 0, 1}, 1.0, Projection::MultiPerspective);
  EXPECT_THROW(camera.clipFromEye(1.0), Error);
  EXPECT_THROW(camera.eyeFromClip(1.0), Error);
  EXPECT_THROW(camera.clipFromWorld(1.0), Error);
  EXPECT_THROW(frameBoxDistorted({{0, 0, 0}, {1, 1, 1}}, {0, 1, 0}, {0, 0, 1}, 1.0, 0.0), Error);
  EXPECT_NO_THROW(frameBoxDistorted({{1, 1, 1}, {1, 1, 1}}, {0, 1, 0}, {0, 0, 1}, 1.0));
}

TEST(Camera, OrbitsToItsRightThenUpThenTurnsThePictureCounterclockwise) {
  const double quarter = 0.5 * std::numbers::pi;
  Camera c;
  c.position = {0, -3, 0};
  const Camera right = c.orbited({0, 0, 0}, quarter, 0.0);
  expectNear(right.position, {3, 0, 0}, 1e-15);
  expectNear(right.forward, {-1, 0, 0}, 1e-15);
  const Camera above = c.orbited({0, 0, 0}, 0.0, quarter);
  expectNear(above.position, {0, 0, 3}, 1e-15);
  expectNear(above.forward, {0, 0, -1}, 1e-15);
  expectNear(above.up, {0, 1, 0}, 1e-15);
  // A point at the right edge of the picture moves to its top.
  const Camera rolled = c.orbited({0, 0, 0}, 0.0, 0.0, quarter);
  expectNear(rolled.project({0.5, 0, 0}, {100, 100}), {50.0, 0.0, 3.0}, 1e-12);
}

TEST(Camera, OrbitKeepsTheCentreWhereItWasAndTheCameraValid) {
  Scenes s;
  for (int i = 0; i < 300; ++i) {
    s.next();
    const glm::dvec3 center = s.box.center();
    const Camera turned = s.camera.orbited(center, s.uniform(-7, 7), s.uniform(-7, 7));
    EXPECT_NO_THROW(turned.validate());
    const glm::dvec3 before = s.camera.project(center, s.size);
    const glm::dvec3 after = turned.project(center, s.size);
    expectNear(after, before, 1e-7 * (1.0 + before.z) + 1e-6);
  }
}

TEST(Camera, FramesDegenerateBoxes) {
  EXPECT_EQ(frameBox({{1, 2, 3}, {1, 2, 3}}, {0, 1, 0}, {0, 0, 1}, 1.0).viewHeight, 1.0);
  for (const glm::dvec3 size : {glm::dvec3(1, 0, 0), {0, 1, 0}, {0, 0, 1}, {1, 1, 0}, {0, 1, 1}})
    for (const glm::dvec3 forward : {glm::dvec3(1, 0, 0), {0, 1, 0}, {0, 0, 1}, {1, 1, 1}})
      for (const Projection p : {Projection::Orthographic, Projection::Perspective}) {
        const Camera c = frameBox({{0, 0, 0}, size}, forward, {0, 0, 1}, 1.0, p);
        for (int i = 0; i < 8; ++i) {
          const glm::dvec3 pixel = c.project(Box{{0, 0, 0}, size}.corner(i), {100, 100});
          EXPECT_TRUE(pixel.x >= 0 && pixel.x <= 100 && pixel.y >= 0 && pixel.y <= 100);
        }
      }
}

TEST(Camera, FramesAlongItsUpVectorWithAnUpOfItsOwn) {
  for (const double sign : {-1.0, 1.0}) {
    const Camera c = frameBox({{0, 0, 0}, {1, 1, 1}}, {0, 0, sign}, {0, 0, 1}, 1.0);
    expectNear(c.up, {0, 1, 0}, 1e-15);
  }
}

TEST(Camera, RefusesToFrameWhatIsNoBoxOrDirection) {
  const Box box{{0, 0, 0}, {1, 1, 1}};
  const auto code = [](const std::function<void()>& f) {
    try {
      f();
    } catch (const Error& e) {
      return e.code();
    }
    return ErrorCode::Internal;
  };
  const glm::dvec3 y(0, 1, 0), z(0, 0, 1);
  EXPECT_EQ(code([&] { frameBox(box, {0, 0, 0}, z, 1.0); }), ErrorCode::InvalidArgument);
  EXPECT_EQ(code([&] { frameBox(box, {kNaN, 0, 0}, z, 1.0); }), ErrorCode::InvalidArgument);
  EXPECT_EQ(code([&] { frameBox(box, y, {kNaN, 0, 0}, 1.0); }), ErrorCode::InvalidArgument);
  EXPECT_EQ(code([&] { frameBox(box, y, z, 0.0); }), ErrorCode::InvalidArgument);
  EXPECT_EQ(code([&] {
              frameBox({{0, 0, 0}, {kInfinity, 1, 1}}, y, z, 1.0);
            }),
            ErrorCode::InvalidArgument);
  EXPECT_EQ(code([&] { frameBox({{1, 0, 0}, {0, 1, 1}}, y, z, 1.0); }), ErrorCode::InvalidArgument);
  EXPECT_EQ(code([&] { frameBox(box, y, z, 1.0, Projection::Perspective, 3.2); }),
            ErrorCode::InvalidArgument);
}

TEST(Camera, ValidateNamesTheValueThatIsOutOfRange) {
  const auto problem = [](const std::function<void(Camera&)>& spoil) {
    Camera c;
    c.validate();
    spoil(c);
    try {
      c.validate();
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::InvalidArgument);
      return std::string(e.what());
    }
    return std::string("nothing");
  };
  const auto names = [&](const std::function<void(Camera&)>& spoil, const std::string& word) {
    EXPECT_NE(problem(spoil).find(word), std::string::npos) << problem(spoil);
  };
  names([](Camera& c) { c.position.x = kNaN; }, "position");
  names([](Camera& c) { c.forward = {0, 2, 0}; }, "forward (0, 2, 0)");
  names([](Camera& c) { c.up = {0, 0, 0.5}; }, "up (0, 0, 0.5)");
  names([](Camera& c) { c.up = {0, 1, 0}; }, "orthogonal");
  names([](Camera& c) { c.viewHeight = 0.0; }, "viewHeight 0");
  names([](Camera& c) { c.pixelAspect = 0.0; }, "pixelAspect 0");
  names([](Camera& c) { c.pixelAspect = kInfinity; }, "pixelAspect inf");
  names([](Camera& c) { c.viewHeight = kInfinity; }, "viewHeight inf");
  names([](Camera& c) { c.fieldOfView = 3.2; }, "fieldOfView 3.2");
  names([](Camera& c) { c.convergence = 0.0; }, "convergence 0");
  names([](Camera& c) { c.convergence = kNaN; }, "convergence nan");
  names([](Camera& c) { c.convergence = 1e7; }, "convergence 1");
  names([](Camera& c) { c.nearDepth = kNaN; }, "nearDepth nan");
  names([](Camera& c) { c.projection = Projection::Perspective; }, "nearDepth 0");
  names([](Camera& c) { c.farDepth = -1.0; }, "farDepth -1");
}

}  // namespace
}  // namespace vestige
