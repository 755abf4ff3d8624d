// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/ingest/block_set.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "adaptor/common/adaptor_error.h"

namespace vestige {
namespace {

GridDescription grid(std::array<int, 3> points, std::array<int, 3> first = {},
                     std::array<int, 6> ghosts = {}) {
  GridDescription description;
  description.points = points;
  description.first = first;
  description.origin = {1.0, 2.0, 3.0};
  description.spacing = {0.1, 0.2, 0.3};
  description.ghosts = ghosts;
  return description;
}

template <class Call>
void expectFails(vestige_code code, const std::string& part, const Call& call) {
  try {
    call();
    ADD_FAILURE() << "nothing was thrown; expected: " << part;
  } catch (const AdaptorError& error) {
    EXPECT_EQ(error.apiCode(), code) << error.what();
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

TEST(BlockSet, OneBlockIsTheDomain) {
  BlockSet blocks;
  blocks.describe(0, grid({11, 6, 3}));
  blocks.validate();
  const Box domain = blocks.domain();
  EXPECT_EQ(domain.low, glm::dvec3(1.0, 2.0, 3.0));
  EXPECT_NEAR(domain.high.x, 2.0, 1e-15);
  EXPECT_EQ(blocks.owned(0), domain);
  EXPECT_EQ(blocks.coverage(), 1.0);
  EXPECT_EQ(blocks.smallestSpacing(), 0.1);
}

TEST(BlockSet, NeighboursAgreeOnTheirFaceToTheLastBit) {
  BlockSet blocks;
  blocks.describe(0, grid({8, 6, 3}, {0, 0, 0}, {0, 1, 0, 0, 0, 0}));
  blocks.describe(1, grid({6, 6, 3}, {5, 0, 0}, {1, 0, 0, 0, 0, 0}));
  blocks.validate();
  EXPECT_EQ(blocks.owned(0).high.x, blocks.owned(1).low.x);
  EXPECT_NEAR(blocks.coverage(), 1.0, 1e-12);
}

/// How often each sample of the lattice (grid()'s numbering) is counted; ghosts included in
/// `first`.
std::map<std::array<int, 3>, int> countsOf(const BlockSet& blocks, Location location) {
  std::map<std::array<int, 3>, int> counts;
  for (const auto& [index, block] : blocks.blocks()) {
    const auto& first = block.grid.first;
    for (const auto& [low, high] : blocks.ownSamples(index, location))
      for (int z = low[2]; z < high[2]; ++z)
        for (int y = low[1]; y < high[1]; ++y)
          for (int x = low[0]; x < high[0]; ++x)
            ++counts[{first[0] + x, first[1] + y, first[2] + z}];
  }
  return counts;
}

TEST(BlockSet, EverySampleIsOwnedOnce) {
  BlockSet blocks;
  blocks.describe(0, grid({8, 6, 3}, {0, 0, 0}, {0, 1, 0, 0, 0, 0}));
  blocks.describe(1, grid({6, 6, 3}, {5, 0, 0}, {1, 0, 0, 0, 0, 0}));
  // Points 0..10: the shared point 6 belongs to the block of the lowest index.
  using Ranges = std::vector<SampleRange>;
  EXPECT_EQ(blocks.ownSamples(0, Location::Point), (Ranges{{{0, 0, 0}, {7, 6, 3}}}));
  EXPECT_EQ(blocks.ownSamples(1, Location::Point), (Ranges{{{2, 0, 0}, {6, 6, 3}}}));
  // Cells 0..9: 6 and 4.
  EXPECT_EQ(blocks.ownSamples(0, Location::Cell), (Ranges{{{0, 0, 0}, {6, 5, 2}}}));
  EXPECT_EQ(blocks.ownSamples(1, Location::Cell), (Ranges{{{1, 0, 0}, {5, 5, 2}}}));
}

TEST(BlockSet, SamplesOfAnySetOfBlocksAreCountedExactlyOnce) {
  struct Case {
    const char* name;
    std::vector<std::pair<std::array<int, 3>, std::array<int, 3>>> boxes;  ///< points [low, high]
  };
  const std::vector<Case> cases{
      {"an L", {{{0, 0, 0}, {4, 4, 4}}, {{4, 0, 0}, {8, 4, 4}}, {{0, 4, 0}, {4, 8, 4}}}},
      {"an L, numbered backward",
       {{{0, 4, 0}, {4, 8, 4}}, {{4, 0, 0}, {8, 4, 4}}, {{0, 0, 0}, {4, 4, 4}}}},
      {"a face half covered", {{{0, 0, 0}, {8, 4, 8}}, {{2, 4, 2}, {5, 8, 6}}}},
      {"touching in an edge and in a corner",
       {{{4, 4, 4}, {8, 8, 8}}, {{0, 0, 4}, {4, 4, 8}}, {{0, 8, 0}, {4, 9, 4}}}},
      {"apart", {{{0, 0, 0}, {2, 2, 2}}, {{5, 0, 0}, {7, 2, 2}}}},
      {"eight around a point",
       {{{0, 0, 0}, {2, 2, 2}},
        {{2, 0, 0}, {4, 2, 2}},
        {{0, 2, 0}, {2, 4, 2}},
        {{2, 2, 0}, {4, 4, 2}},
        {{0, 0, 2}, {2, 2, 4}},
        {{2, 0, 2}, {4, 2, 4}},
        {{0, 2, 2}, {2, 4, 4}},
        {{2, 2, 2}, {4, 4, 4}}}}};
  for (const auto& [name, boxes] : cases) {
    for (const int ghosts : {0, 1}) {
      for (const bool statedDomain : {false, true}) {
        BlockSet blocks;
        std::set<std::array<int, 3>> points, cells;
        int index = 0;
        for (const auto& [low, high] : boxes) {
          std::array<int, 3> size{}, first{};
          for (std::size_t a = 0; a < 3; ++a) {
            size[a] = high[a] - low[a] + 1 + 2 * ghosts;
            first[a] = low[a] - ghosts;
          }
          blocks.describe(index++,
                          grid(size, first, {ghosts, ghosts, ghosts, ghosts, ghosts, ghosts}));
          for (int z = low[2]; z <= high[2]; ++z)
            for (int y = low[1]; y <= high[1]; ++y)
              for (int x = low[0]; x <= high[0]; ++x) {
                points.insert({x, y, z});
                if (x < high[0] && y < high[1] && z < high[2]) cells.insert({x, y, z});
              }
        }
        if (statedDomain) blocks.setDomain({{-10, -10, -10}, {50, 50, 50}});
        blocks.validate();
        for (const auto location : {Location::Point, Location::Cell}) {
          const auto& wanted = location == Location::Point ? points : cells;
          const auto counts = countsOf(blocks, location);
          EXPECT_EQ(counts.size(), wanted.size()) << name;
          for (const auto& [sample, count] : counts) {
            EXPECT_EQ(count, 1) << name << ": " << sample[0] << ' ' << sample[1] << ' '
                                << sample[2];
            EXPECT_TRUE(wanted.contains(sample)) << name;
          }
        }
      }
    }
  }
}

TEST(BlockSet, FacesLieBetweenCellsAndTheirGhosts) {
  BlockSet blocks;
  auto description = grid({6, 5, 1}, {0, 0, 0}, {1, 0, 0, 1, 0, 0});
  description.axes[1] = {0.0, 1.0, 2.0, 3.0, 6.0};
  blocks.describe(0, description);
  const auto places = blocks.facePlaces(0, Location::Cell);
  ASSERT_EQ(places[0].size(), 1u);
  EXPECT_EQ(places[0][0].below, 0);
  EXPECT_NEAR(places[0][0].weight, 0.5, 1e-12);
  ASSERT_EQ(places[1].size(), 1u);  // the face at 3 between centres at 2.5 and 4.5
  EXPECT_EQ(places[1][0].below, 2);
  EXPECT_NEAR(places[1][0].weight, 0.25, 1e-12);
  EXPECT_TRUE(places[2].empty());
  for (const auto& axis : blocks.facePlaces(0, Location::Point)) EXPECT_TRUE(axis.empty());
}

TEST(BlockSet, CellSamplesStandAtTheCellsCentres) {
  BlockSet blocks;
  auto description = grid({3, 6, 3});
  description.axes[0] = {0.0, 1.0, 4.0};
  blocks.describe(0, description);
  EXPECT_EQ(blocks.at(0).nodes(Location::Cell)[0], (std::vector<double>{0.5, 2.5}));
  EXPECT_EQ(blocks.owned(0).low.x, 0.0);
  EXPECT_EQ(blocks.owned(0).high.x, 4.0);
}

TEST(BlockSet, DomainOfOnePointAlongAnAxisIsOneSpacingThick) {
  BlockSet blocks;
  blocks.describe(0, grid({11, 6, 1}));
  blocks.validate();
  EXPECT_NEAR(blocks.domain().size().z, 0.3, 1e-12);
  EXPECT_EQ(blocks.owned(0), blocks.domain());
  EXPECT_EQ(blocks.at(0).samples(Location::Cell), (std::array<int, 3>{10, 5, 1}));
  EXPECT_EQ(blocks.ownSamples(0, Location::Point),
            (std::vector<SampleRange>{{{0, 0, 0}, {11, 6, 1}}}));
}

TEST(BlockSet, EmptyBlocksAreFineAndAllEmptyIsAnError) {
  BlockSet blocks;
  blocks.describe(3, grid({0, 6, 3}));
  expectFails(VESTIGE_ERROR_GRID, "no block has any points", [&] { blocks.validate(); });
  blocks.describe(4, grid({4, 4, 4}));
  blocks.validate();
  EXPECT_EQ(blocks.at(3).samples(Location::Cell), (std::array<int, 3>{0, 0, 0}));
}

TEST(BlockSet, RefusesSizesThatNoDeviceHolds) {
  BlockSet blocks;
  expectFails(VESTIGE_ERROR_GRID, "block 2 has 1073741824 x 2 x 2 points, more than", [&] {
    blocks.describe(2, grid({1 << 30, 2, 2}));
  });
  const int most = std::numeric_limits<int>::max();
  expectFails(VESTIGE_ERROR_GRID, "1048576 along an axis and 68719476736 in all", [&] {
    blocks.describe(0, grid({most, most, most}));
  });
  expectFails(VESTIGE_ERROR_GRID, "65536 x 65536 x 17", [&] {
    blocks.describe(0, grid({65536, 65536, 17}));
  });
  EXPECT_TRUE(blocks.blocks().empty());
  blocks.describe(0, grid({most, 0, most}));
  blocks.describe(1, grid({4, 4, 4}, {most, -most, most - 1}));
  blocks.validate();
}

TEST(BlockSet, RefusesGridsThatMakeNoSense) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  BlockSet blocks;
  expectFails(VESTIGE_ERROR_ARGUMENT, "-1", [&] { blocks.describe(-1, grid({4, 4, 4})); });
  expectFails(VESTIGE_ERROR_GRID, "-4 points along x", [&] {
    blocks.describe(0, grid({-4, 4, 4}));
  });
  expectFails(VESTIGE_ERROR_GRID, "none is its own", [&] {
    blocks.describe(0, grid({4, 4, 4}, {}, {2, 2, 0, 0, 0, 0}));
  });
  expectFails(VESTIGE_ERROR_GRID, "-1 ghost layers along z", [&] {
    blocks.describe(0, grid({4, 4, 4}, {}, {0, 0, 0, 0, -1, 0}));
  });
  for (const double spacing : {0.0, -1.0, nan}) {
    auto description = grid({4, 4, 4});
    description.spacing[1] = spacing;
    expectFails(VESTIGE_ERROR_GRID, "spacing", [&] { blocks.describe(0, description); });
  }
  auto description = grid({3, 4, 4});
  description.axes[0] = {0.0, 2.0, 2.0};
  expectFails(VESTIGE_ERROR_GRID, "do not increase", [&] { blocks.describe(0, description); });
  description.axes[0] = {0.0, nan, 2.0};
  expectFails(VESTIGE_ERROR_GRID, "coordinate nan", [&] { blocks.describe(0, description); });
  EXPECT_TRUE(blocks.blocks().empty());
}

TEST(BlockSet, RefusesSpacingsThatRoundingSwallows) {
  BlockSet blocks;
  auto description = grid({4, 4, 4});
  description.origin[0] = 1e20;
  expectFails(VESTIGE_ERROR_GRID, "do not increase", [&] { blocks.describe(0, description); });
}

TEST(BlockSet, RefusesOverlapsAndBlocksOutsideTheDomain) {
  BlockSet blocks;
  blocks.describe(0, grid({6, 6, 6}));
  blocks.describe(7, grid({6, 6, 6}, {4, 0, 0}));
  expectFails(VESTIGE_ERROR_GRID, "block 7 overlaps block 0", [&] { blocks.validate(); });
  blocks.describe(7, grid({6, 6, 6}, {5, 0, 0}));
  blocks.validate();
  blocks.setDomain({{1.0, 2.0, 3.0}, {1.5, 4.0, 6.0}});
  expectFails(VESTIGE_ERROR_GRID, "beyond the domain", [&] { blocks.validate(); });
}

TEST(BlockSet, KnowsOnlyDescribedBlocksAndForgetsWhatWasShared) {
  BlockSet blocks;
  FieldView field;
  field.name = "t";
  expectFails(VESTIGE_ERROR_NO_BLOCK, "block 2", [&] { blocks.share(2, field); });
  blocks.describe(2, grid({4, 5, 6}));
  blocks.share(2, field);
  blocks.share(2, field);
  ASSERT_EQ(blocks.at(2).fields.size(), 1u);
  EXPECT_EQ(blocks.at(2).find("t")->size, (std::array<int, 3>{4, 5, 6}));
  blocks.forgetShared();
  EXPECT_EQ(blocks.at(2).find("t"), nullptr);
}

}  // namespace
}  // namespace vestige
