// SPDX-License-Identifier: BSD-3-Clause
#include "mini-sim/plume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace {

using minisim::Fields;
using minisim::PlumeParameters;

template <typename Real>
Fields<Real> fieldsAfter(int steps, const PlumeParameters& parameters) {
  auto plume = minisim::makePlume<Real>(parameters);
  for (int i = 0; i < steps; ++i) plume.step();
  Fields<Real> fields;
  plume.gather(minisim::kAllFields, fields);
  return fields;
}

template <typename Real>
void expectSame(const Fields<Real>& a, const Fields<Real>& b) {
  EXPECT_EQ(a.temperature, b.temperature);
  EXPECT_EQ(a.density, b.density);
  EXPECT_EQ(a.velocity, b.velocity);
  EXPECT_EQ(a.vorticity, b.vorticity);
}

TEST(Plume, IsTheSameBitForBitWithAnyNumberOfThreads) {
  PlumeParameters parameters;
  parameters.size = {33, 20, 27};
  for (int steps : {20, 21}) {
    parameters.threads = 1;
    const auto one = fieldsAfter<float>(steps, parameters);
    const auto oneDouble = fieldsAfter<double>(steps, parameters);
    for (int threads : {2, 3}) {
      parameters.threads = threads;
      expectSame(one, fieldsAfter<float>(steps, parameters));
      expectSame(oneDouble, fieldsAfter<double>(steps, parameters));
    }
  }
}

TEST(Plume, DependsOnItsSeed) {
  PlumeParameters parameters;
  parameters.size = {16, 16, 16};
  parameters.threads = 1;
  const auto one = fieldsAfter<float>(20, parameters);
  parameters.seed = 2;
  EXPECT_NE(one.temperature, fieldsAfter<float>(20, parameters).temperature);
}

TEST(Plume, FloatFollowsDoubleBeforeTheFlowIsChaotic) {
  PlumeParameters parameters;
  parameters.size = {32, 32, 32};
  parameters.threads = 1;
  const auto single = fieldsAfter<float>(100, parameters);
  const auto twice = fieldsAfter<double>(100, parameters);
  double worst = 0.0;
  for (std::size_t i = 0; i < single.temperature.size(); ++i)
    worst = std::max(worst, std::abs(single.temperature[i] - twice.temperature[i]));
  EXPECT_LT(worst, 1e-4);
}

TEST(Plume, RisesAndStaysBounded) {
  PlumeParameters parameters;
  parameters.size = {32, 32, 32};
  parameters.threads = 1;
  auto plume = minisim::makePlume<float>(parameters);
  const double mass = plume.totals().mass;
  for (int i = 0; i < 400; ++i) plume.step();
  const auto totals = plume.totals();
  EXPECT_TRUE(totals.finite);
  EXPECT_NEAR(totals.mass / mass, 1.0, 1e-5);
  EXPECT_GT(totals.greatestSpeed, 0.3 * parameters.speed);
  EXPECT_LT(totals.greatestSpeed, 0.4);
  Fields<float> fields;
  plume.gather(minisim::kTemperature, fields);
  const auto [low, high] =
      std::minmax_element(fields.temperature.begin(), fields.temperature.end());
  EXPECT_GT(*low, -0.2f);
  EXPECT_LT(*high, 1.3f);
  // Warm air has come to the upper half.
  const auto middle = fields.temperature.begin() + fields.temperature.size() * 3 / 5;
  EXPECT_GT(*std::max_element(middle, fields.temperature.end()), 0.2f);
}

TEST(Plume, GoesByItsRayleighAndPrandtlNumbers) {
  PlumeParameters parameters;
  parameters.size = {32, 32, 64};
  const auto settings = minisim::plumeSettings(parameters);
  EXPECT_NEAR(settings.buoyancy * std::pow(64.0, 3) / (settings.viscosity * settings.diffusivity),
              parameters.rayleigh, 1e-3);
  EXPECT_NEAR(settings.viscosity / settings.diffusivity, parameters.prandtl, 1e-12);
}

TEST(Plume, RefusesParametersThatMakeNoSense) {
  PlumeParameters parameters;
  parameters.size = {8, 8, 8};
  parameters.rayleigh = 0.0;
  EXPECT_THROW(minisim::makePlume<float>(parameters), std::invalid_argument);
  parameters = {};
  parameters.prandtl = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(minisim::makePlume<float>(parameters), std::invalid_argument);
  parameters = {};
  parameters.speed = 0.5;
  EXPECT_THROW(minisim::makePlume<float>(parameters), std::invalid_argument);
}

}  // namespace
