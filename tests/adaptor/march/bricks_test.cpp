// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "adaptor/march/tile_plan.h"
#include "adaptor/volume/brick_grid.h"
#include "adaptor/volume/march_setup.h"

namespace vestige {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr int kCells = BrickGrid::kCells;

struct Samples {
  std::array<int, 3> size;
  std::vector<float> values;
  Samples(std::array<int, 3> size_, float value)
      : size(size_), values(std::size_t(size[0] * size[1] * size[2]), value) {}
  float& at(int x, int y, int z) { return values[std::size_t((z * size[1] + y) * size[0] + x)]; }
};

BrickGrid bricksOf(const Samples& samples, int slab, int threads) {
  BrickGrid bricks(samples.size);
  const auto layer = std::size_t(samples.size[0] * samples.size[1]);
  for (int z = 0; z < samples.size[2]; z += slab) {
    bricks.add(z, std::min(samples.size[2], z + slab),
               samples.values.data() + std::size_t(z) * layer, threads);
  }
  return bricks;
}

/// Intervals [0, 0.5), [0.5, 1].
std::vector<glm::vec4> texels(const BrickGrid& bricks) {
  const auto partition = IntervalPartition::uniform(0.0, 1.0, 2);
  return bricks.texels(channelEdges(partition, nullptr), nullptr);
}

Samples noise(std::array<int, 3> size) {
  Samples samples(size, 0.0f);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> value(-0.2f, 1.2f);
  for (float& v : samples.values) v = value(random);
  return samples;
}

TEST(BrickGrid, HoldsTheRangeOfItsSamplesAndFaces) {
  Samples samples = noise({2 * kCells + 3, kCells + 1, 3 * kCells});
  const auto bricks = bricksOf(samples, samples.size[2], 1);
  ASSERT_EQ(bricks.size(), (std::array<int, 3>{3, 1, 3}));
  const auto found = texels(bricks);
  std::size_t i = 0;
  for (int z = 0; z < 3; ++z) {
    for (int x = 0; x < 3; ++x, ++i) {
      float low = kInfinity, high = -kInfinity;
      for (int k = z * kCells; k <= std::min((z + 1) * kCells, samples.size[2] - 1); ++k) {
        for (int j = 0; j < samples.size[1]; ++j) {
          for (int n = x * kCells; n <= std::min((x + 1) * kCells, samples.size[0] - 1); ++n) {
            low = std::min(low, samples.at(n, j, k));
            high = std::max(high, samples.at(n, j, k));
          }
        }
      }
      EXPECT_EQ(found[i].y, low) << i;
      EXPECT_EQ(found[i].z, high) << i;
    }
  }
}

TEST(BrickGrid, SlabsAndThreadsMakeNoDifference) {
  Samples samples = noise({40, 21, 37});
  samples.at(3, 20, 8) = kNaN;
  const auto whole = texels(bricksOf(samples, 37, 1));
  for (int slab : {1, 5, 8, 9, 16}) {
    EXPECT_EQ(texels(bricksOf(samples, slab, 3)), whole) << slab;
  }
}

TEST(BrickGrid, NamesTheOneChannelOfABrick) {
  Samples samples({kCells + 1, kCells + 1, 2 * kCells + 1}, 0.25f);
  EXPECT_EQ(texels(bricksOf(samples, 99, 1))[0].x, 1.0f);
  samples.at(4, 4, 4) = 0.5f;  // belongs to the next interval
  auto found = texels(bricksOf(samples, 99, 1));
  EXPECT_LT(found[0].x, 0.0f);
  EXPECT_EQ(found[1].x, 1.0f);
  samples.at(4, 4, kCells) = -0.1f;  // on the face of both
  found = texels(bricksOf(samples, 99, 1));
  EXPECT_LT(found[1].x, 0.0f);
}

TEST(BrickGrid, KeepsItsDistanceFromNoData) {
  Samples samples({4 * kCells + 1, 2, 2}, 0.25f);
  samples.at(kCells - 1, 0, 0) = kNaN;
  const auto some = bricksOf(samples, 99, 1);
  EXPECT_TRUE(some.hasGaps());
  auto found = texels(some);
  EXPECT_LT(found[0].x, 0.0f);
  EXPECT_LT(found[1].x, 0.0f) << "beside a brick with a gap";
  EXPECT_EQ(found[2].x, 1.0f);
  for (int x = 0; x <= kCells; ++x) {
    for (int i = 0; i < 4; ++i) samples.at(x, i & 1, i >> 1) = -kInfinity;
  }
  found = texels(bricksOf(samples, 99, 1));
  EXPECT_EQ(found[0].x, 4.0f) << "no data throughout is a channel";
  EXPECT_LT(found[1].x, 0.0f);
}

TEST(BrickGrid, TransparencyIsOfTheWholeRange) {
  const auto partition = IntervalPartition::uniform(0.0, 1.0, 1);
  const TransferFunction spike({{0.4, 0.0}, {0.5, 0.9}, {0.6, 0.0}}, 1.0, Colormap::named("grey"),
                               0.0, 1.0);
  const PreintegratedTable base(spike, partition, 1.0);
  const auto edges = channelEdges(partition, &base);
  Samples samples({kCells + 1, 2, 2}, 0.1f);
  EXPECT_EQ(bricksOf(samples, 9, 1).texels(edges, &base)[0].x, 1.0f);
  EXPECT_LT(bricksOf(Samples({9, 2, 2}, 0.45f), 9, 1).texels(edges, &base)[0].x, 0.0f)
      << "constant, and not transparent";
  samples.at(3, 1, 1) = 0.9f;  // both ends are transparent, the middle is not
  EXPECT_LT(bricksOf(samples, 9, 1).texels(edges, &base)[0].x, 0.0f);
}

/// A block of [0, 1]^3 that is 0.25 but for a ball of higher values.
struct Ball {
  BlockGrid grid;
  Samples samples{{65, 65, 65}, 0.25f};
  glm::dvec3 centre{0.3, 0.6, 0.55};
  double radius = 0.17;
  Ball() {
    grid.owned = {{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}};
    for (auto& nodes : grid.nodes) {
      for (int i = 0; i < 65; ++i) nodes.push_back(i / 64.0);
    }
    for (int z = 0; z < 65; ++z) {
      for (int y = 0; y < 65; ++y) {
        for (int x = 0; x < 65; ++x) {
          const glm::dvec3 p{x / 64.0, y / 64.0, z / 64.0};
          if (glm::length(p - centre) < radius) samples.at(x, y, z) = 0.9f;
        }
      }
    }
  }
  MarchRequest request(Projection projection, ImageSize size) const {
    return {
        .camera =
            frameBox(grid.owned, {0.5, 1.0, -0.4}, {0.0, 0.0, 1.0}, size.aspect(), projection, 0.8),
        .size = size,
        .partition = IntervalPartition::uniform(0.0, 1.0, 2),
        .base = TransferFunction({{0.3, 0.0}, {1.0, 0.5}}, 0.1, Colormap::named("grey"), 0.0, 1.0),
        .domain = grid.owned,
        .mip = true};
  }
};

TilePlan planOf(const Ball& ball, const MarchRequest& request) {
  const auto bricks = bricksOf(ball.samples, 65, 1);
  const MarchFrame frame(request.domain, request.camera);
  const PreintegratedTable base(request.base, request.partition, frame.scale);
  const auto found = bricks.texels(channelEdges(request.partition, &base), &base);
  return TilePlan(bricks, found, ball.grid, frame, request);
}

TEST(TilePlan, MarchesEveryRayThatMeetsMoreThanBackground) {
  const Ball ball;
  for (const auto projection :
       {Projection::Orthographic, Projection::Perspective, Projection::MultiPerspective}) {
    const auto request = ball.request(projection, {200, 150});
    const TilePlan plan = planOf(ball, request);
    ASSERT_TRUE(plan.background);
    EXPECT_EQ(plan.background->channel, 1);
    EXPECT_EQ(plan.background->high, 0.25f);
    const std::size_t columns = 25, rows = 19;
    EXPECT_EQ(plan.marched.size() + plan.empty.size(), columns * rows);
    // A ball around the pole is seen on all sides.
    EXPECT_LT(plan.marched.size(),
              columns * rows * (projection == Projection::MultiPerspective ? 6 : 3) / 9);
    std::vector<const glm::vec4*> tileOf(columns * rows, nullptr);
    for (const auto& tile : plan.marched) {
      tileOf[std::size_t(tile.y) * columns + std::size_t(tile.x)] = &tile;
    }
    const MarchFrame frame(request.domain, request.camera);
    std::size_t met = 0;
    for (int y = 0; y < 150; ++y) {
      for (int x = 0; x < 200; ++x) {
        const Ray ray = request.camera.rayThrough({x + 0.5, y + 0.5}, request.size);
        const glm::dvec3 offset = ball.centre - ray.origin;
        const double along = glm::dot(offset, ray.direction);
        const double miss = glm::length(offset - along * ray.direction);
        if (miss > ball.radius || along * ray.depthPerLength > ray.lastDepth) continue;
        ++met;
        const auto* tile = tileOf[std::size_t(y / 8) * columns + std::size_t(x / 8)];
        ASSERT_TRUE(tile) << x << ", " << y;
        const double z = (along * ray.depthPerLength - frame.depthOrigin) / frame.scale;
        EXPECT_GE(z, tile->z);
        EXPECT_LE(z, tile->w);
      }
    }
    EXPECT_GT(met, 400u);
  }
}

TEST(TilePlan, MarchesEverythingWithoutABackground) {
  Ball ball;
  auto request = ball.request(Projection::Orthographic, {64, 64});
  // A MIP differs from ray to ray where the background does.
  for (float& v : ball.samples.values)
    v += v < 0.5f ? 1e-3f * float(&v - ball.samples.values.data()) / 3e5f : 0.0f;
  EXPECT_FALSE(planOf(ball, request).background);
  EXPECT_EQ(planOf(ball, request).marched.size(), 64u);
  request.mip = false;
  EXPECT_TRUE(planOf(ball, request).background);
  // From inside the block projections of its corners mean nothing.
  request.camera.projection = Projection::Perspective;
  request.camera.position = {0.5, 0.1, 0.5};
  request.camera.nearDepth = 0.01;
  EXPECT_EQ(planOf(ball, request).marched.size(), 64u);
}

}  // namespace
}  // namespace vestige
