// SPDX-License-Identifier: BSD-3-Clause
//
// Sliced stacks through a session.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "proxy/archive/archive.h"
#include "simulation.h"

namespace vestige::test {
namespace {

std::string sliced(const std::string& keys, const std::string& proxies = "'sliced'") {
  return std::string(kSmallImage) + "proxies = [" + proxies + "]\n[sliced]\n" + keys;
}

SlicedStack stackOf(const Archive& archive, const std::string& view) {
  const ArchiveRow* row = archive.find(1, view, "f", kind::kSliced);
  if (row == nullptr) throw std::runtime_error("no stack of " + view);
  return readStack(archive.open(*row));
}

TEST(SlicedSession, StoresThreeStacksWithAsManyPixelsAsSamples) {
  const Folder folder;
  {
    Simulation run(folder / "a.cdb", sliced("slabs = 5", "'sliced', 'reference'"));
    ASSERT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
  }
  EXPECT_EQ(damageOf(folder / "a.cdb"), "");
  const Archive archive(folder / "a.cdb");
  const auto views = archive.views();
  EXPECT_EQ(std::set<std::string>(views.begin(), views.end()),
            (std::set<std::string>{"front", "stack-front", "stack-left", "stack-top"}));
  // The unit cube has 24 x 20 x 16 points: a pixel each, of their shape.
  for (const auto& [view, size] : {std::pair{"stack-front", ImageSize{24, 16}},
                                   {"stack-left", {20, 16}},
                                   {"stack-top", {24, 20}}}) {
    const SlicedStack stack = stackOf(archive, view);
    EXPECT_EQ(stack.header.size, size) << view;
    EXPECT_NEAR(stack.header.camera.pixelAspect, (size.height - 1.0) / (size.width - 1.0), 1e-12);
    EXPECT_EQ(stack.slabs.size(), 5u);
    EXPECT_EQ(stack.levels, 32);
    // The outermost pixels stand on the faces.
    const glm::dvec3 corner = stack.header.camera.unproject({0.5, 0.5, 0.0}, size);
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(stack.header.camera.forward[axis]) > 0.5) continue;
      EXPECT_NEAR(std::abs(corner[axis] - 0.5), 0.5, 1e-4);
    }
    std::size_t hits = 0;
    for (const StackSlab& slab : stack.slabs)
      for (const StackCell& cell : slab.cells) hits += cell.count > 0;
    EXPECT_EQ(hits, 5 * size.pixels()) << "every ray lies inside";
    EXPECT_NE(archive.find(1, view, "f", kind::kReference), nullptr) << "to judge the stack by";
  }
}

TEST(SlicedSession, CutsTheRunsOwnViewsIfAsked) {
  const Folder folder;
  {
    Simulation run(folder / "a.cdb",
                   sliced("stacks = 'views'\nslabs = 3\nlevels = 64\n[[view]]\nset = 'right'\n"));
    ASSERT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
  }
  const Archive archive(folder / "a.cdb");
  EXPECT_EQ(archive.views(), std::vector<std::string>{"right"});
  const SlicedStack stack = stackOf(archive, "right");
  EXPECT_EQ(stack.header.size, (ImageSize{48, 40}));
  EXPECT_EQ(stack.levels, 64);
}

TEST(SlicedSession, FewerPixelsThanSamplesShowTheWholeDomain) {
  const Folder folder;
  {
    Simulation run(folder / "a.cdb", sliced("stacks = 'front'\npixels = 7\nslabs = 2\n"));
    ASSERT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
  }
  const SlicedStack stack = stackOf(Archive(folder / "a.cdb"), "stack-front");
  EXPECT_EQ(stack.header.size, (ImageSize{7, 7}));
  EXPECT_NEAR(stack.header.camera.viewHeight, 7.0 / 6.0, 1e-4) << "the outermost on the faces";
}

TEST(SlicedSession, BlocksGiveTheStackOfTheWhole) {
  const Folder folder;
  const Sample sample;
  // The same points in two blocks that meet inside a slab, with a ghost layer.
  const std::string config = sliced("stacks = 'front'\nslabs = 3\n") + "[[field]]\nsource = 'f'\n";
  {
    Simulation run(folder / "whole.cdb", config);
    ASSERT_EQ(run.step(sample, 1), VESTIGE_OK) << run.error();
  }
  {
    Simulation run(folder / "blocks.cdb", config);
    const int middle = 9;  // of 20 points along y
    for (int half = 0; half < 2; ++half) {
      vestige_grid grid = sample.grid;
      const int first = half == 0 ? 0 : middle - 1, last = half == 0 ? middle + 1 : 19;
      grid.first[1] = first;
      grid.points[1] = last - first + 1;
      grid.ghosts[half == 0 ? 3 : 2] = 1;
      ASSERT_EQ(vestige_block(run.session, half, &grid), VESTIGE_OK) << run.error();
      const std::array<std::ptrdiff_t, 4> strides{sizeof(float), 24 * sizeof(float),
                                                  24 * 20 * sizeof(float), sizeof(float)};
      ASSERT_EQ(vestige_share_field(run.session, half, "f", VESTIGE_FLOAT32, VESTIGE_POINT, 1,
                                    sample.values.data() + 24 * first, strides.data()),
                VESTIGE_OK)
          << run.error();
    }
    ASSERT_EQ(vestige_execute(run.session, 1, 0.0), VESTIGE_OK) << run.error();
  }
  const SlicedStack whole = stackOf(Archive(folder / "whole.cdb"), "stack-front");
  const SlicedStack blocks = stackOf(Archive(folder / "blocks.cdb"), "stack-front");
  EXPECT_EQ(whole.faces, blocks.faces);
  for (std::size_t s = 0; s < 3; ++s)
    for (std::size_t i = 0; i < whole.header.size.pixels(); ++i) {
      const StackCell &a = whole.slabs[s].cells[i], &b = blocks.slabs[s].cells[i];
      const auto p = whole.slabs[s].levelsOf(a), q = blocks.slabs[s].levelsOf(b);
      ASSERT_EQ(a.lowest, b.lowest);
      ASSERT_EQ(p.size(), q.size());
      for (std::size_t k = 0; k < p.size(); ++k) ASSERT_LE(std::abs(p[k] - q[k]), 1);
      ASSERT_LE(std::abs(a.low() - b.low()), 1);
      ASSERT_LE(std::abs(a.high() - b.high()), 1);
    }
}

TEST(SlicedSession, CellsThatRiseAlongTheRayHaveTheirExactLengths) {
  // 16 cells a side, of value (i + 1/2) / 16 along y: half a cell at each face holds its end value.
  const Folder folder;
  {
    Simulation run(folder / "a.cdb",
                   sliced("stacks = 'front'\nslabs = 4\nlevels = 128\n") +
                       "[[field]]\nsource = 'f'\nrange = [0, 1]\nintervals = 4\n");
    vestige_grid grid = VESTIGE_GRID_INIT;
    for (int a = 0; a < 3; ++a) {
      grid.points[a] = 17;
      grid.spacing[a] = 1.0 / 16.0;
    }
    std::vector<float> values;
    for (int i = 0; i < 16 * 16 * 16; ++i) values.push_back((float(i / 16 % 16) + 0.5f) / 16.0f);
    ASSERT_EQ(vestige_block(run.session, 0, &grid), VESTIGE_OK);
    ASSERT_EQ(vestige_share_field(run.session, 0, "f", VESTIGE_FLOAT32, VESTIGE_CELL, 1,
                                  values.data(), nullptr),
              VESTIGE_OK);
    ASSERT_EQ(vestige_execute(run.session, 1, 0.0), VESTIGE_OK) << run.error();
  }
  const SlicedStack stack = stackOf(Archive(folder / "a.cdb"), "stack-front");
  EXPECT_EQ(stack.header.size, (ImageSize{16, 16}));
  for (std::size_t s = 0; s < 4; ++s)
    for (const StackCell& cell : stack.slabs[s].cells) {
      ASSERT_EQ(cell.count, 1) << "slab " << s << " is interval " << s;
      ASSERT_EQ(cell.lowest, s + 1);
      ASSERT_EQ(stack.slabs[s].levelsOf(cell)[0], 128);
    }
}

TEST(SlicedSession, EqualInputsGiveEqualBytes) {
  const Folder folder;
  for (const char* name : {"a.cdb", "b.cdb"}) {
    Simulation run(folder / name, sliced("slabs = 4\n"));
    ASSERT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
  }
  EXPECT_EQ(filesOf(folder / "a.cdb"), filesOf(folder / "b.cdb"));
}

}  // namespace
}  // namespace vestige::test
