// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/layout/sliced_stack.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <numeric>
#include <random>

#include "proxy/base/error.h"
#include "proxy/format/layout/proxy_check.h"
#include "proxy/format/layout/proxy_layout.h"

namespace vestige {
namespace {

ProxyHeader headerOf(ImageSize size, int slabs) {
  ProxyHeader header;
  header.field = "f";
  header.view = "front";
  header.size = size;
  header.domain = {{0, 0, 0}, {2, 4, 1}};
  header.camera = frameBox(header.domain, {0, 1, 0}, {0, 0, 1}, size.aspect());
  header.partition = IntervalPartition::uniform(0.0, 1.0, 6);
  const double from = -header.camera.position.y;
  for (int s = 0; s <= slabs; ++s) header.slabDepths.push_back(from + 4.0 * s / slabs);
  return header;
}

/// Random cells where a ray hits, none elsewhere.
SlicedStack randomStack(int levels, unsigned seed) {
  SlicedStack stack;
  stack.header = headerOf({13, 9}, 5);
  stack.levels = levels;
  const SlabChords chords(stack.header);
  const int ranks = stack.header.partition->intervals() + 2;
  std::mt19937 random(seed);
  const auto below = [&](int n) { return int(random() % unsigned(n)); };
  for (int s = 0; s < 5; ++s) {
    StackSlab& slab = stack.slabs.emplace_back();
    for (std::size_t i = 0; i < stack.header.size.pixels(); ++i) {
      StackCell& cell = slab.cells.emplace_back();
      cell.begin = std::uint32_t(slab.levels.size());
      if (!(chords.chord(s, i) > chords.least())) continue;
      cell.noData = std::uint8_t(below(4) == 0 ? below(levels + 1) : 0);
      int left = levels - cell.noData;
      if (left == 0) continue;
      cell.lowest = std::uint8_t(below(ranks));
      while (left > 0) {
        const bool lastRank = cell.lowest + cell.count == ranks - 1;
        const int take = lastRank || cell.count == 3 ? left : 1 + below(left);
        slab.levels.push_back(std::uint8_t(take));
        ++cell.count;
        left -= take;
      }
      cell.setTurns(below(9), below(9));
    }
  }
  for (int f = 0; f <= 5; ++f) {
    auto& face = stack.faces.emplace_back(stack.header.size.pixels());
    for (auto& rank : face)
      rank = below(5) == 0 ? SlicedStack::kOutside : std::uint8_t(below(ranks + 1));
  }
  return stack;
}

class SlicedStackFile : public ::testing::Test {
 protected:
  std::filesystem::path path_ =
      std::filesystem::path(::testing::TempDir()) /
      (std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + ".exr");
  void TearDown() override { std::filesystem::remove(path_); }

  void write(const std::vector<std::byte>& bytes) const {
    std::ofstream(path_, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  }
  /// What reading says of a stack after `change` was made to one of its parts.
  std::string complaint(const std::function<void(int, ProxyPart&)>& change) {
    write(encodeStack(randomStack(32, 7)));
    const ProxyImage image = ExrFile(path_).image();
    write(encodeExr(
        image.header, int(image.parts.size()),
        [&](int i) {
          ProxyPart part = image.parts[std::size_t(i)];
          change(i, part);
          return part;
        },
        1));
    const auto problems = problemsOf(ExrFile(path_));
    return problems.empty() ? "" : problems.front();
  }
};

TEST_F(SlicedStackFile, GivesBackEveryLevelTurnAndFace) {
  for (int levels : {16, 32, 64, 128}) {
    const SlicedStack stack = randomStack(levels, unsigned(levels));
    write(encodeStack(stack));
    const SlicedStack read = readStack(ExrFile(path_));
    EXPECT_EQ(read.levels, levels);
    EXPECT_EQ(read.faces, stack.faces);
    EXPECT_EQ(read.header.slabDepths, stack.header.slabDepths);
    ASSERT_EQ(read.slabs.size(), stack.slabs.size());
    for (std::size_t s = 0; s < stack.slabs.size(); ++s)
      for (std::size_t i = 0; i < stack.header.size.pixels(); ++i) {
        const StackCell &is = read.slabs[s].cells[i], &was = stack.slabs[s].cells[i];
        const auto levelsAre = read.slabs[s].levelsOf(is);
        const auto levelsWere = stack.slabs[s].levelsOf(was);
        ASSERT_TRUE(
            std::equal(levelsAre.begin(), levelsAre.end(), levelsWere.begin(), levelsWere.end()))
            << s << " " << i;
        ASSERT_EQ(is.noData, was.noData);
        if (was.count > 0) {
          ASSERT_EQ(is.lowest, was.lowest);
          ASSERT_EQ(is.turns, was.turns);
        }
        const int sum = std::accumulate(levelsAre.begin(), levelsAre.end(), int(is.noData));
        ASSERT_TRUE(sum == levels || sum == 0) << "Σ ℓ is the chord";
      }
    EXPECT_TRUE(problemsOf(ExrFile(path_)).empty());
  }
}

TEST_F(SlicedStackFile, EqualStacksGiveEqualBytes) {
  EXPECT_EQ(encodeStack(randomStack(32, 3)), encodeStack(randomStack(32, 3)));
}

TEST_F(SlicedStackFile, RefusesSharesThatFall) {
  const auto said = complaint([](int i, ProxyPart& part) {
    if (i != 2) return;
    for (float& v : part.channels[2].values) v = 1.0f;
    for (float& v : part.channels[3].values) v = 0.5f;
  });
  EXPECT_NE(said.find("'i02' of part 'slab01' is 0.5"), std::string::npos) << said;
}

TEST_F(SlicedStackFile, RefusesMoreThanTheSlabHolds) {
  const auto said = complaint([](int i, ProxyPart& part) {
    if (i == 1) part.channels[0].values[4] = 2.0f;
  });
  EXPECT_NE(said.find("whole number of levels"), std::string::npos) << said;
}

TEST_F(SlicedStackFile, RefusesTurnsBetweenEighths) {
  const auto said = complaint([](int i, ProxyPart& part) {
    if (i == 1) part.channels.back().values[0] = 0.5f;
  });
  EXPECT_NE(said.find("middle of an eighth"), std::string::npos) << said;
}

TEST_F(SlicedStackFile, RefusesRanksThatThereAreNot) {
  const auto said = complaint([](int i, ProxyPart& part) {
    if (i == 0) part.channels[1].values[3] = 11.0f;
  });
  EXPECT_NE(said.find("1 + a rank"), std::string::npos) << said;
}

TEST_F(SlicedStackFile, RefusesAnotherNumberOfLevels) {
  const auto said = complaint([](int i, ProxyPart& part) {
    if (i == 3) part.unit *= 2.0;
  });
  EXPECT_NE(said.find("other levels"), std::string::npos) << said;
}

TEST(SlicedStackErrors, NameWhatMakesNoSense) {
  const auto complains = [](SlicedStack stack, const char* what) {
    try {
      encodeStack(stack);
      FAIL() << what;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::InvalidArgument);
      EXPECT_NE(std::string(e.what()).find(what), std::string::npos) << e.what();
    }
  };
  SlicedStack stack = randomStack(32, 1);
  stack.levels = 33;
  complains(stack, "33 levels");
  stack = randomStack(32, 1);
  stack.slabs.pop_back();
  complains(stack, "4 slabs have 6 depths");
  stack = randomStack(32, 1);
  stack.header.partition.reset();
  complains(stack, "no intervals");
}

TEST(SlabChords, AddUpToTheBoxAcrossAllSlabs) {
  ProxyHeader header = headerOf({16, 16}, 7);
  header.camera = header.camera.orbited(header.domain.center(), 0.5, 0.3);
  const DepthRange range = [&] {
    double low = 1e9, high = -1e9;
    for (int i = 0; i < 8; ++i) {
      const double z =
          glm::dot(header.domain.corner(i) - header.camera.position, header.camera.forward);
      low = std::min(low, z), high = std::max(high, z);
    }
    return DepthRange{low, high};
  }();
  for (std::size_t s = 0; s < 8; ++s)
    header.slabDepths[s] = range.low + (range.high - range.low) * double(s) / 7.0;
  ProxyHeader whole = header;
  whole.slabDepths = {header.slabDepths.front(), header.slabDepths.back()};
  const SlabChords slabs(header), box(whole);
  double all = 0.0;
  for (std::size_t i = 0; i < header.size.pixels(); ++i) {
    double sum = 0.0;
    for (int s = 0; s < 7; ++s) sum += slabs.chord(s, i);
    EXPECT_NEAR(sum, box.chord(0, i), 1e-12);
    all += sum;
  }
  EXPECT_GT(all, 0.0);
}

}  // namespace
}  // namespace vestige
