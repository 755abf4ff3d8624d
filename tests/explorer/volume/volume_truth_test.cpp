// SPDX-License-Identifier: BSD-3-Clause
//
// What the caster makes of samples: beside those without data, on uneven axes, and under light.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "volume_fixture.h"

namespace vestige {
namespace {

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

TEST(VolumeTruth, CellsWithDataStayAsTheyAreBesideCellsWithout) {
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

TEST(VolumeTruth, LightBesideCellsWithoutDataIsThatOfTheField) {
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
    const LightSetup light = lightSetup(look, setup.camera, setup.camera, kBox);
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

TEST(VolumeTruth, UnevenAxesAreSampledWhereTheirNodesAre) {
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

TEST(VolumeTruth, GradientsOnUnevenAxesAreThoseOfTheWorld) {
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

/// Blinn-Phong light on a point of the unit ball seen along +y, lit from (0, 0): the viewer.
double headlit(double x, double z) {
  const double facing = std::sqrt(std::max(0.0, 1.0 - x * x - z * z));
  return 0.3 + 0.7 * facing + 0.25 * std::pow(facing, 32.0);
}

TEST(VolumeTruth, LitSurfacesHaveNoStripes) {
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
      const LightSetup light = lightSetup(look, setup.camera, setup.camera, box);
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

TEST(VolumeTruth, LightOnGentleSlopesHasNoStripes) {
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
      const LightSetup light =
          lightSetup(look, setup.camera, setup.camera, Box{glm::dvec3(-1.0), glm::dvec3(1.0)});
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

}  // namespace
}  // namespace vestige
