// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/transfer/interval_partition.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "proxy/base/error.h"

namespace vestige {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLargest = std::numeric_limits<double>::max();

void expectIncreasing(const IntervalPartition& p) {
  for (int k = 0; k < p.intervals(); ++k) ASSERT_LT(p.bounds()[k], p.bounds()[k + 1]);
}

TEST(IntervalPartition, PutsEveryValueIntoExactlyOneChannel) {
  std::mt19937_64 engine(3);
  for (int i = 0; i < 200; ++i) {
    const double scale = std::pow(10.0, int(engine() % 13) - 6.0);
    const double low = std::uniform_real_distribution(-scale, scale)(engine);
    const int intervals = 1 + int(engine() % 64);
    const auto p = IntervalPartition::uniform(low, low + scale, intervals);
    expectIncreasing(p);
    for (int n = 0; n < 50; ++n) {
      const double v = std::uniform_real_distribution(low - scale, low + 2 * scale)(engine);
      const int c = p.channelOf(v);
      if (v < p.low()) {
        EXPECT_EQ(c, p.below());
      } else if (v > p.high()) {
        EXPECT_EQ(c, p.above());
      } else {
        ASSERT_TRUE(c >= 0 && c < intervals);
        EXPECT_GE(v, p.bounds()[c]);
        EXPECT_TRUE(v < p.bounds()[c + 1] || (c == intervals - 1 && v == p.high()));
      }
    }
  }
}

TEST(IntervalPartition, ClosesTheLastIntervalOnly) {
  const auto p = IntervalPartition::fromBounds({0.0, 1.0, 4.0});
  EXPECT_EQ(p.channelOf(0.0), 0);
  EXPECT_EQ(p.channelOf(std::nextafter(1.0, 0.0)), 0);
  EXPECT_EQ(p.channelOf(1.0), 1);
  EXPECT_EQ(p.channelOf(4.0), 1);
  EXPECT_EQ(p.channelOf(std::nextafter(4.0, 5.0)), p.above());
  EXPECT_EQ(p.channelOf(-1e-300), p.below());
}

TEST(IntervalPartition, CallsNaNAndInfinitiesNoData) {
  const auto p = IntervalPartition::uniform(0.0, 1.0, 4);
  for (const double v : {kNaN, kInfinity, -kInfinity}) EXPECT_EQ(p.channelOf(v), p.noData());
}

TEST(IntervalPartition, OrdersAndNamesItsChannels) {
  const auto p = IntervalPartition::uniform(0.0, 1.0, 12);
  EXPECT_EQ(p.channels(), 15);
  EXPECT_EQ(p.channelName(0), "i00");
  EXPECT_EQ(p.channelName(11), "i11");
  EXPECT_EQ(p.channelName(12), "below");
  EXPECT_EQ(p.channelName(13), "above");
  EXPECT_EQ(p.channelName(14), "nodata");
  EXPECT_THROW(p.channelName(15), Error);
  EXPECT_THROW(p.channelName(-1), Error);
}

TEST(IntervalPartition, GivesConstantFieldsARangeAroundTheirValue) {
  for (const double v : {0.0, 1.0, -273.15, 101325.0, 1e-300, -1e-310, 1e300, kLargest / 2}) {
    const auto p = IntervalPartition::uniform(v, v, 16);
    expectIncreasing(p);
    EXPECT_LT(p.low(), v);
    EXPECT_GT(p.high(), v);
    EXPECT_TRUE(std::isfinite(p.high() - p.low()));
    EXPECT_NEAR(p.normalised(v), 0.5, 0.26);
  }
}

TEST(IntervalPartition, KeepsSmallVariationsOnLargeValues) {
  const auto p = IntervalPartition::uniform(101324.99, 101325.01, 16);
  EXPECT_EQ(p.low(), 101324.99);
  EXPECT_EQ(p.high(), 101325.01);
  EXPECT_NEAR(p.normalised(101325.0), 0.5, 1e-8);
  EXPECT_EQ(p.channelOf(p.denormalised(0.97)), 15);
  EXPECT_NEAR(p.denormalised(p.normalised(101325.003)), 101325.003, 1e-10);
}

TEST(IntervalPartition, WidensRangesThatDoublesCannotDivide) {
  const double next = std::nextafter(1.0, 2.0);
  const auto p = IntervalPartition::uniform(1.0, next, 64);
  expectIncreasing(p);
  EXPECT_LE(p.low(), 1.0);
  EXPECT_GE(p.high(), next);
}

TEST(IntervalPartition, QuantilesHoldEquallyManySamples) {
  std::mt19937_64 engine(5);
  std::vector<double> data(100000);
  for (double& v : data) v = std::exp(std::normal_distribution(0.0, 1.0)(engine));
  const auto [low, high] = std::minmax_element(data.begin(), data.end());
  std::vector<std::uint64_t> bins(4096);
  for (const double v : data)
    ++bins[std::min<std::size_t>(4095, std::size_t((v - *low) / (*high - *low) * 4096))];
  const auto p = IntervalPartition::quantiles(*low, *high, bins, 8);
  EXPECT_EQ(p.low(), *low);
  EXPECT_EQ(p.high(), *high);
  std::vector<int> counts(p.channels());
  for (const double v : data) ++counts[p.channelOf(v)];
  for (int k = 0; k < 8; ++k) EXPECT_NEAR(counts[k], 12500, 300);
}

TEST(IntervalPartition, QuantilesSurviveRepeatedValues) {
  std::vector<std::uint64_t> bins(256, 0);
  for (const std::size_t spike : {std::size_t(0), std::size_t(77), std::size_t(255)}) {
    std::fill(bins.begin(), bins.end(), 0);
    bins[spike] = std::uint64_t(1) << 63;
    bins[128] += 1;
    for (const double scale : {1e-6, 1.0, 1e6}) {
      const auto p = IntervalPartition::quantiles(-scale, 2 * scale, bins, 64);
      EXPECT_EQ(p.intervals(), 64);
      expectIncreasing(p);
    }
  }
  expectIncreasing(IntervalPartition::quantiles(5.0, 5.0, bins, 64));
  expectIncreasing(IntervalPartition::quantiles(1.0, std::nextafter(1.0, 2.0), bins, 64));
}

TEST(IntervalPartition, QuantilesOfNothingAreUniform) {
  EXPECT_EQ(IntervalPartition::quantiles(0.0, 1.0, {}, 4), IntervalPartition::uniform(0.0, 1.0, 4));
  const std::vector<std::uint64_t> empty(16, 0);
  EXPECT_EQ(IntervalPartition::quantiles(0.0, 1.0, empty, 4),
            IntervalPartition::uniform(0.0, 1.0, 4));
}

template <class Make>
void expectRefused(Make make) {
  try {
    make();
    ADD_FAILURE() << "was accepted";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::InvalidArgument);
  }
}

TEST(IntervalPartition, RefusesRangesAndBoundsThatAreNone) {
  expectRefused([] { IntervalPartition::uniform(0, 1, 0); });
  expectRefused([] { IntervalPartition::uniform(0, 1, 65); });
  expectRefused([] { IntervalPartition::uniform(1, 0, 4); });
  expectRefused([] { IntervalPartition::uniform(kNaN, 1, 4); });
  expectRefused([] { IntervalPartition::uniform(0, kInfinity, 4); });
  expectRefused([] { IntervalPartition::uniform(-kLargest, kLargest, 4); });
  expectRefused([] { IntervalPartition::fromBounds({}); });
  expectRefused([] { IntervalPartition::fromBounds({1.0}); });
  expectRefused([] { IntervalPartition::fromBounds({1.0, 1.0}); });
  expectRefused([] { IntervalPartition::fromBounds({1.0, 0.0}); });
  expectRefused([] { IntervalPartition::fromBounds({0.0, kNaN}); });
  expectRefused([] { IntervalPartition::fromBounds({-kLargest, kLargest}); });
  expectRefused([] { IntervalPartition::fromBounds(std::vector<double>(66)); });
  expectRefused([] { IntervalPartition::quantiles(0, 1, {}, 0); });
}

TEST(IntervalPartition, PutsABoundAtZeroWhereTheRangeStraddlesIt) {
  struct Case {
    double low, high;
    int intervals, below;
  };
  for (const auto& [low, high, intervals, below] : std::vector<Case>{{-1.0, 1.0, 16, 8},
                                                                     {-1.0, 2.0, 16, 5},
                                                                     {-0.01, 1.0, 16, 1},
                                                                     {-1e6, 3.0, 8, 0},
                                                                     {-7.0, 1e-3, 4, 0},
                                                                     {-7.0, 1e-1, 4, 3},
                                                                     {-1e300, 1e300, 5, 2},
                                                                     {-2e-300, 1e-300, 3, 2},
                                                                     {-1.0, 1.0, 1, 0}}) {
    SCOPED_TRACE(testing::Message() << low << " " << high << " " << intervals);
    const auto p = IntervalPartition::uniformAroundZero(low, high, intervals);
    expectIncreasing(p);
    EXPECT_EQ(p.intervals(), intervals);
    EXPECT_EQ(p.low(), low) << "the range stays";
    EXPECT_EQ(p.high(), high);
    if (below == 0) {
      EXPECT_EQ(p, IntervalPartition::uniform(low, high, intervals));
      continue;
    }
    EXPECT_EQ(p.bounds()[std::size_t(below)], 0.0);
    for (int k = 0; k < intervals; ++k) {
      const double width = p.bounds()[std::size_t(k) + 1] - p.bounds()[std::size_t(k)];
      EXPECT_NEAR(width, k < below ? -low / below : high / (intervals - below),
                  1e-12 * (high - low));
    }
  }
  // Of one sign: as ever.
  for (const double low : {0.0, 1.0, -3.0})
    EXPECT_EQ(IntervalPartition::uniformAroundZero(low, low < 0 ? 0.0 : 5.0, 16),
              IntervalPartition::uniform(low, low < 0 ? 0.0 : 5.0, 16));
}

TEST(IntervalPartition, QuantilesHaveABoundAtZeroToo) {
  // A quarter of the samples is negative, evenly; the others crowd above zero.
  std::vector<std::uint64_t> bins(256, 0);
  for (std::size_t i = 0; i < 128; ++i) bins[i] = 10;
  for (std::size_t i = 128; i < 160; ++i) bins[i] = 120;
  const auto p = IntervalPartition::quantiles(-1.0, 1.0, bins, 8);
  expectIncreasing(p);
  EXPECT_EQ(p.bounds()[2], 0.0);
  EXPECT_NEAR(p.bounds()[1], -0.5, 0.02);
  EXPECT_NEAR(p.bounds()[5], 0.125, 0.02);
  EXPECT_EQ(p.low(), -1.0);
  EXPECT_EQ(p.high(), 1.0);
}

TEST(IntervalPartition, SaysWhetherDoublesResolveARange) {
  EXPECT_TRUE(IntervalPartition::resolves(0.0, 1.0, 64));
  EXPECT_TRUE(IntervalPartition::resolves(-1e12, -1e12 + 0.01, 16));
  EXPECT_FALSE(IntervalPartition::resolves(5.0, 5.0, 16));
  EXPECT_FALSE(IntervalPartition::resolves(1.0, std::nextafter(1.0, 2.0), 2));
}

}  // namespace
}  // namespace vestige
