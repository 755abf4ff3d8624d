// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/renderer/stated_error.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/explorer/synthetic.h"

namespace vestige {
namespace {

constexpr Asked kEdit{false, true}, kTurn{true, true}, kPlain{false, false};

ProxyHeader withIntervals(std::string_view kind, int intervals) {
  ProxyHeader header = synthetic::header(kind, {16, 16});
  header.statistics.low = 0.0;
  header.statistics.high = 1.0;
  header.partition = IntervalPartition::uniform(0.0, 1.0, intervals);
  return header;
}

ProxyHeader stackOf(int slabs, int intervals) {
  ProxyHeader header = withIntervals(kind::kSliced, intervals);
  // The domain is as deep as it is wide.
  const double middle =
      glm::dot(header.domain.center() - header.camera.position, header.camera.forward);
  const double depth = header.domain.size().y;
  for (int s = 0; s <= slabs; ++s) {
    header.slabDepths.push_back(middle + depth * (double(s) / slabs - 0.5));
  }
  return header;
}

ProxyHeader fieldOf(int samples, double tolerance, int reduction = 1) {
  ProxyHeader header = withIntervals(kind::kField, 16);
  FieldGrid grid;
  for (FieldAxis& axis : grid.axes) axis = {samples, 0.0, 1.0 / (samples - 1), {}};
  grid.tolerance = tolerance;
  grid.reduction = reduction;
  header.grid = grid;
  return header;
}

TEST(StatedError, OfStacksIsIntervalWidthAndAWholeSlab) {
  const StatedError error = statedError(stackOf(20, 16), kEdit);
  EXPECT_TRUE(error.bounded);
  EXPECT_NEAR(error.value, 1.0 / 16, 1e-12);
  EXPECT_NEAR(error.place, 1.0 / 20, 1e-9);
  EXPECT_EQ(error.text(), "values within 6.25 % of the range, places within 5 % of the depth");
  // More slabs and more intervals never state more.
  for (int slabs = 2; slabs < 64; ++slabs) {
    EXPECT_TRUE(statedError(stackOf(slabs, 16), kEdit)
                    .truerThan(statedError(stackOf(slabs - 1, 16), kEdit)));
    EXPECT_TRUE(
        statedError(stackOf(8, slabs), kEdit).truerThan(statedError(stackOf(8, slabs - 1), kEdit)));
  }
}

TEST(StatedError, CountsWhatLiesOutsideOfTheBoundsAndOnlyIntervalsThatHoldSomething) {
  ProxyHeader header = stackOf(8, 10);
  header.statistics.high = 2.0;  // half of the range is above
  EXPECT_NEAR(statedError(header, kEdit).value, 0.5, 1e-12);
  header.statistics.high = 0.05;  // in the first interval
  EXPECT_NEAR(statedError(header, kEdit).value, 1.0, 1e-12);
  header.statistics = {};  // a constant field
  EXPECT_EQ(statedError(header, kEdit).value, 0.0);
  header.partition.reset();
  EXPECT_EQ(statedError(header, kEdit).value, 1.0);
}

TEST(StatedError, OfFieldsIsToleranceWhereverTheirSamplesStand) {
  const StatedError error = statedError(fieldOf(101, 0.01), kTurn);
  EXPECT_TRUE(error.bounded);
  EXPECT_NEAR(error.value, 0.01, 1e-12);
  EXPECT_EQ(error.place, 0.0);
  EXPECT_FALSE(statedError(fieldOf(101, 0.01, 2), kEdit).bounded) << "what is small is gone";
  ProxyHeader uneven = fieldOf(3, 0.01);
  uneven.grid->axes[1] = {3, 0.0, 1.0, {0.0, 0.9, 1.0}};
  EXPECT_EQ(statedError(uneven, kEdit).place, 0.0);
  EXPECT_TRUE(statedError(uneven, kEdit).truerThan(statedError(stackOf(64, 64), kEdit)))
      << "a sea of 10 m and 500 m cells is drawn as the run has it";
  uneven.grid->reduction = 2;
  EXPECT_NEAR(statedError(uneven, kEdit).place, 0.45, 1e-12);
  ProxyHeader without = fieldOf(3, 0.01);
  without.grid.reset();
  EXPECT_FALSE(statedError(without, kEdit).bounded);
}

TEST(StatedError, OrdersTheTiersAsTheyWereMeasured) {
  const StatedError fine = statedError(fieldOf(256, 1.0 / 128), kTurn),
                    loose = statedError(fieldOf(256, 1.0 / 8), kTurn),
                    half = statedError(fieldOf(128, 1.0 / 64, 2), kTurn),
                    stack = statedError(stackOf(20, 16), kTurn),
                    flat = statedError(withIntervals(kind::kLength, 16), kEdit),
                    warped = statedError(withIntervals(kind::kLength, 16), kTurn);
  EXPECT_TRUE(fine.truerThan(stack));
  EXPECT_TRUE(stack.truerThan(loose));
  EXPECT_TRUE(stack.truerThan(half));
  EXPECT_TRUE(stack.truerThan(flat));
  EXPECT_TRUE(flat.truerThan(warped));
  EXPECT_TRUE(flat.truerThan(half));
  EXPECT_TRUE(half.truerThan(warped));
  for (const StatedError& error : {fine, loose, half, stack, flat, warped}) {
    EXPECT_FALSE(error.truerThan(error));
    EXPECT_TRUE(error.value >= 0.0 && error.value <= 1.0 && error.place >= 0.0 &&
                error.place <= 1.0);
  }
}

TEST(StatedError, BakedPicturesAreExactUntilSomethingIsAskedOfThem) {
  for (const auto kind : {kind::kReference, kind::kLayered}) {
    const ProxyHeader header = withIntervals(kind, 16);
    EXPECT_EQ(statedError(header, kPlain).text(), "exact");
    EXPECT_EQ(statedError(header, kEdit).text(), "nothing bounds what is missing");
    EXPECT_FALSE(statedError(header, {true, false}).bounded);
  }
  for (const auto kind : {kind::kAttenuation, kind::kDepth, kind::kMip}) {
    EXPECT_FALSE(statedError(withIntervals(kind, 16), kPlain).bounded);
  }
}

TEST(SampleErrors, AreTheToleranceOfAFieldAndTheIntervalOfAStack) {
  ProxyHeader header;
  header.kind = kind::kSliced;
  header.partition = IntervalPartition::fromBounds({280.0, 290.6, 340.0});
  header.statistics.low = 270.0;
  header.statistics.high = 350.0;
  EXPECT_NEAR(sampleError(header, 285.0).error, 10.6, 1e-9);
  EXPECT_NE(sampleError(header, 285.0).why.find("280 to 290.6"), std::string::npos);
  EXPECT_NEAR(sampleError(header, 300.0).error, 49.4, 1e-9);
  EXPECT_NEAR(sampleError(header, 275.0).error, 10.0, 1e-9);
  EXPECT_NEAR(sampleError(header, 345.0).error, 10.0, 1e-9);
  header.grid = FieldGrid{};
  header.grid->tolerance = 0.01;
  EXPECT_EQ(sampleError(header, 285.0).error, 0.01);
}

}  // namespace
}  // namespace vestige
