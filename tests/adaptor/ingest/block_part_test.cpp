// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/ingest/block_part.h"

#include <gtest/gtest.h>

namespace vestige {
namespace {

BlockSet oneBlock(std::array<int, 3> points, std::array<int, 6> ghosts = {}) {
  GridDescription description;
  description.points = points;
  description.spacing = {0.1, 0.2, 0.3};
  description.ghosts = ghosts;
  BlockSet blocks;
  blocks.describe(0, description);
  return blocks;
}

double volume(const Box& box) { return box.size().x * box.size().y * box.size().z; }

TEST(BlockPart, WhatFitsIsLeftWhole) {
  const BlockSet blocks = oneBlock({20, 30, 40}, {1, 2, 3, 4, 5, 6});
  const auto parts = splitBlock(blocks, 0, {40, 24000});
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_TRUE(parts[0].whole);
  EXPECT_EQ(ownedBox(blocks, parts[0]), blocks.owned(0));
  const auto grid = marchGrid(blocks, parts[0], Location::Point);
  EXPECT_EQ(grid.nodes, blocks.at(0).nodes(Location::Point));
}

TEST(BlockPart, PartsTileTheBlockFitAndHaveGhosts) {
  for (const auto& [points, ghosts, limits] :
       {std::tuple(std::array{3000, 16, 16}, std::array{0, 0, 0, 0, 0, 0}, TextureLimits{2048}),
        std::tuple(std::array{100, 90, 80}, std::array{1, 2, 0, 3, 2, 0}, TextureLimits{25}),
        std::tuple(std::array{64, 64, 64}, std::array{0, 0, 0, 0, 0, 0}, TextureLimits{64, 20000}),
        std::tuple(std::array{50, 1, 7}, std::array{20, 20, 0, 0, 0, 0}, TextureLimits{16})}) {
    const BlockSet blocks = oneBlock(points, ghosts);
    const auto parts = splitBlock(blocks, 0, limits);
    double sum = 0.0;
    for (const BlockPart& part : parts) {
      const Box owned = ownedBox(blocks, part);
      sum += volume(owned);
      for (const auto location : {Location::Point, Location::Cell}) {
        const auto grid = marchGrid(blocks, part, location);
        const auto& all = blocks.at(0).nodes(location);
        std::int64_t samples = 1;
        for (std::size_t a = 0; a < 3; ++a) {
          const auto& nodes = grid.nodes[a];
          samples *= std::int64_t(nodes.size());
          EXPECT_LE(int(nodes.size()), limits.side);
          // Two samples past each face, or all that there are.
          const auto past = [&](int side) {
            int count = 0;
            for (const double node : nodes)
              if (side < 0 ? node < owned.low[int(a)] : node > owned.high[int(a)]) ++count;
            return count;
          };
          EXPECT_TRUE(past(-1) >= 2 || nodes.front() == all[a].front());
          EXPECT_TRUE(past(+1) >= 2 || nodes.back() == all[a].back());
        }
        EXPECT_LE(samples, limits.samples);
      }
    }
    EXPECT_FALSE(parts[0].whole);
    EXPECT_NEAR(sum, volume(blocks.owned(0)), 1e-9 * sum);
  }
}

TEST(BlockPart, AThreeThousandSampleChannelTakesTwoParts) {
  const auto parts = splitBlock(oneBlock({3000, 16, 16}), 0, {2048});
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].last[0], parts[1].first[0]);
  EXPECT_EQ(parts[1].last, (std::array{2999, 15, 15}));
}

}  // namespace
}  // namespace vestige
