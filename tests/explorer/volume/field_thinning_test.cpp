// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/volume/field_thinning.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace vestige {
namespace {

FieldSamples ramp(int count) {
  FieldSamples field{{}, 0.0, 1.0, {}};
  field.axes = {FieldAxis{2, 0.0, 1.0, {}}, FieldAxis{count, 5.0, 0.5, {}},
                FieldAxis{3, 0.0, 1.0, {}}};
  for (int z = 0; z < 3; ++z)
    for (int y = 0; y < count; ++y)
      for (int x = 0; x < 2; ++x)
        field.values.push_back(float(y) / float(count - 1) + float(x + z));
  return field;
}

TEST(FieldThinning, WhatFitsIsLeftAsItIs) {
  const FieldSamples field = thinned(ramp(10), 10);
  EXPECT_EQ(field.values, ramp(10).values);
  EXPECT_EQ(field.axes[1].count, 10);
}

TEST(FieldThinning, LongAxesKeepTheirEndsAndLinearFieldsTheirValues) {
  const FieldSamples field = thinned(ramp(1000), 300);
  ASSERT_EQ(field.axes[1].count, 300);
  EXPECT_EQ(field.axes[1].at(0), 5.0);
  EXPECT_NEAR(field.axes[1].at(299), 5.0 + 0.5 * 999, 1e-9);
  ASSERT_EQ(field.values.size(), 2u * 300u * 3u);
  for (int z = 0; z < 3; ++z)
    for (int y = 0; y < 300; ++y)
      for (int x = 0; x < 2; ++x)
        ASSERT_NEAR(field.values[std::size_t((z * 300 + y) * 2 + x)], y / 299.0 + x + z, 1.5e-3);
}

TEST(FieldThinning, MeansSeeEverySampleAndGapsStayWhereTheyAre) {
  FieldSamples field = ramp(1000);
  for (float& value : field.values) value = 0.0f;
  for (int y = 0; y < 1000; ++y) field.values[std::size_t(2 * y)] = y % 4 == 0 ? 4.0f : 0.0f;
  for (int y = 500; y < 1000; ++y) {
    field.values[std::size_t(2 * y + 1)] = std::numeric_limits<float>::quiet_NaN();
  }
  const FieldSamples thin = thinned(field, 100);
  for (int y = 1; y < 99; ++y) {
    ASSERT_NEAR(thin.values[std::size_t(2 * y)], 1.0, 0.35) << "one in four is not lost";
    ASSERT_EQ(std::isnan(thin.values[std::size_t(2 * y + 1)]), y >= 50) << y;
  }
}

TEST(FieldThinning, UnevenAxesStayUneven) {
  FieldSamples field = ramp(1000);
  for (int y = 0; y < 1000; ++y) field.axes[1].nodes.push_back(std::pow(y / 999.0, 2.0));
  const FieldSamples thin = thinned(field, 100);
  ASSERT_EQ(thin.axes[1].nodes.size(), 100u);
  EXPECT_EQ(thin.axes[1].nodes.front(), 0.0);
  EXPECT_NEAR(thin.axes[1].nodes[50], std::pow(50 / 99.0, 2.0), 1e-5);
  EXPECT_NEAR(thin.axes[1].nodes.back(), 1.0, 1e-12);
}

}  // namespace
}  // namespace vestige
