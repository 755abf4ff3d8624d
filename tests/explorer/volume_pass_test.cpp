// SPDX-License-Identifier: BSD-3-Clause
//
// Ray casting of 3-D grids against media whose light is known in closed form, and invariances.
#include "explorer/volume_pass.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>

#include "proxy/error.h"
#include "proxy/gl/device.h"

namespace vestige {
namespace {

constexpr ImageSize kSize{48, 36};
const glm::dvec4 kMedium{0.2, 0.5, 0.1, 0.8};  // (σ·c, σ)

gl::Device& device() {
  static const std::shared_ptr<gl::Device> device = gl::Device::create();
  return *device;
}

using Field = std::function<double(glm::dvec3 world)>;
using Medium = std::function<glm::dvec4(glm::dvec3 world)>;

/// A grid over a box.
glm::dmat4 over(const Box& box) {
  return glm::scale(glm::translate(glm::dmat4(1.0), box.low), box.size());
}

/// Calls with the index and the centre in world space of each cell.
template <typename Cell>
void forEachCell(glm::ivec3 size, const glm::dmat4& worldFromGrid, const Cell& cell) {
  std::size_t index = 0;
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x) {
        const glm::dvec3 grid = (glm::dvec3(x, y, z) + 0.5) / glm::dvec3(size);
        cell(index++, glm::dvec3(worldFromGrid * glm::dvec4(grid, 1.0)));
      }
    }
  }
}

LookGrid opticsGrid(glm::ivec3 size, const glm::dmat4& worldFromGrid, const Medium& medium,
                    OpticsFormat format = OpticsFormat::Half) {
  std::vector<float> rgba(4 * std::size_t(size.x * size.y * size.z));
  forEachCell(size, worldFromGrid, [&](std::size_t i, glm::dvec3 at) {
    for (std::size_t c = 0; c < 4; ++c) rgba[4 * i + c] = float(medium(at)[int(c)]);
  });
  return LookGrid::optics(size, worldFromGrid, rgba, format);
}

LookGrid scalarGrid(glm::ivec3 size, const glm::dmat4& worldFromGrid, const Field& field) {
  std::vector<float> values(std::size_t(size.x * size.y * size.z));
  forEachCell(size, worldFromGrid,
              [&](std::size_t i, glm::dvec3 at) { values[i] = float(field(at)); });
  return LookGrid::scalar(size, worldFromGrid, values);
}

Camera cameraOf(const Box& box, glm::dvec3 forward, Projection projection,
                glm::dvec3 up = {0, 0, 1}) {
  return frameBox(box, forward, up, kSize.aspect(), projection, 0.6);
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

/// Casts every ray: probes have a test of their own.
VolumeView draw(VolumePass& pass, const LookGrid& grid, VolumeSetup setup) {
  setup.size = kSize;
  setup.tolerance = 0.0;
  return pass.render(grid, setup);
}

double difference(const Picture& a, const Picture& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    most = std::max(most, double(std::abs(a.rgba[i] - b.rgba[i])));
  }
  return most;
}

const Box kBox{{-1.0, -0.7, 2.0}, {1.2, 0.9, 3.0}};

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
      const LightSetup light = lightSetup(look, setup.camera, setup.camera, kBox.diagonal());
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

/// A unit cube of n^3 cells, and a camera along z whose pixels stand on the cells' centres.
struct OnCells {
  static constexpr int kCells = 16;
  const Box box{glm::dvec3(0.0), glm::dvec3(1.0)};
  std::vector<float> values = std::vector<float>(kCells * kCells * kCells);
  Camera camera = frameBox(box, {0, 0, 1}, {0, 1, 0}, 1.0);

  OnCells() { camera.viewHeight = 1.0; }
  float& at(int x, int y, int z) { return values[std::size_t(x + kCells * (y + kCells * z))]; }
  /// The cells under a pixel, by their depth.
  float& under(int px, int py, int depth) {
    const Ray ray = camera.rayThrough({px + 0.5, py + 0.5}, {kCells, kCells});
    return at(int(ray.origin.x * kCells), int(ray.origin.y * kCells), depth);
  }
  /// Half of all cells without data at random; or a sea that grows shallower toward a coast.
  void fill(bool sieve) {
    unsigned random = 7;
    for (int z = 0; z < kCells; ++z)
      for (int y = 0; y < kCells; ++y)
        for (int x = 0; x < kCells; ++x) {
          random = random * 1664525u + 1013904223u;
          const bool has = sieve ? (random >> 16) % 2 : z < x - 1 + y % 3;
          at(x, y, z) = has ? 0.2f + 0.04f * float(x) + 0.01f * float(z) : std::nanf("");
        }
  }
};

TEST(VolumePass, CellsWithDataStayAsTheyAreBesideCellsWithout) {
  device().run([] {
    VolumePass pass;
    const ImageSize size{OnCells::kCells, OnCells::kCells};
    const OpticsTable colors([](double v) { return glm::dvec4(v, 0.0, 0.0, 1.0); }, 0.0, 2.0);
    const OpticsTable even([](double) { return glm::dvec4(3.0); }, 0.0, 2.0);
    for (const bool sieve : {true, false}) {
      OnCells cells;
      cells.fill(sieve);
      LookGrid grid = LookGrid::scalar(glm::ivec3(OnCells::kCells), over(cells.box), cells.values);
      VolumeSetup setup;
      setup.camera = cells.camera;
      setup.size = size;
      setup.table = &colors;
      setup.mode = VolumeMode::Slice;
      for (const int z : {0, 5, OnCells::kCells - 1}) {
        setup.plane = {0.0, 0.0, 1.0, (z + 0.5) / OnCells::kCells};
        const VolumeView slice = pass.render(grid, setup);
        for (int y = 0; y < size.height; ++y) {
          for (int x = 0; x < size.width; ++x) {
            const float own = cells.under(x, y, z);
            ASSERT_EQ(slice.picture.pixel(x, y)[3], std::isnan(own) ? 0.0f : 1.0f);
            if (!std::isnan(own)) {
              ASSERT_NEAR(slice.picture.pixel(x, y)[0], own, 1e-3);
            }
          }
        }
      }
      // Every cell with data has its own length on the ray, whatever is beside it; faces between
      // cells lie half a step between two samples, or on one.
      VolumePass::findBricks(grid, even);
      setup.table = &even;
      setup.mode = VolumeMode::Compositing;
      setup.opaque = 0.0;
      for (const double step : {0.25, 0.5}) {
        setup.step = step;
        const VolumeView volume = pass.render(grid, setup);
        for (int y = 0; y < size.height; ++y) {
          for (int x = 0; x < size.width; ++x) {
            int known = 0;
            for (int z = 0; z < OnCells::kCells; ++z) known += !std::isnan(cells.under(x, y, z));
            const double depth = -std::log1p(-double(volume.picture.pixel(x, y)[3])) / 3.0;
            ASSERT_NEAR(depth * OnCells::kCells, known, 0.5 * step + 0.01)
                << x << ' ' << y << ' ' << step;
          }
        }
      }
    }
  });
}

TEST(VolumePass, LightBesideCellsWithoutDataIsThatOfTheField) {
  device().run([] {
    VolumePass pass;
    // A plane across x + y, and holes in it: its normal is the same everywhere.
    LookGrid grid = scalarGrid({24, 24, 24}, over(kBox), [](glm::dvec3 at) {
      const bool hole = std::sin(13.0 * at.x) + std::sin(17.0 * at.z) > 0.9;
      return hole ? std::nan("") : at.x + at.y;
    });
    const OpticsTable table([](double v) { return glm::dvec4(v > 0.0 ? 1000.0 : 0.0); }, -3, 3);
    VolumeSetup setup;
    setup.camera = cameraOf(kBox, {1.0, 1.0, 0.0}, Projection::Orthographic);
    setup.table = &table;
    Look look;
    look.shading = Shading::Phong;
    look.lights = {{30.0, 0.0, 1.0}};
    const LightSetup light = lightSetup(look, setup.camera, setup.camera, kBox.diagonal());
    setup.light = &light;
    for (const VolumeMode mode : {VolumeMode::Compositing, VolumeMode::Isosurface}) {
      setup.mode = mode;
      setup.isosurfaces = {{0.0, glm::dvec3(1.0), 1.0}};
      if (mode == VolumeMode::Isosurface)
        VolumePass::findBricks(grid, setup.isosurfaces);
      else
        VolumePass::findBricks(grid, table);
      if (!grid.gradient) pass.findGradients(grid);
      const VolumeView view = draw(pass, grid, setup);
      const double facing = std::cos(30.0 * 3.14159265358979 / 180.0);
      const double half = std::cos(15.0 * 3.14159265358979 / 180.0);
      const double lit = 0.3 + 0.7 * facing + 0.25 * std::pow(half, 32.0);
      int seen = 0, wrong = 0;
      for (int y = 8; y < 28; ++y) {
        for (int x = 12; x < 36; ++x) {
          const float* pixel = view.picture.pixel(x, y);
          if (pixel[3] < 0.999f) continue;
          ++seen;
          // Where a ray enters the body beside a hole it may meet a cell alone among others.
          wrong += std::abs(double(pixel[0]) - lit) > 0.02;
        }
      }
      EXPECT_GT(seen, 100);
      EXPECT_LT(wrong, seen / 5) << int(mode);
    }
  });
}

/// Nodes that lie close together at one end of z: 10 m apart at the surface of a sea of 5 km.
std::vector<double> sea() {
  std::vector<double> depths{0.0};
  while (depths.size() < 12) depths.push_back(depths.back() + 10.0);
  while (depths.size() < 24)
    depths.push_back(depths.back() + 10.0 + 37.0 * (double(depths.size()) - 11.0));
  return depths;
}

/// A field of x and y even, and z at the depths of the sea: what it is between them is linear.
LookGrid seaGrid(const std::function<double(int)>& value, glm::dmat4& worldFromGrid) {
  const std::vector<double> depths = sea();
  const int n = int(depths.size());
  const double first = -5.0, last = depths.back() + 0.5 * (depths[23] - depths[22]);
  worldFromGrid = over({{0.0, 0.0, first}, {1000.0, 1000.0, last}});
  std::vector<double> places;
  for (const double depth : depths) places.push_back((depth - first) / (last - first) * n);
  std::vector<float> values;
  for (int z = 0; z < n; ++z) values.insert(values.end(), 16, float(value(z)));
  LookGrid grid = LookGrid::scalar({4, 4, n}, worldFromGrid, values, GridAxes({{{}, {}, places}}));
  grid.low.z = (depths.front() - first) / (last - first);
  grid.high.z = (depths.back() - first) / (last - first);
  return grid;
}

TEST(VolumePass, UnevenAxesAreSampledWhereTheirNodesAre) {
  device().run([] {
    VolumePass pass;
    const std::vector<double> depths = sea();
    const auto value = [](int z) {
      return z < 4 ? 1.0 : z < 9 ? 1.0 - 0.15 * (z - 3) : 0.04 * (z % 3);
    };
    glm::dmat4 place;
    LookGrid grid = seaGrid(value, place);
    const OpticsTable colors([](double v) { return glm::dvec4(v, 0.0, 0.0, 1.0); }, 0.0, 1.0);
    const Box box{{0.0, 0.0, depths.front()}, {1000.0, 1000.0, depths.back()}};
    VolumeSetup setup;
    setup.camera = cameraOf(box, {0.0, 0.0, 1.0}, Projection::Orthographic, {0, 1, 0});
    setup.table = &colors;
    setup.mode = VolumeMode::Slice;
    for (int i = 0; i + 1 < int(depths.size()); ++i) {
      for (const double share : {0.0, 0.3, 0.75}) {
        const double depth = std::lerp(depths[std::size_t(i)], depths[std::size_t(i) + 1], share);
        setup.plane = {0.0, 0.0, 1.0, depth + 1e-3};
        const double truth = std::lerp(value(i), value(i + 1), share);
        EXPECT_NEAR(draw(pass, grid, setup).picture.pixel(24, 18)[0], truth, 1e-3)
            << i << ' ' << share;
      }
    }
    // Along the axis, across it and askew: the same depth of medium, brick by brick or not.
    const OpticsTable optics([](double v) { return glm::dvec4(v > 0.5 ? 0.01 * v : 0.0); }, 0.0,
                             1.0);
    VolumePass::findBricks(grid, optics);
    setup.mode = VolumeMode::Compositing;
    setup.table = &optics;
    setup.opaque = 0.0;
    double whole = 0.0;
    for (int i = 0; i + 1 < int(depths.size()); ++i) {
      for (int k = 0; k < 1000; ++k) {
        const double v = std::lerp(value(i), value(i + 1), (k + 0.5) / 1000.0);
        whole += v > 0.5 ? 0.01 * v * (depths[std::size_t(i) + 1] - depths[std::size_t(i)]) / 1000.0
                         : 0.0;
      }
    }
    for (const bool skip : {false, true}) {
      setup.skip = skip;
      setup.step = 0.5;
      EXPECT_NEAR(draw(pass, grid, setup).picture.pixel(24, 18)[3], 1.0 - std::exp(-whole), 2e-3);
    }
    setup.skip = true;
    setup.mode = VolumeMode::Isosurface;
    setup.isosurfaces = {{0.475, glm::dvec3(1.0), 1.0}};
    VolumePass::findBricks(grid, setup.isosurfaces);
    EXPECT_NEAR(draw(pass, grid, setup).depth[18 * 48 + 24] + setup.camera.position.z, 65.0, 0.05);
  });
}

TEST(VolumePass, GradientsOnUnevenAxesAreThoseOfTheWorld) {
  device().run([] {
    VolumePass pass;
    const std::vector<double> depths = sea();
    glm::dmat4 place;
    LookGrid grid = seaGrid([&](int z) { return depths[std::size_t(z)] / depths.back(); }, place);
    pass.findGradients(grid);
    // A linear field has one gradient: in cells of equal width as well.
    const gl::Functions& gl = gl::functions();
    gl::Framebuffer framebuffer;
    for (int z = 0; z < grid.size.z; ++z) {
      const gpu::Attachment attachment{&*grid.gradient, z};
      gpu::bindTarget(framebuffer, {&attachment, 1}, {4, 4});
      const std::vector<float> texels = gpu::readFloats({4, 4});
      const double truth = 1.0 / depths.back() * glm::length(glm::dvec3(place[2])) / grid.size.z;
      EXPECT_NEAR(texels[2], truth, 1e-3 * truth) << z;
      EXPECT_NEAR(texels[3], truth, 1e-3 * truth) << z;
    }
    gl.Flush();
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
    const LightSetup light = lightSetup(look, setup.camera, setup.camera, box.diagonal());
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

/// Blinn-Phong light on a point of the unit ball seen along +y, lit from (0, 0): the viewer.
double headlit(double x, double z) {
  const double facing = std::sqrt(std::max(0.0, 1.0 - x * x - z * z));
  return 0.3 + 0.7 * facing + 0.25 * std::pow(facing, 32.0);
}

TEST(VolumePass, LitSurfacesHaveNoStripes) {
  device().run([] {
    VolumePass pass;
    const Box box{{-1.3, -1.3, -1.3}, {1.3, 1.3, 1.3}};
    LookGrid grid = scalarGrid({96, 96, 96}, over(box), [](glm::dvec3 at) {
      return 1.0 / (1.0 + std::exp((glm::length(at) - 1.0) / 0.06));
    });
    const OpticsTable table([](double v) { return glm::dvec4(v > 0.5 ? 2000.0 : 0.0); }, 0.0, 1.0);
    VolumePass::findBricks(grid, table);
    pass.findGradients(grid);
    VolumeSetup setup;
    setup.table = &table;
    setup.step = 1.0;
    setup.size = {160, 160};
    Look look;
    look.shading = Shading::Phong;
    look.lights = {{0.0, 0.0, 1.0}};
    for (const glm::dvec3 forward : {glm::dvec3(0, 1, 0), {-0.4, 1.0, 0.3}}) {
      setup.camera = frameBox(Box{glm::dvec3(-1.0), glm::dvec3(1.0)}, forward, {0, 0, 1}, 1.0);
      const LightSetup light = lightSetup(look, setup.camera, setup.camera, box.diagonal());
      setup.light = &light;
      const VolumeView view = pass.render(grid, setup);
      double squares = 0.0;
      int count = 0;
      for (int y = 0; y < 160; ++y) {
        for (int x = 0; x < 160; ++x) {
          const double pitch = setup.camera.viewHeight / 160.0;
          const double px = (x - 79.5) * pitch, pz = (79.5 - y) * pitch;
          if (std::hypot(px, pz) > 0.8) continue;
          const double off = double(view.picture.pixel(x, y)[0]) - headlit(px, pz);
          EXPECT_NEAR(off, 0.0, 0.01) << x << ' ' << y;
          squares += off * off;
          ++count;
        }
      }
      EXPECT_LT(std::sqrt(squares / count), 0.0025);
    }
  });
}

TEST(VolumePass, LightOnGentleSlopesHasNoStripes) {
  device().run([] {
    VolumePass pass;
    // A ball so large that its normal turns by 1/400 from cell to cell.
    LookGrid grid = scalarGrid(
        {96, 96, 96}, over({glm::dvec3(-1.3), glm::dvec3(1.3)}),
        [](glm::dvec3 at) { return 10.0 - glm::length(at - glm::dvec3(0.4, 10.0, 0.7)); });
    const OpticsTable table([](double v) { return glm::dvec4(v > 0.0 ? 2000.0 : 0.0); }, -2.0, 2.0);
    VolumePass::findBricks(grid, table);
    pass.findGradients(grid);
    VolumeSetup setup;
    setup.table = &table;
    setup.step = 1.0;
    setup.size = {160, 160};
    Look look;
    look.shading = Shading::Phong;
    look.lights = {{20.0, 20.0, 1.0}};
    for (const glm::dvec3 forward : {glm::dvec3(0, 1, 0), {-0.4, 1.0, 0.3}}) {
      setup.camera = frameBox(Box{glm::dvec3(-1.0), glm::dvec3(1.0)}, forward, {0, 0, 1}, 1.0);
      const LightSetup light = lightSetup(look, setup.camera, setup.camera, 1.0);
      setup.light = &light;
      const VolumeView view = pass.render(grid, setup);
      const auto lit = [&](int x, int y) { return double(view.picture.pixel(x, y)[0]); };
      // Stripes bend the picture from pixel to pixel; the ball itself hardly does.
      double bends = 0.0;
      for (int x = 60; x < 100; ++x) {
        for (int y = 60; y < 100; ++y) {
          ASSERT_GT(lit(x, y), 0.5);
          const double bend =
              lit(x - 1, y) + lit(x + 1, y) + lit(x, y - 1) + lit(x, y + 1) - 4.0 * lit(x, y);
          bends += bend * bend;
        }
      }
      EXPECT_LT(std::sqrt(bends / 1600.0), 5e-4);
    }
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
