// SPDX-License-Identifier: BSD-3-Clause
//
// Ray casting of 3-D grids against media whose light is known in closed form, and invariances.
#include "explorer/volume/volume_pass.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/gtc/quaternion.hpp>

#include "proxy/base/error.h"
#include "volume_fixture.h"

namespace vestige {
namespace {

const glm::dvec4 kMedium{0.2, 0.5, 0.1, 0.8};  // (σ·c, σ)

using Medium = std::function<glm::dvec4(glm::dvec3 world)>;

LookGrid opticsGrid(glm::ivec3 size, const glm::dmat4& worldFromGrid, const Medium& medium,
                    OpticsFormat format = OpticsFormat::Half) {
  std::vector<float> rgba(4 * std::size_t(size.x * size.y * size.z));
  forEachCell(size, worldFromGrid, [&](std::size_t i, glm::dvec3 at) {
    for (std::size_t c = 0; c < 4; ++c) rgba[4 * i + c] = float(medium(at)[int(c)]);
  });
  return LookGrid::optics(size, worldFromGrid, rgba, format);
}

double chord(const Ray& ray, const Box& box) {
  double enter = 0.0, leave = 1e30;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (box.low[axis] - ray.origin[axis]) / ray.direction[axis];
    const double b = (box.high[axis] - ray.origin[axis]) / ray.direction[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return std::max(0.0, leave - enter);
}

double difference(const Picture& a, const Picture& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    most = std::max(most, double(std::abs(a.rgba[i] - b.rgba[i])));
  }
  return most;
}

/// Blobs of extinction with empty space between them.
glm::dvec4 blobs(glm::dvec3 at) {
  const double a = std::max(0.0, 1.0 - 3.0 * glm::length(at - glm::dvec3(0.5, 0.2, 2.4)));
  const double b = std::max(0.0, 1.0 - 4.0 * glm::length(at - glm::dvec3(-0.6, -0.3, 2.7)));
  return glm::dvec4(a, b, 0.4 * b, a + b) * 9.0;
}

TEST(VolumePass, AHomogeneousMediumIsExactAtAnyStepAndAngle) {
  device().run([] {
    VolumePass pass;
    for (const OpticsFormat format : {OpticsFormat::Half, OpticsFormat::Byte}) {
      const LookGrid grid = opticsGrid(
          {20, 11, 7}, over(kBox), [](glm::dvec3) { return kMedium; }, format);
      for (const Projection projection : {Projection::Orthographic, Projection::Perspective}) {
        for (const double step : {0.3, 2.5}) {
          VolumeSetup setup;
          setup.camera = cameraOf(kBox, {0.4, 1.0, -0.3}, projection);
          setup.step = step;
          setup.opaque = 0.0;
          const VolumeView view = draw(pass, grid, setup);
          int hits = 0;
          for (int y = 0; y < kSize.height; ++y) {
            for (int x = 0; x < kSize.width; ++x) {
              const double length = chord(setup.camera.rayThrough({x + 0.5, y + 0.5}, kSize), kBox);
              const double alpha = 1.0 - std::exp(-kMedium.a * length);
              const float* pixel = view.picture.pixel(x, y);
              hits += length > 0.0;
              const double close = format == OpticsFormat::Half ? 1e-3 : 6e-3;
              ASSERT_NEAR(pixel[3], alpha, close) << x << ' ' << y << " step " << step;
              ASSERT_NEAR(pixel[1], alpha * kMedium.g / kMedium.a, close);
            }
          }
          EXPECT_GT(hits, 500);
        }
      }
    }
  });
}

TEST(VolumePass, ALinearFieldOfValuesIsIntegratedExactlyByItsTable) {
  device().run([] {
    VolumePass pass;
    const Box box{{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}};
    const int n = 16;
    // Extinction is 12 z² between the outermost cell centres: its integral is 4 z³.
    LookGrid grid = scalarGrid({n, n, n}, over(box), [](glm::dvec3 at) { return 500.0 + at.z; });
    const double margin = 0.5 / n;
    grid.low = glm::dvec3(margin);
    grid.high = glm::dvec3(1.0 - margin);
    const OpticsTable table(
        [](double value) {
          const double z = value - 500.0;
          return glm::dvec4(12.0 * z * z * z, 0.0, 0.0, 12.0 * z * z);
        },
        500.0, 501.0);
    VolumePass::findBricks(grid, table);
    VolumeSetup setup;
    setup.camera = cameraOf(box, {0.0, 0.0, 1.0}, Projection::Orthographic, {0, 1, 0});
    setup.table = &table;
    for (const double step : {0.5, 1.0, 3.0}) {
      setup.step = step;
      setup.opaque = 0.0;
      const VolumeView view = draw(pass, grid, setup);
      const double low = margin, high = 1.0 - margin;
      const double depth = 4.0 * (high * high * high - low * low * low);
      EXPECT_NEAR(view.picture.pixel(24, 18)[3], 1.0 - std::exp(-depth), 1e-4) << step;
    }
  });
}

TEST(VolumePass, SmoothFunctionsAreCastInLongStepsAndHardEdgesInShortOnes) {
  device().run([] {
    VolumePass pass;
    LookGrid grid = scalarGrid({40, 40, 40}, over(kBox), [](glm::dvec3 at) {
      return 0.5 + 0.2 * std::sin(5.0 * at.x + at.z) + 0.3 * std::cos(4.0 * at.y - 2.0 * at.z);
    });
    const auto stepFor = [&](const OpticsTable::Optics& optics) {
      const OpticsTable table(optics, 0.0, 1.0);
      VolumePass::findBricks(grid, table);
      const double step = pass.longestStep(grid, table, kBox);
      VolumeSetup setup;
      setup.camera = cameraOf(kBox, {0.4, 1.0, -0.3}, Projection::Orthographic);
      setup.table = &table;
      const VolumeView fine = draw(pass, grid, setup);
      setup.step = step;
      EXPECT_LT(difference(fine.picture, draw(pass, grid, setup).picture), 0.05);
      return step;
    };
    EXPECT_GE(stepFor([](double v) { return glm::dvec4(2.0 * v * v, v, 0.5 * v, 2.0 * v); }), 2.0);
    EXPECT_LE(stepFor([](double v) {
                const double s = v > 0.49 && v < 0.51 ? 500.0 : 0.0;
                return glm::dvec4(s, s, s, s);
              }),
              1.0);
  });
}

TEST(VolumePass, CameraAndMediumTurnTogether) {
  device().run([] {
    VolumePass pass;
    const glm::dmat4 turn = glm::translate(glm::dmat4(1.0), glm::dvec3(5.0, -3.0, 1.0)) *
                            glm::mat4_cast(glm::normalize(glm::dquat(0.3, 0.5, -0.2, 0.7)));
    LookGrid grid = opticsGrid({24, 20, 16}, over(kBox), blobs);
    VolumeSetup setup;
    setup.camera = cameraOf(kBox, {0.4, 1.0, -0.3}, Projection::Perspective);
    Look look;
    look.shading = Shading::Phong;
    const auto lit = [&] {
      pass.findGradients(grid);
      const LightSetup light = lightSetup(look, setup.camera, setup.camera, kBox);
      setup.light = &light;
      return draw(pass, grid, setup);
    };
    const VolumeView before = lit();
    grid.worldFromGrid = turn * grid.worldFromGrid;
    setup.camera.position = glm::dvec3(turn * glm::dvec4(setup.camera.position, 1.0));
    setup.camera.forward = glm::dmat3(turn) * setup.camera.forward;
    setup.camera.up = glm::dmat3(turn) * setup.camera.up;
    EXPECT_LT(difference(before.picture, lit().picture), 2e-3);
    EXPECT_GT(*std::max_element(before.picture.rgba.begin(), before.picture.rgba.end()), 0.5f);
  });
}

TEST(VolumePass, PermutedMirroredAndFarGridsShowTheSame) {
  device().run([] {
    VolumePass pass;
    VolumeSetup setup;
    setup.camera = cameraOf(kBox, {0.4, 1.0, -0.3}, Projection::Orthographic);
    const VolumeView before = draw(pass, opticsGrid({24, 20, 16}, over(kBox), blobs), setup);
    // Grid x runs down world z, grid y along world x, grid z along world y.
    glm::dmat4 permuted(0.0);
    const glm::dvec3 size = kBox.size();
    permuted[0][2] = -size.z;
    permuted[1][0] = size.x;
    permuted[2][1] = size.y;
    permuted[3] = {kBox.low.x, kBox.low.y, kBox.high.z, 1.0};
    const VolumeView after = draw(pass, opticsGrid({16, 24, 20}, permuted, blobs), setup);
    EXPECT_LT(difference(before.picture, after.picture), 2e-3);
    const glm::dvec3 away(1e7, -3e7, 2e7);
    LookGrid far = opticsGrid({24, 20, 16}, over(kBox), blobs);
    far.worldFromGrid = glm::translate(glm::dmat4(1.0), away) * far.worldFromGrid;
    setup.camera.position += away;
    EXPECT_LT(difference(before.picture, draw(pass, far, setup).picture), 2e-3);
  });
}

TEST(VolumePass, PassingOverEmptyBricksChangesNothing) {
  device().run([] {
    VolumePass pass;
    LookGrid optics = opticsGrid({70, 33, 41}, over(kBox), blobs);
    LookGrid values =
        scalarGrid({70, 33, 41}, over(kBox), [](glm::dvec3 at) { return blobs(at).a; });
    const OpticsTable table(
        [](double value) {
          const double s = value > 6.0 ? 20.0 : value > 1.0 && value < 1.3 ? 3.0 : 0.0;
          return glm::dvec4(0.5 * s, 0.1 * value * s, s, s);
        },
        0.0, 9.0);
    VolumePass::findBricks(values, table);
    VolumeSetup setup;
    setup.table = &table;
    for (const glm::dvec3 forward : {glm::dvec3(0, 1, 0), {-0.4, 1.0, 0.3}, {0.9, -0.2, 0.5}}) {
      for (const Projection projection : {Projection::Orthographic, Projection::Perspective}) {
        setup.camera = cameraOf(kBox, forward, projection);
        for (const LookGrid* grid : {&optics, &values}) {
          setup.skip = false;
          const VolumeView plain = draw(pass, *grid, setup);
          setup.skip = true;
          EXPECT_LT(difference(plain.picture, draw(pass, *grid, setup).picture), 1e-5);
        }
      }
    }
    // Bricks found on the GPU are those found on the CPU.
    const VolumeView before = draw(pass, optics, setup);
    pass.findBricks(optics);
    EXPECT_EQ(before.picture.rgba, draw(pass, optics, setup).picture.rgba);
  });
}

TEST(VolumePass, ProbesLeaveOutWhatCannotBeSeen) {
  device().run([] {
    VolumePass pass;
    const LookGrid grid = opticsGrid({24, 20, 16}, over(kBox), blobs);
    VolumeSetup setup;
    setup.size = {201, 150};  // odd, even
    for (const Projection projection : {Projection::Orthographic, Projection::Perspective}) {
      setup.camera = frameBox(kBox, {0.4, 1.0, -0.3}, {0, 0, 1}, setup.size.aspect(), projection);
      setup.tolerance = 0.0;
      const VolumeView all = pass.render(grid, setup);
      setup.tolerance = 1.0 / 256.0;
      const VolumeView probed = pass.render(grid, setup);
      EXPECT_NE(all.picture.rgba, probed.picture.rgba);
      EXPECT_LT(difference(all.picture, probed.picture), 1.0 / 255.0);
      for (std::size_t i = 0; i < all.depth.size(); ++i) {
        if (all.picture.rgba[4 * i + 3] > 0.02f) {
          ASSERT_NEAR(all.depth[i], probed.depth[i], 0.05) << i;
        }
      }
    }
  });
}

TEST(VolumePass, AClipBoxCutsTheMediumExactly) {
  device().run([] {
    VolumePass pass;
    const LookGrid grid = opticsGrid({9, 9, 9}, over(kBox), [](glm::dvec3) { return kMedium; });
    VolumeSetup setup;
    setup.camera = cameraOf(kBox, {0.4, 1.0, -0.3}, Projection::Perspective);
    setup.clip = Box{{-0.5, -2.0, 2.2}, {0.3, 0.6, 9.0}};
    const Box both{{-0.5, -0.7, 2.2}, {0.3, 0.6, 3.0}};
    const VolumeView view = draw(pass, grid, setup);
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < kSize.width; ++x) {
        const double length = chord(setup.camera.rayThrough({x + 0.5, y + 0.5}, kSize), both);
        ASSERT_NEAR(view.picture.pixel(x, y)[3], 1.0 - std::exp(-kMedium.a * length), 1e-3);
      }
    }
  });
}

TEST(VolumePass, IsosurfacesSlicesAndMaximaLieWhereTheyShould) {
  device().run([] {
    VolumePass pass;
    const Box box{{-1.0, -1.0, -1.0}, {1.0, 1.0, 1.0}};
    LookGrid grid =
        scalarGrid({64, 64, 64}, over(box), [](glm::dvec3 at) { return 1.0 - glm::length(at); });
    const OpticsTable colors([](double value) { return glm::dvec4(value, 0.0, 0.0, 1.0); }, 0.0,
                             1.0);
    VolumeSetup setup;
    setup.camera = cameraOf(box, {0.0, 1.0, 0.0}, Projection::Orthographic);
    setup.table = &colors;
    setup.mode = VolumeMode::Isosurface;
    setup.isosurfaces = {{0.5, {1.0, 1.0, 0.0}, 1.0}, {0.3, {0.0, 0.0, 1.0}, 0.25}};
    VolumePass::findBricks(grid, setup.isosurfaces);
    VolumeView view = draw(pass, grid, setup);
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < kSize.width; ++x) {
        const Ray ray = setup.camera.rayThrough({x + 0.5, y + 0.5}, kSize);
        const double off = std::hypot(ray.origin.x, ray.origin.z);
        const float* pixel = view.picture.pixel(x, y);
        if (off < 0.45) {
          EXPECT_NEAR(pixel[0], 0.75, 1e-5);
          EXPECT_NEAR(pixel[2], 0.25, 1e-5);
          const double outer = -std::sqrt(0.49 - off * off), inner = -std::sqrt(0.25 - off * off);
          const double depth = 0.25 * outer + 0.75 * inner - setup.camera.position.y;
          EXPECT_NEAR(view.depth[std::size_t(y * kSize.width + x)], depth, 5e-3);
        } else if (off > 0.75) {
          EXPECT_EQ(pixel[3], 0.0f);
          EXPECT_TRUE(std::isinf(view.depth[std::size_t(y * kSize.width + x)]));
        }
      }
    }
    setup.mode = VolumeMode::Slice;
    setup.plane = {0.0, 2.0, 0.0, 0.5};  // y = 1/4
    view = draw(pass, grid, setup);
    const Ray ray = setup.camera.rayThrough({20.5, 12.5}, kSize);
    const double there = 1.0 - glm::length(glm::dvec3(ray.origin.x, 0.25, ray.origin.z));
    EXPECT_NEAR(view.picture.pixel(20, 12)[0], there, 2e-3);
    EXPECT_NEAR(view.depth[12 * 48 + 20], 0.25 - setup.camera.position.y, 1e-5);
    setup.mode = VolumeMode::Maximum;
    view = draw(pass, grid, setup);
    const double most = 1.0 - std::hypot(ray.origin.x, ray.origin.z);
    EXPECT_NEAR(view.picture.pixel(20, 12)[0], most, 5e-3);
  });
}

TEST(VolumePass, CellsWithoutDataAreTransparent) {
  device().run([] {
    VolumePass pass;
    LookGrid grid = scalarGrid({32, 32, 32}, over(kBox),
                               [](glm::dvec3 at) { return at.x > 0.1 ? std::nan("") : 1.0; });
    const OpticsTable table([](double) { return glm::dvec4(9.0); }, 0.0, 2.0);
    VolumePass::findBricks(grid, table);
    VolumeSetup setup;
    setup.camera = cameraOf(kBox, {0.0, 1.0, 0.0}, Projection::Orthographic);
    setup.table = &table;
    const VolumeView view = draw(pass, grid, setup);
    EXPECT_GT(view.picture.pixel(16, 18)[3], 0.99f);
    EXPECT_EQ(view.picture.pixel(30, 18)[3], 0.0f);
  });
}

TEST(VolumePass, LightFallsOnTheSideThatFacesItAndGuessesAreCounted) {
  device().run([] {
    VolumePass pass;
    const Box box{{-1.0, -1.0, -1.0}, {1.0, 1.0, 1.0}};
    LookGrid grid = opticsGrid({48, 48, 48}, over(box), [](glm::dvec3 at) {
      return glm::length(at) < 0.7 ? glm::dvec4(60.0) : glm::dvec4(0.0);
    });
    grid.setGuess({4, 1, 1}, std::vector<std::uint8_t>{0, 0, 255, 255});
    VolumeSetup setup;
    setup.camera = cameraOf(box, {0.0, 1.0, 0.0}, Projection::Orthographic);
    Look look;
    look.shading = Shading::Phong;
    look.lights = {{90.0, 0.0, 1.0}};  // from the right
    const LightSetup light = lightSetup(look, setup.camera, setup.camera, box);
    setup.light = &light;
    EXPECT_THROW(draw(pass, grid, setup), Error);  // no gradients yet
    pass.findGradients(grid);
    const VolumeView view = draw(pass, grid, setup);
    EXPECT_NEAR(view.picture.pixel(18, 18)[0], 0.3, 0.05);  // ambient alone on the left
    EXPECT_GT(view.picture.pixel(29, 18)[0], 0.6);
    EXPECT_LT(view.guess[18 * 48 + 16], 0.01);
    EXPECT_GT(view.guess[18 * 48 + 31], 0.9);
  });
}

TEST(VolumePass, OcclusionIsNothingInTheOpenAndMoreInAGroove) {
  device().run([] {
    VolumePass pass;
    const Box box{{0.0, 0.0, 0.0}, {64.0, 64.0, 64.0}};
    // Opaque below z = 32, with a groove 8 wide and 16 deep along y.
    const LookGrid grid = opticsGrid({64, 64, 64}, over(box), [](glm::dvec3 at) {
      const bool groove = std::abs(at.x - 32.0) < 6.0 && at.z > 12.0;
      return glm::dvec4(at.z < 32.0 && !groove ? 2.0 : 0.0);
    });
    const OcclusionGrid open = pass.occlusion(grid, 16.0);
    VolumeSetup setup;
    setup.camera = cameraOf(box, {0.0, 0.0, -1.0}, Projection::Orthographic, {0, 1, 0});
    const VolumeView plain = draw(pass, grid, setup);
    setup.occlusion = &open;
    const VolumeView view = draw(pass, grid, setup);
    const auto openness = [&](int x) {
      return view.picture.pixel(x, 18)[0] / plain.picture.pixel(x, 18)[0];
    };
    EXPECT_GT(openness(14), 0.8);
    EXPECT_LT(openness(24), 0.6);
  });
}

TEST(VolumePass, SaysWhatDoesNotFitTheGrid) {
  device().run([] {
    VolumePass pass;
    const LookGrid optics = opticsGrid({4, 4, 4}, over(kBox), blobs);
    VolumeSetup setup;
    setup.camera = cameraOf(kBox, {0.0, 1.0, 0.0}, Projection::Orthographic);
    setup.mode = VolumeMode::Maximum;
    EXPECT_THROW(draw(pass, optics, setup), Error);
    setup.mode = VolumeMode::Compositing;
    const LookGrid values = scalarGrid({4, 4, 4}, over(kBox), [](glm::dvec3) { return 1.0; });
    EXPECT_THROW(draw(pass, values, setup), Error);
    EXPECT_THROW(LookGrid::scalar({4, 4, 5}, over(kBox), std::vector<float>(64)), Error);
    EXPECT_THROW(LookGrid::scalar({1 << 20, 1, 1}, over(kBox), std::vector<float>(1 << 20)), Error);
  });
}

}  // namespace
}  // namespace vestige
