// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/run/trigger.h"

#include <gtest/gtest.h>

namespace vestige {
namespace {

FieldStatistics withMean(double mean) {
  FieldStatistics statistics;
  statistics.count = 10;
  statistics.mean = mean;
  return statistics;
}

/// The cycles that a run of `cycles` cycles of Δt = 0.1 stores, when the mean is mean(cycle).
template <class Mean>
std::vector<std::int64_t> storedCycles(const TriggerConfig& config, int first, int cycles,
                                       const Mean& mean) {
  Trigger trigger(config);
  std::vector<std::int64_t> stored;
  double time = 0.0;
  for (int cycle = first; cycle < first + cycles; ++cycle, time += 0.1) {
    const auto statistics = [&](const std::string&) { return withMean(mean(cycle)); };
    const bool may = trigger.mayFire(cycle, time);
    const bool fires = trigger.fires(cycle, time, statistics);
    EXPECT_TRUE(may || !fires) << "a step would be stored that nobody was asked for";
    if (!fires) continue;
    trigger.stored(cycle, time, statistics);
    stored.push_back(cycle);
  }
  return stored;
}

using Cycles = std::vector<std::int64_t>;
double still(int) { return 0.0; }

TEST(Trigger, WithoutRulesEveryStepIsStored) {
  EXPECT_EQ(storedCycles({}, 5, 3, still), (Cycles{5, 6, 7}));
}

TEST(Trigger, EveryNCyclesAndTheFirst) {
  TriggerConfig config;
  config.everyCycles = 4;
  EXPECT_EQ(storedCycles(config, 3, 10, still), (Cycles{3, 4, 8, 12}));
}

TEST(Trigger, EveryTimeFollowsMultiplesInSpiteOfRounding) {
  TriggerConfig config;
  config.everyTime = 0.3;
  EXPECT_EQ(storedCycles(config, 0, 31, still), (Cycles{0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30}));
}

TEST(Trigger, EveryTimeWithStepsLongerThanTheInterval) {
  TriggerConfig config;
  config.everyTime = 0.03;
  EXPECT_EQ(storedCycles(config, 0, 4, still), (Cycles{0, 1, 2, 3}));
}

TEST(Trigger, ChangeOfAStatisticSinceTheLastStoredStep) {
  TriggerConfig config;
  config.change = {"t", TriggerConfig::Measure::Mean, 2.5, 1};
  EXPECT_EQ(storedCycles(config, 0, 10, [](int cycle) { return double(cycle); }),
            (Cycles{0, 3, 6, 9}));
  EXPECT_EQ(storedCycles(config, 0, 10, still), (Cycles{0}));
  config.change->everyCycles = 5;
  EXPECT_EQ(storedCycles(config, 0, 11, [](int cycle) { return double(cycle); }),
            (Cycles{0, 5, 10}));
}

TEST(Trigger, AnyRuleSuffices) {
  TriggerConfig config;
  config.everyCycles = 7;
  config.change = {"t", TriggerConfig::Measure::Mean, 2.5, 1};
  EXPECT_EQ(storedCycles(config, 0, 10, [](int cycle) { return double(cycle); }),
            (Cycles{0, 3, 6, 7}));
}

TEST(Trigger, StepsThatWereLostAreTriedAgain) {
  TriggerConfig config;
  config.everyCycles = 100;
  Trigger trigger(config);
  const auto statistics = [](const std::string&) { return FieldStatistics{}; };
  EXPECT_TRUE(trigger.fires(1, 0.1, statistics));
  EXPECT_TRUE(trigger.fires(2, 0.2, statistics));  // nothing was stored yet
  trigger.stored(2, 0.2, statistics);
  EXPECT_FALSE(trigger.mayFire(3, 0.3));
}

FieldStatistics withHistogram(double low, double high, std::vector<std::uint64_t> bins) {
  FieldStatistics statistics;
  statistics.low = low;
  statistics.high = high;
  for (const auto bin : bins) statistics.count += bin;
  statistics.histogram = std::move(bins);
  return statistics;
}

TEST(Trigger, HistogramsAreComparedAsDistributions) {
  const auto measure = TriggerConfig::Measure::Histogram;
  const auto a = withHistogram(0.0, 1.0, {1, 1, 1, 1});
  EXPECT_NEAR(changeBetween(a, a, measure), 0.0, 1e-12);
  EXPECT_NEAR(changeBetween(a, withHistogram(0.0, 1.0, {2, 2, 2, 2}), measure), 0.0, 1e-12);
  EXPECT_NEAR(changeBetween(a, withHistogram(0.0, 1.0, {4, 0, 0, 0}), measure), 0.75, 1e-12);
  EXPECT_NEAR(changeBetween(a, withHistogram(5.0, 6.0, {1, 1, 1, 1}), measure), 1.0, 1e-12);
  EXPECT_NEAR(changeBetween(a, withHistogram(1.0, 2.0, {1, 1, 1, 1}), measure), 1.0, 1e-12);
  EXPECT_NEAR(
      changeBetween(withHistogram(2.0, 2.0, {3, 0}), withHistogram(2.0, 2.0, {5, 0}), measure), 0.0,
      1e-12);
  EXPECT_NEAR(changeBetween(withHistogram(0.0, 0.0, {}), a, measure), 1.0, 1e-12);
}

}  // namespace
}  // namespace vestige
