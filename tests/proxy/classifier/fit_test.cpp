// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/classifier/fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "proxy/base/error.h"

namespace vestige {
namespace {

/// Samples of two correlated fields around (300, -2) with deviations 5 and 0.1.
std::vector<FieldSample> ellipse(std::size_t count) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<FieldSample> samples(count);
  for (FieldSample& sample : samples) {
    const double a = normal(random), b = normal(random);
    sample.values = {300.0 + 5.0 * a, -2.0 + 0.1 * (0.8 * a + 0.6 * b), 0.0, 0.0};
  }
  return samples;
}
const std::vector<FieldDomain> kDomains{{200.0, 400.0, 300.0}, {-4.0, 0.0, -2.0}};

void expectThrow(const std::function<void()>& work, const std::string& part) {
  try {
    work();
    FAIL() << "no error of '" << part << "'";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::InvalidArgument);
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

TEST(FitPrimitive, FindsMeanDeviationAndCovarianceOfItsSamples) {
  const FittedPrimitive fit = fitPrimitive(ellipse(200000), kDomains);
  EXPECT_EQ(fit.samples, 200000u);
  EXPECT_NEAR(fit.mean[0], 300.0, 0.05);
  EXPECT_NEAR(fit.mean[1], -2.0, 0.001);
  EXPECT_NEAR(fit.deviation[0], 5.0, 0.05);
  EXPECT_NEAR(fit.deviation[1], 0.1, 0.001);
  EXPECT_NEAR(fit.covariance[0][1], 0.8 * 5.0 * 0.1, 0.005);
  EXPECT_EQ(fit.covariance[0][1], fit.covariance[1][0]);
}

TEST(FitPrimitive, MakesADiagonalOneRootTwoDeviationsWide) {
  const FittedPrimitive fit = fitPrimitive(ellipse(1000), kDomains);
  EXPECT_EQ(fit.primitive.center, fit.mean);
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_NEAR(fit.primitive.scale[i][i] * fit.deviation[i], std::sqrt(0.5), 1e-12);
  EXPECT_EQ(fit.primitive.scale[0][1], 0.0);
  EXPECT_EQ(primitiveJson(fit.primitive).count("width"), 1u);
}

TEST(FitPrimitive, MakesAFullOneTheScaledNormalDistributionOfTheSamples) {
  const FittedPrimitive fit = fitPrimitive(ellipse(1000), kDomains, true);
  const auto& s = fit.covariance;
  const double det = s[0][0] * s[1][1] - s[0][1] * s[1][0];
  for (const auto& [a, b] : {std::pair{3.0, 0.05}, {-6.0, 0.1}, {0.0, 0.2}}) {
    const double square = (s[1][1] * a * a - 2.0 * s[0][1] * a * b + s[0][0] * b * b) / det;
    FieldSample sample;
    sample.values = {fit.mean[0] + a, fit.mean[1] + b, 0.0, 0.0};
    EXPECT_NEAR(fit.primitive.at(sample), std::exp(-0.5 * square), 1e-10);
  }
  EXPECT_EQ(primitiveJson(fit.primitive).at("matrix").size(), 4u);
}

TEST(FitPrimitive, GivesAConstantRegionTheLeastWidth) {
  std::vector<FieldSample> samples(50);
  for (FieldSample& sample : samples) sample.values = {300.0, -2.0, 0.0, 0.0};
  for (const bool full : {false, true}) {
    const FittedPrimitive fit = fitPrimitive(samples, kDomains, full);
    EXPECT_NEAR(fit.deviation[0], 0.0, 1e-9);
    EXPECT_NEAR(1.0 / fit.primitive.scale[0][0], std::sqrt(2.0) * kLeastDeviation * 200.0, 1e-9);
    EXPECT_NEAR(1.0 / fit.primitive.scale[1][1], std::sqrt(2.0) * kLeastDeviation * 4.0, 1e-9);
    EXPECT_NEAR(fit.primitive.at(samples[0]), 1.0, 1e-12);
  }
}

TEST(FitPrimitive, GivesPerfectlyCorrelatedFieldsTheLeastWidthAcross) {
  std::vector<FieldSample> samples;
  for (int i = 0; i <= 100; ++i) samples.push_back({{250.0 + i, -3.0 + 0.02 * i, 0, 0}, 0.0});
  const FittedPrimitive fit = fitPrimitive(samples, kDomains, true);
  // Along the line it is as wide as the samples; across it, kLeastDeviation of the ranges.
  const double across = std::sqrt(2.0) * kLeastDeviation;
  FieldSample aside;
  aside.values = {fit.mean[0] + 200.0 * across * std::sqrt(0.5),
                  fit.mean[1] - 4.0 * across * std::sqrt(0.5), 0.0, 0.0};
  EXPECT_NEAR(fit.primitive.at(aside), std::exp(-1.0), 1e-6);
  EXPECT_GT(fit.primitive.at(samples[40]), 0.9);
}

TEST(FitPrimitive, IsNoNarrowerThanTheErrorOfItsSamples) {
  std::vector<FieldSample> plateau(50);
  for (FieldSample& sample : plateau) sample.values = {300.0, -2.0, 0.0, 0.0};
  const std::array<double, 2> errors{10.6, 0.0};
  for (const bool full : {false, true}) {
    const FittedPrimitive fit = fitPrimitive(plateau, kDomains, full, errors);
    EXPECT_NEAR(1.0 / fit.primitive.scale[0][0], 10.6, 1e-9);
    EXPECT_NEAR(1.0 / fit.primitive.scale[1][1], std::sqrt(2.0) * kLeastDeviation * 4.0, 1e-9);
    EXPECT_TRUE(fit.widened[0]);
    EXPECT_FALSE(fit.widened[1]);
  }
  // Wide samples keep their width.
  const std::array<double, 2> small{5.0, 0.01};
  const FittedPrimitive wide = fitPrimitive(ellipse(1000), kDomains, false, small);
  EXPECT_EQ(wide.primitive.scale, fitPrimitive(ellipse(1000), kDomains).primitive.scale);
  EXPECT_FALSE(wide.widened[0]);
}

TEST(FitPrimitive, IsAsWideAsTheErrorsInEveryDirectionWhenItFollowsCorrelation) {
  std::vector<FieldSample> line;
  for (int i = 0; i <= 100; ++i) line.push_back({{250.0 + i, -3.0 + 0.02 * i, 0, 0}, 0.0});
  const std::array<double, 2> errors{8.0, 0.02};
  const FittedPrimitive fit = fitPrimitive(line, kDomains, true, errors);
  for (const auto& [a, b] : {std::pair{8.0, 0.0}, {0.0, 0.02}, {-8.0, 0.0}, {0.0, -0.02}}) {
    FieldSample off;
    off.values = {fit.mean[0] + a, fit.mean[1] + b, 0.0, 0.0};
    EXPECT_GE(fit.primitive.at(off), std::exp(-1.0) - 1e-9) << a << " " << b;
  }
  EXPECT_GT(fit.primitive.at(line[40]), 0.9);
}

TEST(FitPrimitive, KeepsTheDigitsOfASmallVariationOfALargeValue) {
  std::vector<FieldSample> samples;
  for (int i = -100; i <= 100; ++i) samples.push_back({{101325.0 + 1e-4 * i, 0, 0, 0}, 0.0});
  const FieldDomain domain{101324.99, 101325.01, 101325.0};
  const FittedPrimitive fit = fitPrimitive(samples, {&domain, 1});
  EXPECT_NEAR(fit.mean[0], 101325.0, 1e-9);
  EXPECT_NEAR(fit.deviation[0], 1e-4 * std::sqrt(100.0 * 101.0 / 3.0), 1e-8);
}

TEST(FitPrimitive, PassesOverSamplesWithoutData) {
  std::vector<FieldSample> samples = ellipse(100);
  const FittedPrimitive whole = fitPrimitive(samples, kDomains);
  samples.push_back({{NAN, -2.0, 0, 0}, 0.0});
  samples.push_back({{300.0, INFINITY, 0, 0}, 0.0});
  const FittedPrimitive fit = fitPrimitive(samples, kDomains);
  EXPECT_EQ(fit.samples, 100u);
  EXPECT_EQ(fit.mean, whole.mean);
}

TEST(FitPrimitive, RefusesWhatItCannotFitTo) {
  const std::vector<FieldSample> none{{{NAN, 0, 0, 0}, 0.0}};
  const std::vector<FieldSample> one{{{1, 0, 0, 0}, 0.0}};
  const FieldDomain unit;
  expectThrow([&] { fitPrimitive(none, {&unit, 1}); }, "none of 1 samples");
  expectThrow([&] { fitPrimitive({}, {&unit, 1}); }, "none of 0 samples");
  expectThrow([&] { fitPrimitive(one, {}); }, "not 0");
  expectThrow([&] { fitPrimitive(one, std::vector<FieldDomain>(5)); }, "not 5");
  const FieldDomain flat{3.0, 3.0, 3.0};
  expectThrow([&] { fitPrimitive(one, {&flat, 1}); }, "from 3 to 3");
  const std::array<double, 2> two{};
  expectThrow([&] { fitPrimitive(one, {&unit, 1}, false, two); }, "2 errors of 1 fields");
}

}  // namespace
}  // namespace vestige
