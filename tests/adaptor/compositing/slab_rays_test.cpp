// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/compositing/slab_rays.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>
#include <string>

#include "proxy/base/error.h"
#include "proxy/format/layout/proxy_layout.h"

namespace vestige {
namespace {

constexpr int kIntervals = 6;

ProxyHeader headerOf(ImageSize size, int slabs) {
  ProxyHeader header;
  header.field = "f";
  header.view = "front";
  header.size = size;
  header.domain = {{0, 0, 0}, {1, 2, 1}};
  header.camera = frameBox(header.domain, {0, 1, 0}, {0, 0, 1}, size.aspect());
  header.camera.viewHeight = 1.0;
  header.partition = IntervalPartition::uniform(0.0, 1.0, kIntervals);
  const DepthRange range = depthRange(header.camera, header.domain);
  for (int s = 0; s <= slabs; ++s)
    header.slabDepths.push_back(std::lerp(range.low, range.high, s / double(slabs)));
  return header;
}

/// Rays that fill `chord` with random lengths.
SlabRays randomRays(std::size_t pixels, double chord, double depth, std::mt19937& random) {
  SlabRays rays;
  for (std::size_t i = 0; i < pixels; ++i) {
    SlabCell& cell = rays.cells.emplace_back();
    cell.begin = std::uint32_t(rays.lengths.size());
    cell.lowest = std::uint8_t(random() % 3);
    cell.highest = std::uint8_t(cell.lowest + random() % 5);
    cell.first = cell.last = 2;
    double sum = cell.noData = random() % 4 ? 0.0f : 0.3f;
    for (int rank = cell.lowest; rank <= cell.highest; ++rank) {
      rays.lengths.push_back(0.01f + float(random() % 100));
      sum += rays.lengths.back();
    }
    for (std::size_t k = cell.begin; k < rays.lengths.size(); ++k)
      rays.lengths[k] *= float(chord / sum);
    cell.noData *= float(chord / sum);
    cell.lowMoment = rays.lengths[cell.begin] * float(depth);
    cell.highMoment = rays.lengths.back() * float(depth);
  }
  return rays;
}

TEST(StackBuilder, RoundsToLevelsThatAddUpAndAreNearest) {
  std::mt19937 random(5);
  const ProxyHeader header = headerOf({6, 6}, 2);
  for (int levels : {16, 32, 64, 128}) {
    StackBuilder builder(header, levels);
    std::vector<SlabRays> slabs;
    for (int s = 0; s < 2; ++s) {
      slabs.push_back(randomRays(36, 1.0, header.slabDepths[std::size_t(s)] + 0.4, random));
      builder.add(slabs.back());
    }
    const SlicedStack stack = builder.take();
    for (std::size_t s = 0; s < 2; ++s)
      for (std::size_t i = 0; i < 36; ++i) {
        const StackCell& cell = stack.slabs[s].cells[i];
        const SlabCell& was = slabs[s].cells[i];
        const auto rounded = stack.slabs[s].levelsOf(cell);
        ASSERT_EQ(std::accumulate(rounded.begin(), rounded.end(), int(cell.noData)), levels);
        const auto lengths = slabs[s].lengthsOf(was);
        for (int rank = was.lowest; rank <= was.highest; ++rank) {
          const int at = rank - cell.lowest;
          const int level = at >= 0 && at < cell.count ? rounded[std::size_t(at)] : 0;
          ASSERT_LE(std::abs(level - lengths[std::size_t(rank - was.lowest)] * levels), 1.001f);
        }
        EXPECT_EQ(stack.faces[s][i], was.first);
        // The mean depth of the outermost ranks, 0.4 into a slab of 1, where the ray turns there.
        EXPECT_EQ(cell.low(), cell.lowest < was.first ? 4 : 0);
        EXPECT_EQ(cell.high(), cell.lowest + cell.count - 1 > was.first ? 4 : 0);
      }
  }
}

TEST(StackBuilder, WhatNoBlockCoversIsWithoutData) {
  const ProxyHeader header = headerOf({3, 3}, 1);
  SlabRays rays;
  rays.cells.resize(9);
  rays.cells[0].first = rays.cells[0].last = 2;
  rays.cells[0].lowest = rays.cells[0].highest = 2;
  rays.lengths = {0.5f};
  StackBuilder builder(header, 32);
  builder.add(rays);
  const SlicedStack stack = builder.take();
  EXPECT_EQ(stack.slabs[0].cells[0].noData, 24) << "a quarter of the ray's 2 is known";
  EXPECT_EQ(stack.slabs[0].levelsOf(stack.slabs[0].cells[0])[0], 8);
  EXPECT_EQ(stack.slabs[0].cells[4].noData, 32);
  EXPECT_EQ(stack.faces[0][4], kIntervals + 2) << "the rank of no data";
}

TEST(StackBuilder, NamesWhatMakesNoSense) {
  const auto complains = [](const auto& work, const char* what) {
    try {
      work();
      FAIL() << what;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::InvalidArgument);
      EXPECT_NE(std::string(e.what()).find(what), std::string::npos) << e.what();
    }
  };
  ProxyHeader header = headerOf({3, 3}, 1);
  complains([&] { StackBuilder(header, 40); }, "40 levels");
  complains([&] { StackBuilder(header, 32).add({}); }, "0 rays for 9 pixels");
  complains([&] { StackBuilder(header, 32).take(); }, "0 of 1 slabs");
  header.camera.projection = Projection::Perspective;
  complains([&] { StackBuilder(header, 32); }, "'front' is perspective");
  complains([&] { StackBuilder(headerOf({3, 3}, 65), 32); }, "65 slabs");
}

TEST(CompositeSlabs, AddsAndIsAssociative) {
  std::mt19937 random(9);
  const auto a = randomRays(50, 1.0, 1.2, random), b = randomRays(50, 0.5, 1.7, random),
             c = randomRays(50, 0.25, 1.9, random);
  SlabRays left = a, right = b;
  compositeSlabs(left, b);
  compositeSlabs(left, c);
  compositeSlabs(right, c);
  SlabRays other = a;
  compositeSlabs(other, right);
  for (std::size_t i = 0; i < 50; ++i) {
    const SlabCell &x = left.cells[i], &y = other.cells[i];
    EXPECT_EQ(x.lowest, y.lowest);
    EXPECT_EQ(x.highest, y.highest);
    EXPECT_EQ(x.first, a.cells[i].first);
    EXPECT_EQ(x.last, c.cells[i].last);
    EXPECT_NEAR(x.lowMoment, y.lowMoment, 1e-6);
    EXPECT_NEAR(x.highMoment, y.highMoment, 1e-6);
    const auto p = left.lengthsOf(x), q = other.lengthsOf(y);
    ASSERT_EQ(p.size(), q.size());
    float sum = x.noData;
    for (std::size_t k = 0; k < p.size(); ++k) {
      EXPECT_NEAR(p[k], q[k], 1e-6);
      sum += p[k];
    }
    EXPECT_NEAR(sum, 1.75f, 1e-5);
  }
}

}  // namespace
}  // namespace vestige
