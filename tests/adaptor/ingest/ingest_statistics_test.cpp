// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/ingest/ingest_statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "adaptor/run/settled.h"

namespace vestige {
namespace {

/// A field over a grid of 21 x 12 x 9 points; blocks are windows into it.
struct Sample {
  std::array<int, 3> size{21, 12, 9};
  std::vector<double> data;

  Sample() {
    for (int i = 0; i < 21 * 12 * 9; ++i) data.push_back(std::sin(0.37 * i) + 101325.0);
  }
  FieldPart part(int x0, int x1, int ownLow, int ownHigh) const {
    FieldView field;
    field.type = SampleType::Float64;
    field.size = {x1 - x0, 12, 9};
    field.strides = {8, 8 * 21, 8 * 21 * 12};
    field.components = {reinterpret_cast<const std::byte*>(data.data() + x0)};
    return {FieldReader(field, {}, {}, {}), {{ownLow, 0, 0}, {ownHigh, 12, 9}}, {}};
  }
};

TEST(IngestStatistics, AreThoseOfTheDefinition) {
  const Sample sample;
  const auto result = measureField({sample.part(0, 21, 0, 21)}, 2);
  const double n = double(sample.data.size());
  double mean = 0.0, squares = 0.0;
  for (const double v : sample.data) mean += (v - 101325.0) / n;
  for (const double v : sample.data) squares += std::pow(v - 101325.0 - mean, 2) / n;
  EXPECT_EQ(result.count, sample.data.size());
  EXPECT_EQ(result.noData, 0u);
  EXPECT_EQ(result.low, *std::min_element(sample.data.begin(), sample.data.end()));
  EXPECT_EQ(result.high, *std::max_element(sample.data.begin(), sample.data.end()));
  EXPECT_NEAR(result.mean - 101325.0, mean, 1e-9);
  EXPECT_NEAR(result.deviation, std::sqrt(squares), 1e-9);
  ASSERT_EQ(result.histogram.size(), std::size_t(kHistogramBins));
  EXPECT_EQ(std::accumulate(result.histogram.begin(), result.histogram.end(), 0ull), result.count);
}

TEST(IngestStatistics, DoNotDependOnThreads) {
  const Sample sample;
  EXPECT_EQ(measureField({sample.part(0, 21, 0, 21)}, 1),
            measureField({sample.part(0, 21, 0, 21)}, 5));
}

TEST(IngestStatistics, DoNotDependOnHowTheDomainIsSplit) {
  const Sample sample;
  const auto whole = measureField({sample.part(0, 21, 0, 21)}, 1);
  // Two blocks with a ghost layer each: own points 0..9 and 10..20.
  const auto split = measureField({sample.part(0, 12, 0, 10), sample.part(9, 21, 1, 12)}, 2);
  EXPECT_EQ(split.count, whole.count);
  EXPECT_EQ(split.low, whole.low);
  EXPECT_EQ(split.high, whole.high);
  EXPECT_EQ(split.histogram, whole.histogram);
  EXPECT_NEAR(split.mean, whole.mean, 1e-9);
  EXPECT_NEAR(split.deviation, whole.deviation, 1e-9);
}

TEST(IngestStatistics, TheirRangeHoldsWhatIsInterpolatedOnFacesEdgesAndCorners) {
  // Own samples are 0; the ghost at one corner is not: only the box's corner sees it.
  Sample sample;
  std::fill(sample.data.begin(), sample.data.end(), 0.0);
  const auto at = [&](int x, int y, int z) -> double& {
    return sample.data[std::size_t(x + 21 * (y + 12 * z))];
  };
  auto part = sample.part(0, 21, 1, 20);
  part.own = {{1, 1, 1}, {20, 11, 8}};
  part.faces = {{{{0, 0.5}, {19, 0.5}}, {{0, 0.5}, {10, 0.25}}, {{0, 0.5}, {7, 0.5}}}};
  EXPECT_EQ(measureField({part}, 2).high, 0.0);
  for (const auto& [place, high] :
       std::vector<std::pair<std::array<int, 3>, double>>{{{20, 11, 8}, 0.0625},
                                                          {{0, 0, 0}, 0.125},
                                                          {{20, 11, 4}, 0.125},
                                                          {{5, 0, 0}, 0.25},
                                                          {{0, 5, 5}, 0.5},
                                                          {{7, 11, 4}, 0.25},
                                                          {{7, 7, 8}, 0.5},
                                                          {{7, 7, 4}, 1.0}}) {
    at(place[0], place[1], place[2]) = 1.0;
    const auto result = measureField({part}, 2);
    EXPECT_EQ(result.high, high) << place[0] << ' ' << place[1] << ' ' << place[2];
    EXPECT_EQ(result.low, 0.0);
    EXPECT_EQ(result.count, 19u * 10 * 7);
    EXPECT_EQ(std::accumulate(result.histogram.begin(), result.histogram.end(), 0ull),
              result.count);
    at(place[0], place[1], place[2]) = -1.0;
    EXPECT_EQ(measureField({part}, 2).low, -high);
    at(place[0], place[1], place[2]) = std::nan("");
    EXPECT_EQ(measureField({part}, 2).high, 0.0);
    at(place[0], place[1], place[2]) = 0.0;
  }
}

TEST(IngestStatistics, CountWhatHasNoData) {
  Sample sample;
  sample.data[5] = std::numeric_limits<double>::quiet_NaN();
  sample.data[6] = std::numeric_limits<double>::infinity();
  const auto result = measureField({sample.part(0, 21, 0, 21)}, 2);
  EXPECT_EQ(result.noData, 2u);
  EXPECT_TRUE(std::isfinite(result.high));
}

TEST(IngestStatistics, TakeConstantAndEmptyAndMissingFields) {
  Sample sample;
  std::fill(sample.data.begin(), sample.data.end(), 0.1);
  const auto constant = measureField({sample.part(0, 21, 0, 21)}, 2);
  EXPECT_EQ(constant.low, 0.1);
  EXPECT_EQ(constant.high, 0.1);
  EXPECT_EQ(constant.mean, 0.1);
  EXPECT_NEAR(constant.deviation, 0.0, 1e-15);
  EXPECT_EQ(constant.histogram[0], constant.count);

  std::fill(sample.data.begin(), sample.data.end(), std::nan(""));
  const auto missing = measureField({sample.part(0, 21, 0, 21)}, 2);
  EXPECT_EQ(missing.noData, missing.count);
  EXPECT_EQ(missing.low, 0.0);

  EXPECT_EQ(measureField({}, 2).count, 0u);
  EXPECT_EQ(measureField({sample.part(0, 21, 3, 3)}, 2).count, 0u);
}

TEST(IngestStatistics, TakeRangesThatOverflow) {
  Sample sample;
  sample.data[0] = -1.7e308;
  sample.data[1] = 1.7e308;
  const auto result = measureField({sample.part(0, 21, 0, 21)}, 1);
  EXPECT_EQ(result.high, 1.7e308);
  EXPECT_EQ(std::accumulate(result.histogram.begin(), result.histogram.end(), 0ull), result.count);
}

TEST(IngestStatistics, CountWhatIsOutsideOfIntervals) {
  const Sample sample;
  const auto all = {sample.part(0, 12, 0, 10), sample.part(9, 21, 1, 12)};
  const double low = 101324.7, high = 101325.2;
  const auto result = measureField(all, 2, std::pair(low, high));
  const auto count = [&](auto wanted) {
    return std::uint64_t(std::count_if(sample.data.begin(), sample.data.end(), wanted));
  };
  EXPECT_EQ(result.below, count([&](double v) { return v < low; }));
  EXPECT_EQ(result.above, count([&](double v) { return v > high; }));
  EXPECT_GT(result.shareOutside(), 0.1);
  EXPECT_EQ(measureField(all, 2).shareOutside(), 0.0) << "no intervals are known";
  EXPECT_EQ(measureField(all, 2, std::pair(0.0, 1e6)).shareOutside(), 0.0);
}

TEST(IngestStatistics, HoldHugeAndTinyDeviations) {
  for (const double scale : {1e300, 1e-300, 1e160, 1e-160}) {
    Sample sample;
    for (std::size_t i = 0; i < sample.data.size(); ++i)
      sample.data[i] = scale * std::sin(0.37 * double(i));
    const auto result = measureField({sample.part(0, 21, 0, 21)}, 2);
    EXPECT_NEAR(result.deviation / scale, std::sqrt(0.5), 0.01) << scale;
    EXPECT_NEAR(result.high / scale, 1.0, 0.01);
    EXPECT_GT(result.histogram[128], 0u) << "not all in one bin";
  }
}

TEST(Outgrowing, IsMoreThanRounding) {
  const auto intervals = IntervalPartition::uniform(0.0, 1.0, 16);
  FieldStatistics statistics;
  statistics.count = 100;
  statistics.below = 10;
  statistics.high = 0.9;
  statistics.low = -1e-8;
  EXPECT_FALSE(outgrows(statistics, intervals));
  statistics.low = -0.01;
  EXPECT_TRUE(outgrows(statistics, intervals));
  statistics.below = 1;
  EXPECT_FALSE(outgrows(statistics, intervals));
}

}  // namespace
}  // namespace vestige
