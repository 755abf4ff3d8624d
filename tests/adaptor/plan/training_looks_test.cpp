// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/plan/training_looks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace vestige {
namespace {

const IntervalPartition kPartition = IntervalPartition::uniform(0.0, 1.0, 10);

TransferFunction function(std::vector<OpacityPoint> points) {
  return TransferFunction(std::move(points), 0.1, Colormap::named("viridis"), 0.0, 1.0);
}

/// Functions with ramps, jumps on and beside bounds, points beyond the partition.
std::vector<TransferFunction> someFunctions() {
  return {TransferFunction::ramp(0.0, 1.0, 0.1), function({{0.3, 0.4}}),
          function({{0.25, 0.0}, {0.5, 0.2}, {0.5, 0.7}, {0.61, 0.1}, {1.0, 0.9}}),
          function({{-1.0, 0.9}, {0.5, 0.1}, {2.0, 0.5}}),
          function({{0.0, 0.1}, {0.4, 0.1}, {0.4, 0.6}, {0.6, 0.6}, {0.6, 0.0}, {0.9, 0.8}})};
}

TEST(TrainingLooks, EachValueHasItsOpacityOrTheScaledOne) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> values(-0.5, 1.5);
  for (const TransferFunction& base : someFunctions()) {
    for (int pictures = 1; pictures <= 4; ++pictures) {
      const auto looks = trainingLooks(base, kPartition, pictures, 0.25);
      ASSERT_EQ(int(looks.size()), pictures);
      EXPECT_EQ(looks[0].opacityPoints(), base.opacityPoints());
      for (int i = 0; i < 200; ++i) {
        const double value = values(random);
        int scaled = 0;
        for (std::size_t j = 1; j < looks.size(); ++j) {
          const double got = looks[j].opacity(value), whole = base.opacity(value);
          if (std::abs(got - 0.25 * whole) < 1e-12 && whole > 0.0) {
            ++scaled;
          } else {
            EXPECT_NEAR(got, whole, 1e-12) << value;
          }
        }
        EXPECT_LE(scaled, 1) << "groups do not overlap";
        // Three and four pictures have a group for every value; two leave the upper half alone.
        if (base.opacity(value) > 0.0 && pictures >= 3) {
          EXPECT_EQ(scaled, 1) << value;
        }
      }
    }
  }
}

TEST(TrainingLooks, GroupsHoldAboutEquallyManyVisibleIntervals) {
  const TransferFunction base = function({{0.4, 0.0}, {0.4, 0.5}});  // 6 of 10 intervals
  const auto looks = trainingLooks(base, kPartition, 4, 0.0);
  for (std::size_t j = 1; j < 4; ++j) {
    const auto extinction = looks[j].onIntervals(kPartition).extinction;
    EXPECT_EQ(std::count(extinction.begin() + 4, extinction.begin() + 10, 0.0), 2) << j;
  }
}

TEST(TrainingLooks, AreFewerWhereLittleIsVisible) {
  EXPECT_EQ(trainingLooks(function({}), kPartition, 4, 0.1).size(), 1u);
  const TransferFunction one = function({{0.3, 0.0}, {0.3, 0.5}, {0.4, 0.5}, {0.4, 0.0}});
  EXPECT_EQ(trainingLooks(one, kPartition, 4, 0.1).size(), 2u);
}

}  // namespace
}  // namespace vestige
