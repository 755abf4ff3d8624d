// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/run/budget.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "adaptor/run/quality_levels.h"

namespace vestige {
namespace {

constexpr auto kSliced = std::size_t(Tier::Sliced);

TierBytes stacks(double bytes) {
  TierBytes all{};
  all[kSliced] = bytes;
  return all;
}

std::vector<LevelEstimate> levelsOf(std::initializer_list<double> bytes) {
  std::vector<LevelEstimate> levels;
  for (const double each : bytes)
    levels.push_back({"r" + std::to_string(levels.size()), stacks(each)});
  return levels;
}

/// A run whose steps take what `size(step, level)` says; at which level each was kept, -1 =
/// dropped.
struct Solver {
  explicit Solver(BudgetConfig config, bool cadence = false)
      : budget(config, cadence, [this] { return now; }) {}

  int step(const std::function<double(int)>& size, double seconds = 0.0) {
    ++cycle;
    budget.begin();
    int kept = -1;
    for (auto verdict = Budget::Verdict::Again; verdict == Budget::Verdict::Again;) {
      now += seconds;
      ++made;
      const double bytes = size(budget.level());
      const int level = budget.level();
      verdict = budget.judge(cycle, stacks(bytes));
      if (verdict != Budget::Verdict::Keep) continue;
      kept = level;
      largest = std::max(largest, bytes);
      budget.stored(cycle);
    }
    budget.end();
    for (auto& [lost, sentence] : budget.takeNews()) news.push_back(sentence);
    return kept;
  }

  double now = 0.0;
  Budget budget;
  std::int64_t cycle = 0;
  int made = 0;
  double largest = 0.0;
  std::vector<std::string> news;
};

BudgetConfig bytesOf(std::uint64_t bytes) { return {bytes, std::nullopt}; }

TEST(Budget, WithoutOneEverythingIsKeptAsAskedFor) {
  Solver run({});
  for (int i = 0; i < 50; ++i) EXPECT_EQ(run.step([](int) { return 1e15; }), 0);
  EXPECT_TRUE(run.budget.hasTime());
  EXPECT_TRUE(run.news.empty());
}

TEST(Budget, NoStepIsStoredThatIsLargerWhateverTheStepsAre) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    std::lognormal_distribution<double> jump(0.0, 1.5), error(0.0, 0.7);
    Solver run(bytesOf(1000));
    run.budget.setLevels(levelsOf({100, 50, 30, 20, 11, 5}));
    std::array<double, 6> truth{};
    for (int r = 0; r < 6; ++r) truth[std::size_t(r)] = 100.0 / (1 << r) * error(random);
    int drops = 0;
    for (int step = 0; step < 100; ++step) {
      const double scale = 20.0 * jump(random);
      const auto size = [&](int level) { return scale * truth[std::size_t(level)]; };
      const int kept = run.step(size);
      drops += kept < 0;
      // It is dropped only when the last level is too large.
      if (kept < 0) {
        EXPECT_GT(size(5), 1000.0);
      }
      ASSERT_LE(run.largest, 1000.0);
      ASSERT_LT(run.budget.level(), 6);
    }
    EXPECT_LE(run.made, 6 * 100);
    EXPECT_EQ(
        std::count_if(run.news.begin(), run.news.end(),
                      [](const std::string& line) { return line.find("not stored") != line.npos; }),
        drops);
  }
}

TEST(Budget, FirstStepGoesStraightToTheLevelThatIsExpectedToFit) {
  Solver run(bytesOf(100));
  run.budget.setLevels(levelsOf({4000, 2000, 1000, 500, 250}));
  // A tenth of what was expected everywhere: 400, 200, 100.
  EXPECT_EQ(run.step([](int level) { return 400.0 / (1 << level); }), 2);
  EXPECT_EQ(run.made, 2);
  ASSERT_EQ(run.news.size(), 1u);
  EXPECT_EQ(run.news[0],
            "cycle 1 has 0.0004 MB at quality level 1 of 5 (r0), more than [budget] bytes_per_step "
            "= 0.0001 "
            "MB: it is made again at quality level 3 of 5 (r2)");
}

TEST(Budget, EqualStepsSettleOnOneLevelForGood) {
  // However wrong the expected ratios are, and wherever the budget lies.
  for (unsigned seed = 0; seed < 100; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> ratio(0.3, 0.95), budgetAt(1.0, 120.0);
    std::array<double, 6> truth{100.0};
    for (std::size_t r = 1; r < 6; ++r) truth[r] = truth[r - 1] * ratio(random);
    Solver run(bytesOf(std::uint64_t(budgetAt(random) + 1.0)));
    run.budget.setLevels(levelsOf({100, 80, 60, 40, 20, 10}));
    std::vector<int> kept;
    for (int step = 0; step < 400; ++step)
      kept.push_back(run.step([&](int r) { return truth[std::size_t(r)]; }));
    EXPECT_EQ(std::set<int>(kept.begin() + 100, kept.end()).size(), 1u) << seed;
    const int before = run.made;
    for (int step = 0; step < 100; ++step) run.step([&](int r) { return truth[std::size_t(r)]; });
    EXPECT_EQ(run.made - before, 100) << "no step is made twice for ever, seed " << seed;
  }
}

TEST(Budget, ClimbsWhenStepsShrinkAndNotBeforeThereIsRoom) {
  Solver run(bytesOf(100));
  run.budget.setLevels(levelsOf({100, 50, 25}));
  const auto scaled = [](double scale) {
    return [scale](int level) { return scale * 100.0 / (1 << level); };
  };
  EXPECT_EQ(run.step(scaled(3.0)), 2);
  // 90 % of the budget one level above: no room.
  for (int i = 0; i < 20; ++i) EXPECT_EQ(run.step(scaled(1.8)), 2);
  for (int i = 0; i < Budget::kPatience; ++i) EXPECT_EQ(run.step(scaled(1.5)), 2);
  EXPECT_EQ(run.step(scaled(1.5)), 1);
  for (int i = 0; i < 10; ++i) run.step(scaled(0.5));
  EXPECT_EQ(run.budget.level(), 0);
  EXPECT_EQ(run.news.size(), 3u) << "one sentence a change";
}

TEST(Budget, StepsThatGoUpAndDownAreNotFollowedUpAndDown) {
  Solver run(bytesOf(100));
  run.budget.setLevels(levelsOf({100, 50}));
  int changes = 0, last = 0;
  for (int i = 0; i < 600; ++i) {
    // Five small steps, then a large one.
    const double scale = i % 6 == 5 ? 1.5 : 0.7;
    const int level = run.step([&](int r) { return scale * 100.0 / (1 << r); });
    changes += level != last;
    last = level;
  }
  EXPECT_LT(changes, 20);
}

TEST(Budget, EqualSequencesTakeEqualLevelsAtAnySpeed) {
  std::vector<int> taken[2];
  for (int speed = 0; speed < 2; ++speed) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> scale(0.2, 3.0);
    Solver run(bytesOf(100));
    run.budget.setLevels(levelsOf({100, 60, 30, 10}));
    for (int i = 0; i < 200; ++i) {
      const double s = scale(random);
      taken[speed].push_back(
          run.step([&](int r) { return s * 100.0 / (1 + r * r); }, speed == 0 ? 0.0 : 10.0));
    }
  }
  EXPECT_EQ(taken[0], taken[1]);
}

// --- time ----------------------------------------------------------------------------------------

/// A solver of `solver` seconds a step, each of which is due.
int simulate(Solver& run, int steps, double solver, const std::function<double(int)>& seconds) {
  int stored = 0;
  for (int i = 0; i < steps; ++i) {
    run.now += solver;
    if (!run.budget.hasTime()) {
      run.budget.skip(++run.cycle);
      continue;
    }
    run.step([](int) { return 1.0; }, seconds(run.budget.level()));
    ++stored;
  }
  return stored;
}

TEST(Budget, TimeShareIsKeptByStoringFewerSteps) {
  for (const double share : {0.05, 0.2, 0.5, 1.0}) {
    Solver run({std::nullopt, share});
    run.budget.setLevels(levelsOf({100, 50}));
    const int stored = simulate(run, 1000, 1.0, [](int) { return 0.7; });
    const double spent = 0.7 * stored;
    EXPECT_LE(spent, share * run.now + 0.7) << "but for the first step";
    EXPECT_GE(spent, std::min(share * run.now, 700.0) - 1.5) << "what is granted is used";
    EXPECT_EQ(run.budget.level(), 0) << "nobody asked for a cadence: it goes alone";
  }
}

TEST(Budget, CadenceThatIsAskedForGivesWayToCheaperLevelsInTheEnd) {
  Solver run({std::nullopt, 0.1}, true);
  run.budget.setLevels(levelsOf({100, 50, 25}));
  // At the first level 18 steps are skipped for each stored one, then 9, then 4.5.
  const auto seconds = [](int level) { return 2.0 / (1 << level); };
  simulate(run, 2000, 1.0, seconds);
  EXPECT_EQ(run.budget.level(), 2);
  const std::size_t changes = run.news.size();
  int stored = simulate(run, 1000, 1.0, seconds);
  EXPECT_NEAR(stored, 1000 / 4.5, 5.0);
  // The first level's costs are known: it is not tried again.
  EXPECT_EQ(run.budget.level(), 2);
  EXPECT_EQ(std::count_if(
                run.news.begin() + std::ptrdiff_t(changes), run.news.end(),
                [](const std::string& line) { return line.find("quality level") != line.npos; }),
            0);
  // A solver that becomes slower leaves room.
  simulate(run, 4000, 50.0, seconds);
  EXPECT_EQ(run.budget.level(), 0);
}

TEST(Budget, WhatOpeningTakesCountsAndTheFirstStepIsStoredAllTheSame) {
  Solver run({std::nullopt, 0.5});
  run.budget.begin();
  run.now += 10.0;
  run.budget.end();
  EXPECT_TRUE(run.budget.hasTime());
  run.step([](int) { return 1.0; }, 2.0);
  EXPECT_FALSE(run.budget.hasTime());
  run.now = 25.9;
  EXPECT_FALSE(run.budget.hasTime()) << "12 s and 2 more of 27.9 are more than half";
  run.now = 26.1;
  EXPECT_TRUE(run.budget.hasTime());
}

TEST(Budget, StepsPassedOverAreCountedOnceACycleAndSaidOnceAStretch) {
  Solver run({std::nullopt, 0.01});
  run.step([](int) { return 1.0; }, 1.0);
  for (int cycle = 2; cycle < 10; ++cycle) {
    EXPECT_FALSE(run.budget.hasTime());
    run.budget.skip(cycle);
    run.budget.skip(cycle);
  }
  EXPECT_EQ(run.budget.passedOver(), 8);
  EXPECT_DOUBLE_EQ(run.budget.secondsNeeded(), 100.0);
  const auto news = run.budget.takeNews();
  ASSERT_EQ(news.size(), 1u);
  EXPECT_NE(news[0].second.find("cycle 2 is skipped"), std::string::npos);
  EXPECT_NE(news[0].second.find("time_share = 0.01"), std::string::npos);
}

// --- the levelsOf
// ----------------------------------------------------------------------------------

StepExtent extentOf(double side) {
  StepExtent extent;
  extent.samples = side * side * side;
  extent.stackPixels = [side](const Config& config) {
    const double pixels = std::min(side, double(config.sliced->pixels));
    return (config.sliced->stacks == "axes" ? 3.0 : 1.0) * pixels * pixels;
  };
  return extent;
}

std::vector<Level> levelsFor(const std::string& text, double side = 256.0) {
  return qualityLevelsOf(configFromText(text, "run.toml"), extentOf(side));
}

constexpr const char* kBytes = "[budget]\nbytes_per_step = '1 MB'\n";

TEST(QualityLevels, WithoutABudgetIsWhatTheConfigurationSays) {
  const auto levelsOf = levelsFor("[image]\nproxies = ['sliced', 'mip']\n");
  ASSERT_EQ(levelsOf.size(), 1u);
  EXPECT_TRUE(levelsOf[0].config.mip && levelsOf[0].config.sliced && !levelsOf[0].config.length);
}

TEST(QualityLevels, BeginsWithWhatIsAskedForAndTakesFewerBytesAtEachLevel) {
  for (const char* proxies : {"'sliced'", "'field'", "'length', 'depth'", "'layered', 'reference'",
                              "'sliced', 'reference', 'field', 'length', 'layered'"}) {
    const auto levelsOf = levelsFor(std::string(kBytes) + "[image]\nproxies = [" + proxies + "]\n");
    ASSERT_GT(levelsOf.size(), 2u) << proxies;
    EXPECT_EQ(levelsOf[0].config.size, (ImageSize{512, 512}));
    EXPECT_EQ(levelsOf[0].config.fieldTolerance, 0.01);
    EXPECT_EQ(levelsOf[0].config.layers, 4);
    if (levelsOf[0].config.sliced) {
      EXPECT_EQ(levelsOf[0].config.sliced->stacks, "axes");
      EXPECT_EQ(levelsOf[0].config.sliced->slabs, 20);
      EXPECT_EQ(levelsOf[0].config.sliced->levels, 32);
    }
    std::set<std::string> names;
    for (std::size_t i = 0; i < levelsOf.size(); ++i) {
      names.insert(levelsOf[i].name);
      if (i > 0) {
        EXPECT_LT(sumOf(levelsOf[i].bytes), sumOf(levelsOf[i - 1].bytes)) << proxies;
      }
      // The tiers that are asked for stay.
      EXPECT_EQ(levelsOf[i].config.sliced.has_value(), levelsOf[0].config.sliced.has_value());
      EXPECT_EQ(levelsOf[i].config.field, levelsOf[0].config.field);
      EXPECT_EQ(levelsOf[i].config.length, levelsOf[0].config.length);
    }
    EXPECT_EQ(names.size(), levelsOf.size()) << "each has a name of its own";
    EXPECT_LT(sumOf(levelsOf.back().bytes), 0.2 * sumOf(levelsOf.front().bytes)) << proxies;
  }
}

TEST(QualityLevels, LeavesWhatTheConfigurationFixes) {
  const std::string sliced = std::string(kBytes) + "[image]\nproxies = ['sliced']\n[sliced]\n";
  for (const Level& level : levelsFor(sliced + "slabs = 24\n")) {
    EXPECT_EQ(level.config.sliced->slabs, 24);
  }
  for (const Level& level : levelsFor(sliced + "levels = 128\nstacks = 'left'\n")) {
    EXPECT_EQ(level.config.sliced->levels, 128);
    EXPECT_EQ(level.config.sliced->stacks, "left");
  }
  for (const Level& level : levelsFor(sliced + "pixels = 300\n")) {
    EXPECT_EQ(level.config.sliced->pixels, 300);
  }
  EXPECT_EQ(levelsFor(sliced + "slabs = 20\nlevels = 32\nstacks = 'axes'\npixels = 512\n").size(),
            1u);
  const std::string field = std::string(kBytes) + "[image]\nproxies = ['field']\n[reduced_field]\n";
  for (const Level& level : levelsFor(field + "tolerance = 0.05\n")) {
    EXPECT_EQ(level.config.fieldTolerance, 0.05);
  }
  for (const Level& level : levelsFor(field + "absolute_tolerance = 0.5\n")) {
    EXPECT_EQ(level.config.fieldAbsoluteError, 0.5);
  }
  for (const Level& level : levelsFor(field + "reduction = 2\n")) {
    EXPECT_EQ(level.config.fieldReduction, 2);
  }
  const std::string layered = std::string(kBytes) + "[image]\nproxies = ['layered']\n";
  for (const Level& level : levelsFor(layered + "width = 640\n[layered]\nlayers = 8\n")) {
    EXPECT_EQ(level.config.size, (ImageSize{640, 512}));
    EXPECT_EQ(level.config.layers, 8);
  }
  for (const Level& level : levelsFor(layered + "[layered]\nlayers = 8\n")) {
    EXPECT_EQ(level.config.layers, 8);
  }
}

TEST(QualityLevels, ChoosesTheTierByTheFrontierOfTheGridWhereNoneIsNamed) {
  // A small grid is best stored as it is; pictures of a large one are smaller by far.
  const auto small = levelsFor(kBytes, 64.0), large = levelsFor(kBytes, 2048.0);
  const auto stacksIn = [](const std::vector<Level>& levelsOf) {
    return std::count_if(levelsOf.begin(), levelsOf.end(),
                         [](const Level& level) { return level.config.sliced.has_value(); });
  };
  EXPECT_GT(stacksIn(large), stacksIn(small));
  EXPECT_TRUE(small.front().config.field);
  for (const auto& levelsOf : {small, large}) {
    for (const Level& level : levelsOf) {
      EXPECT_NE(level.config.field, level.config.sliced.has_value()) << level.name;
      EXPECT_TRUE(level.config.reference && !level.config.length);
    }
  }
  // Of the field no view may have the name.
  for (const Level& level :
       levelsFor(std::string(kBytes) + "[[view]]\nname = 'volume'\ndirection = [0, 1, 0]\n")) {
    EXPECT_FALSE(level.config.field);
  }
  // A share of time alone leaves the tiers as they are.
  EXPECT_TRUE(levelsFor("[budget]\ntime_share = 0.1\n").back().config.length);
}

}  // namespace
}  // namespace vestige
