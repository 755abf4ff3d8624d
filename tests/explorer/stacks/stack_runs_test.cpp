// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/stacks/stack_runs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <random>

#include "explorer/inspect/probe.h"
#include "explorer/stacks/run_profile.h"
#include "explorer/stacks/slab_path.h"
#include "explorer/stacks/stack_segments.h"
#include "proxy/base/error.h"
#include "tests/support/walked_stack.h"

namespace vestige {
namespace {

constexpr int kLevels = 32, kSlabs = 5, kIntervals = 6;
constexpr int kNoData = kIntervals + 2;

ProxyHeader headerOf(ImageSize size) {
  ProxyHeader header;
  header.field = "f";
  header.view = "front";
  header.size = size;
  header.domain = {{0, 0, 0}, {2, 4, 1}};
  header.camera = frameBox(header.domain, {0, 1, 0}, {0, 0, 1}, size.aspect());
  header.camera.viewHeight = 1.0;  // no rim: every ray hits
  header.partition = IntervalPartition::uniform(0.0, 1.0, kIntervals);
  header.statistics.high = 1.0;
  for (int s = 0; s <= kSlabs; ++s) {
    header.slabDepths.push_back(-header.camera.position.y + 4.0 * s / kSlabs);
  }
  return header;
}

/// A path of one cell with these levels from `lowest` on.
struct Cell {
  StackSlab slab;
  StackCell cell;
  Cell(int lowest, std::vector<std::uint8_t> levels, int noData = 0, int low = 0, int high = 0) {
    slab.levels = std::move(levels);
    cell.lowest = std::uint8_t(lowest);
    cell.count = std::uint8_t(slab.levels.size());
    cell.noData = std::uint8_t(noData);
    cell.setTurns(low, high);
  }
  std::vector<Visit> path(int enter, int leave, bool* certain = nullptr) const {
    SlabPath path;
    path.follow(slab, cell, enter, leave, kNoData, kLevels);
    if (certain) *certain = path.certain();
    return {path.visits().begin(), path.visits().end()};
  }
};

std::vector<int> ranksOf(const std::vector<Visit>& visits) {
  std::vector<int> ranks;
  for (const Visit& visit : visits) ranks.push_back(visit.rank);
  return ranks;
}

TEST(SlabPath, RisesAndFallsBetweenTheFaces) {
  const Cell cell(2, {10, 12, 10});
  bool certain = false;
  EXPECT_EQ(ranksOf(cell.path(2, 4, &certain)), (std::vector<int>{2, 3, 4}));
  EXPECT_TRUE(certain);
  EXPECT_EQ(ranksOf(cell.path(4, 2)), (std::vector<int>{4, 3, 2}));
  EXPECT_EQ(cell.path(4, 2)[1].levels, 12.0f);
}

TEST(SlabPath, TurnsWhereTheTurningRankHasItsMeanPlace) {
  // Up to rank 4 and back, 4 around its place in each eighth of the slab.
  for (int high = 2; high <= 7; ++high) {
    const Cell cell(2, {12, 12, 8}, 0, 0, high);
    bool certain = true;
    const auto visits = cell.path(2, 2, &certain);
    EXPECT_FALSE(certain);
    float before = 0.0f;
    for (const Visit& visit : visits) {
      if (visit.rank == 4) {
        EXPECT_NEAR((before + 0.5f * visit.levels) / kLevels, (high - 0.5f) / 8.0f, 1e-5f);
      }
      before += visit.levels;
    }
    EXPECT_FLOAT_EQ(before, kLevels);
  }
}

TEST(SlabPath, MeetsTheExtremeFirstWhosePlaceIsNearer) {
  EXPECT_EQ(ranksOf(Cell(1, {8, 8, 16}, 0, 2, 6).path(2, 2)), (std::vector<int>{2, 1, 2, 3, 2}));
  EXPECT_EQ(ranksOf(Cell(1, {8, 8, 16}, 0, 7, 3).path(2, 2)), (std::vector<int>{2, 3, 2, 1, 2}));
}

TEST(SlabPath, JumpsAcrossGapsWithoutData) {
  EXPECT_EQ(ranksOf(Cell(3, {20}, 12).path(kNoData, 3)), (std::vector<int>{kNoData, 3}));
  EXPECT_EQ(ranksOf(Cell(3, {20}, 12).path(3, kNoData)), (std::vector<int>{3, kNoData}));
  EXPECT_EQ(ranksOf(Cell(3, {20}, 12).path(kNoData, kNoData)),
            (std::vector<int>{kNoData, 3, kNoData}));
  // Ranks passed over are where the gap is.
  EXPECT_EQ(ranksOf(Cell(1, {10, 0, 10}, 12).path(1, 3)), (std::vector<int>{1, kNoData, 3}));
  EXPECT_EQ(ranksOf(Cell(3, {20}, 12).path(3, 3)), (std::vector<int>{3, kNoData, 3}));
  EXPECT_EQ(ranksOf(Cell(0, {}, 32).path(kNoData, kNoData)), (std::vector<int>{kNoData}));
}

TEST(SlabPath, KeepsEveryLevelWhateverItIsGiven) {
  std::mt19937 random(5);
  const auto below = [&](int n) { return int(random() % unsigned(n)); };
  for (int trial = 0; trial < 20000; ++trial) {
    const int noData = below(3) == 0 ? below(kLevels + 1) : 0;
    std::vector<std::uint8_t> levels(std::size_t(below(7)), 0);
    int left = kLevels - noData;
    for (auto& level : levels) left -= level = std::uint8_t(below(left + 1));
    const Cell cell(below(kNoData - int(levels.size()) + 1), levels, noData, below(16), below(16));
    SlabPath path;
    path.follow(cell.slab, cell.cell, below(256), below(256), kNoData, kLevels);
    std::vector<float> sums(kNoData + 1, 0.0f);
    for (const Visit& visit : path.visits()) {
      ASSERT_GT(visit.levels, 0.0f);
      sums[visit.rank] += visit.levels;
    }
    for (std::size_t i = 0; i < levels.size(); ++i) {
      ASSERT_NEAR(sums[cell.cell.lowest + i], levels[i], 1e-4f) << trial;
    }
    ASSERT_NEAR(sums[kNoData], noData, 1e-4f) << trial;
  }
}

/// A stack of one pixel whose field is linear between knots (share of the depth, value).
struct Line {
  std::vector<std::pair<double, double>> knots;
  SlicedStack stack() const {
    ProxyHeader header = headerOf({1, 1});
    const double near = header.slabDepths.front();
    return test::walkedStack(header, kLevels, [&](std::size_t, const test::StretchSink& sink) {
      for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
        sink({near + 4.0 * knots[i].first, near + 4.0 * knots[i + 1].first, knots[i].second,
              knots[i + 1].second});
      }
    });
  }
  double at(double share) const {
    for (std::size_t i = 0;; ++i) {
      const auto [z0, f0] = knots[i];
      const auto [z1, f1] = knots[i + 1];
      if (share <= z1) return f0 + (share - z0) / (z1 - z0) * (f1 - f0);
    }
  }
};

TEST(Probe, TellsHowLongARayIsInEachIntervalOfASlab) {
  // Rises through the lower half of the range in the first slab, stays in the second.
  const Line line{{{0.0, 0.0}, {0.2, 0.5}, {0.4, 0.5}, {1.0, 2.0}}};
  const SlicedStack stack = line.stack();
  const auto cells = probe(stack, 0, 0);
  ASSERT_EQ(cells.size(), std::size_t(kSlabs));
  double all = 0.0;
  for (const ProbeCell& cell : cells) {
    EXPECT_EQ(cell.noData, 0.0);
    for (const ProbeShare& share : cell.shares) {
      EXPECT_LT(share.low, share.high);
      all += share.length;
    }
  }
  EXPECT_NEAR(all, 4.0, 1e-9);
  const IntervalPartition& partition = *stack.header.partition;
  const double half = 0.5 * (partition.low() + partition.high());
  EXPECT_LE(cells[0].shares.back().low, half);
  EXPECT_TRUE(std::isinf(cells.back().shares.back().high)) << "above";

  const double inside = 0.5 * (stack.header.slabDepths[2] + stack.header.slabDepths[3]);
  const auto one = probe(stack, 0, 0, inside);
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one[0].slab, 2);
  EXPECT_NE(probeText(one).find("channel"), std::string::npos);
  EXPECT_EQ(toJson(one)[0]["shares"].size(), one[0].shares.size());
  EXPECT_THROW(probe(stack, 1, 0), Error);
  EXPECT_THROW(probe(stack, 0, 0, 1e9), Error);
}

TEST(StackRuns, GiveAProfileBackThatIsMonotoneInEachSlab) {
  // Turns at the slabs' faces only.
  const Line line{{{0.0, 0.05}, {0.2, 0.62}, {0.4, 0.11}, {0.6, 0.97}, {0.8, 0.93}, {1.0, 0.4}}};
  const SlicedStack stack = line.stack();
  const RunLists runs = runsOfStack(stack);
  const IntervalPartition& partition = *stack.header.partition;
  double z = 0.0;
  for (std::size_t r = runs.first[0]; r < runs.first[1]; ++r) {
    EXPECT_FALSE(runs.uncertainAt(r));
    const double middle = (z + 0.5 * double(runs.length[r])) / 4.0;
    EXPECT_EQ(runs.rankAt(r), partition.rankOf(partition.channelOf(line.at(middle)))) << middle;
    z += double(runs.length[r]);
    // Its end is a crossing of a bound, to a level of a slab.
    if (r + 1 == runs.first[1]) break;
    const int upper = std::max(runs.rankAt(r), runs.rankAt(r + 1));
    const double bound = partition.bounds()[std::size_t(upper) - 1];
    const double level = 4.0 / kSlabs / kLevels;
    const double a = line.at(std::max(0.0, (z - level) / 4.0)), b = line.at((z + level) / 4.0);
    EXPECT_TRUE((std::min(a, b) <= bound + 1e-9 && bound - 1e-9 <= std::max(a, b)))
        << z << ": " << a << " " << bound << " " << b;
  }
  EXPECT_NEAR(z, 4.0, 1e-5);
}

TEST(StackRuns, GiveTurnsBackWithinAnEighthOfASlab) {
  for (int i = 0; i < 20; ++i) {
    const double turn = 0.2 + 0.2 * (0.1 + 0.04 * i);
    const Line line{{{0.0, 0.1}, {0.2, 0.2}, {turn, 0.75}, {0.4, 0.15}, {1.0, 0.1}}};
    const RunLists runs = runsOfStack(line.stack());
    double z = 0.0;
    bool found = false;
    for (std::size_t r = runs.first[0]; r < runs.first[1]; ++r) {
      const double middle = z + 0.5 * double(runs.length[r]);
      if (runs.rankAt(r) == 5) {
        found = true;
        EXPECT_NEAR(middle / 4.0, turn, 0.2 / 8.0);
      }
      z += double(runs.length[r]);
    }
    EXPECT_TRUE(found);
  }
}

/// Random, but whole: as the reader would let through.
SlicedStack randomStack(unsigned seed) {
  SlicedStack stack;
  stack.header = headerOf({9, 7});
  stack.levels = kLevels;
  std::mt19937 random(seed);
  const auto below = [&](int n) { return int(random() % unsigned(n)); };
  for (int s = 0; s < kSlabs; ++s) {
    StackSlab& slab = stack.slabs.emplace_back();
    for (std::size_t i = 0; i < stack.header.size.pixels(); ++i) {
      StackCell& cell = slab.cells.emplace_back();
      cell.begin = std::uint32_t(slab.levels.size());
      if (below(8) == 0) continue;
      cell.noData = std::uint8_t(below(4) == 0 ? below(kLevels + 1) : 0);
      int left = kLevels - cell.noData;
      cell.lowest = std::uint8_t(below(kNoData));
      while (left > 0) {
        const bool last = cell.lowest + cell.count == kNoData - 1;
        const int take = last ? left : below(left + 1);
        slab.levels.push_back(std::uint8_t(take));
        ++cell.count;
        left -= take;
      }
      cell.setTurns(below(9), below(9));
    }
  }
  for (int f = 0; f <= kSlabs; ++f) {
    auto& face = stack.faces.emplace_back(stack.header.size.pixels());
    for (auto& rank : face) {
      rank = below(5) == 0 ? SlicedStack::kOutside : std::uint8_t(below(kNoData + 1));
    }
  }
  return stack;
}

TEST(StackRuns, KeepLengthsOfAnyStackInEitherWay) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const SlicedStack stack = randomStack(seed);
    for (const Uncertain way : {Uncertain::Likely, Uncertain::Reversed}) {
      const RunLists runs = runsOfStack(stack, way);
      for (std::size_t i = 0; i < stack.header.size.pixels(); ++i) {
        std::vector<double> want(kNoData + 1, 0.0), have(kNoData + 1, 0.0);
        const double level = 4.0 / kSlabs / kLevels;
        for (const StackSlab& slab : stack.slabs) {
          const StackCell& cell = slab.cells[i];
          for (int k = 0; k < cell.count; ++k) {
            want[std::size_t(cell.lowest + k)] += level * slab.levelsOf(cell)[std::size_t(k)];
          }
          want[kNoData] += level * cell.noData;
        }
        for (std::size_t r = runs.first[i]; r < runs.first[i + 1]; ++r) {
          have[std::size_t(runs.rankAt(r))] += double(runs.length[r]);
        }
        for (std::size_t k = 0; k < want.size(); ++k) ASSERT_NEAR(have[k], want[k], 1e-4);
      }
    }
  }
}

TEST(StackSegments, PartsOfAnIntervalAddUpToItsRuns) {
  const SlicedStack stack = randomStack(3);
  const RunLists runs = runsOfStack(stack);
  for (const int parts : {1, 3, 4}) {
    const FineChannels channels(*stack.header.partition, parts);
    const SegmentLists lists = segmentsOfRuns(runs, channels, stack.header.statistics, 4.0);
    for (std::size_t i = 0; i < stack.header.size.pixels(); ++i) {
      std::vector<double> want(kNoData + 1, 0.0), have(kNoData + 1, 0.0);
      for (std::size_t r = runs.first[i]; r < runs.first[i + 1]; ++r) {
        want[std::size_t(runs.rankAt(r))] += double(runs.length[r]);
      }
      for (const Segment& segment : lists.at(i)) {
        have[std::size_t(stack.header.partition->rankOf(channels.parent(segment.channel)))] +=
            double(segment.amount);
      }
      want[kNoData] = 0.0;  // no data are no segment
      for (std::size_t k = 0; k < want.size(); ++k) {
        ASSERT_NEAR(have[k], want[k], 1e-3 * want[k] + 1e-6);
      }
    }
  }
}

TEST(StackSegments, ASteadySlopeSpendsEqualLengthsInEqualParts) {
  const SlicedStack stack = Line{{{0.0, -0.1}, {1.0, 1.1}}}.stack();
  const FineChannels channels(*stack.header.partition, 4);
  const SegmentLists lists = segmentsOfRuns(runsOfStack(stack), channels, {}, 4.0);
  int part = 0;
  for (const Segment& segment : lists.at(0)) {
    if (channels.parent(segment.channel) >= kIntervals) continue;  // below, above
    EXPECT_EQ(segment.channel, part++);
    // 4 world units over 1.2 of value; levels of a slab are 1/32 of 0.8.
    EXPECT_NEAR(segment.amount, 4.0 / 1.2 / kIntervals / 4.0, 0.2 * 0.14);
  }
  EXPECT_EQ(part, 4 * kIntervals);
}

TEST(StackSegments, FineMeansAverageToThoseOfIntervals) {
  const auto partition = IntervalPartition::uniform(-3.0, 5.0, kIntervals);
  TransferFunction function({{-3.0, 0.0}, {-1.0, 0.8}, {2.0, 0.1}, {5.0, 0.9}}, 0.7,
                            Colormap::named("viridis"), -3.0, 5.0);
  function.setFactors({1.0, 2.0, 0.0, 0.5, 1.0, 3.0});
  const FineChannels channels(partition, 4);
  const ChannelTable fine = channels.table(function);
  const IntervalLook look = function.onIntervals(partition);
  for (std::size_t k = 0; k < kIntervals; ++k) {
    double mean = 0.0;
    for (std::size_t part = 0; part < 4; ++part) mean += fine.strength[4 * k + part] / 4.0;
    EXPECT_NEAR(mean, look.extinction[k], 1e-9 * (1.0 + mean));
  }
  EXPECT_EQ(fine.strength[std::size_t(channels.channel(0, 0))], look.extinction[kIntervals]);
}

TEST(RunProfile, StaysInItsIntervalAndMeetsItsBounds) {
  const SlicedStack stack = randomStack(9);
  const RunLists runs = runsOfStack(stack);
  RunProfile profile(*stack.header.partition, stack.header.statistics);
  for (std::size_t i = 0; i < stack.header.size.pixels(); ++i) {
    const auto& segments = profile.of(runs, i);
    ASSERT_EQ(segments.size(), runs.first[i + 1] - runs.first[i]);
    for (std::size_t p = 0; p < segments.size(); ++p) {
      for (int j = 0; j <= 20; ++j) {
        const float y = segments[p].at(float(j) / 20.0f);
        ASSERT_GE(y, 0.0f);
        ASSERT_LE(y, 1.0f);
      }
      if (p == 0 || segments[p].rank == kNoData || segments[p - 1].rank == kNoData) continue;
      if (std::abs(segments[p].rank - segments[p - 1].rank) != 1) continue;
      ASSERT_NEAR(profile.value(segments[p - 1].rank, segments[p - 1].at(1.0f)),
                  profile.value(segments[p].rank, segments[p].at(0.0f)), 1e-5);
    }
  }
}

}  // namespace
}  // namespace vestige
