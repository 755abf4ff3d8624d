// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/training/learned_color.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "proxy/base/error.h"

namespace vestige {
namespace {

constexpr int kChannels = 6;
const std::vector<glm::dvec3> kNoPrior(kChannels, glm::dvec3(0.0));

/// Attenuations of random media: they add up to less than one.
LearningSamples samplesOf(int count,
                          const std::function<glm::dvec3(std::span<const float>)>& color) {
  LearningSamples samples;
  samples.channels = kChannels;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0.0f, 1.0f);
  for (int i = 0; i < count; ++i) {
    std::vector<float> a;
    float left = 1.0f;
    for (int k = 0; k < kChannels; ++k) {
      const float share = unit(random) * unit(random);
      a.push_back(left * share);
      left -= a.back();
    }
    const glm::dvec3 c = color(a);
    samples.attenuation.insert(samples.attenuation.end(), a.begin(), a.end());
    for (int j = 0; j < 3; ++j) samples.color.push_back(float(c[j]));
  }
  return samples;
}

glm::dvec3 affine(std::span<const float> a) {
  glm::dvec3 c(0.2, 0.1, 0.3);
  for (int k = 0; k < kChannels; ++k)
    c += double(a[std::size_t(k)]) * glm::dvec3(0.1 * k, 0.9 - 0.1 * k, k % 2 ? 0.6 : 0.2);
  return c;
}

/// What light does: products of attenuations.
glm::dvec3 curved(std::span<const float> a) {
  return affine(a) * (1.6 + std::sin(9.0 * double(a[0])) * std::cos(7.0 * double(a[1]))) +
         glm::dvec3(1.5 * double(a[2] * a[3]));
}

double meanSquare(const LearnedTable& table, const LearningSamples& samples) {
  double sum = 0.0;
  for (std::size_t i = 0; i < samples.color.size() / 3; ++i) {
    const auto made =
        learnedColor(table, std::span(samples.attenuation).subspan(i * kChannels, kChannels));
    for (int c = 0; c < 3; ++c)
      sum += std::pow(made[c] - double(samples.color[3 * i + std::size_t(c)]), 2);
  }
  return sum / double(samples.color.size());
}

TEST(LearnedColor, RecoversAnAffineMapToRounding) {
  const LearningSamples samples = samplesOf(4000, affine);
  for (const int clusters : {1, 5, 24}) {
    const LearnedFit fit = fitLearnedColor(samples, kNoPrior, clusters);
    EXPECT_EQ(fit.table.clusters, clusters);
    EXPECT_LT(fit.error, 2e-6) << clusters;
    // Also where no sample was.
    const std::vector<float> apart{0.9f, 0.0f, 0.02f, 0.0f, 0.05f, 0.01f};
    EXPECT_LT(glm::length(learnedColor(fit.table, apart) - affine(apart)), 1e-4) << clusters;
  }
}

TEST(LearnedColor, OneClusterIsTheGlobalLeastSquaresMap) {
  // Far from 0, below which no colour is.
  const LearningSamples samples =
      samplesOf(3000, [](auto a) { return curved(a) + glm::dvec3(1.0); });
  const LearnedFit fit = fitLearnedColor(samples, kNoPrior, 1);
  const double least = meanSquare(fit.table, samples);
  EXPECT_NEAR(fit.error * fit.error, least, 1e-9);
  // Changing any coefficient either way makes it no better: the gradient is zero.
  for (std::size_t i = 0; i < fit.table.jacobian.size(); ++i) {
    LearnedTable up = fit.table, down = fit.table;
    up.jacobian[i] += 0.05f;
    down.jacobian[i] -= 0.05f;
    EXPECT_GT(meanSquare(up, samples), least) << i;
    EXPECT_GT(meanSquare(down, samples), least) << i;
  }
  for (std::size_t c = 0; c < 3; ++c) {
    for (const float change : {-0.01f, 0.01f}) {
      LearnedTable other = fit.table;
      other.color[c] += change;
      EXPECT_GT(meanSquare(other, samples), least) << c;
    }
  }
}

TEST(LearnedColor, MoreClustersDoNotFitTheTrainingPixelsWorse) {
  const LearningSamples samples = samplesOf(6000, curved);
  double last = std::numeric_limits<double>::infinity();
  for (const int clusters : {1, 2, 4, 8, 24, 48}) {
    const double error = fitLearnedColor(samples, kNoPrior, clusters).error;
    EXPECT_LT(error, 1.02 * last) << clusters;
    last = error;
  }
  EXPECT_LT(last, 0.5 * fitLearnedColor(samples, kNoPrior, 1).error);
}

TEST(LearnedColor, EqualInputGivesEqualTables) {
  const LearningSamples samples = samplesOf(3000, curved);
  const LearnedTable first = fitLearnedColor(samples, kNoPrior, 12).table;
  fitLearnedColor(samples, kNoPrior, 7, 99);  // whatever was learned in between
  const LearnedTable second = fitLearnedColor(samples, kNoPrior, 12).table;
  EXPECT_EQ(first.centroid, second.centroid);
  EXPECT_EQ(first.jacobian, second.jacobian);
  EXPECT_EQ(first.color, second.color);
}

TEST(LearnedColor, WhatWasNeverSeenFollowsThePrior) {
  // Channel 5 is empty in every sample, and channel 4 always the same.
  const auto without = [](std::span<const float> a) {
    std::vector<float> seen(a.begin(), a.end());
    seen[4] = 0.125f;
    seen[5] = 0.0f;
    return affine(seen);
  };
  LearningSamples samples = samplesOf(2000, without);
  for (std::size_t i = 0; i < samples.attenuation.size(); i += kChannels) {
    samples.attenuation[i + 4] = 0.125f;
    samples.attenuation[i + 5] = 0.0f;
  }
  std::vector<glm::dvec3> prior(kChannels, glm::dvec3(0.5));
  prior[5] = {1.0, 0.5, 0.25};
  const LearnedFit fit = fitLearnedColor(samples, prior, 4);
  EXPECT_LT(fit.error, 2e-6);
  const std::vector<float> seen{0.2f, 0.1f, 0.3f, 0.0f, 0.125f, 0.0f};
  std::vector<float> unseen = seen;
  unseen[5] = 0.2f;
  unseen[4] = 0.025f;
  const glm::dvec3 change = learnedColor(fit.table, unseen) - learnedColor(fit.table, seen);
  const glm::dvec3 wanted = 0.2 * prior[5] - 0.1 * prior[4];
  EXPECT_LT(glm::length(change - wanted), 1e-4);
}

TEST(LearnedColor, DegenerateSamplesAreSafe) {
  const std::vector<float> a{0.1f, 0.2f, 0.0f, 0.3f, 0.0f, 0.0f};
  const auto fill = [&](int count) {
    LearningSamples samples;
    samples.channels = kChannels;
    for (int i = 0; i < count; ++i) {
      samples.attenuation.insert(samples.attenuation.end(), a.begin(), a.end());
      samples.color.insert(samples.color.end(), {0.3f, 0.2f, 0.1f});
    }
    return samples;
  };
  for (const int count : {1, 2, 50}) {  // one pixel; one colour everywhere
    const LearnedFit fit = fitLearnedColor(fill(count), kNoPrior, 24);
    EXPECT_GE(fit.table.clusters, 1);
    EXPECT_LT(fit.error, 1e-6);
    for (const float v : fit.table.jacobian) EXPECT_EQ(v, 0.0f);
  }
  // What is not finite or shows nothing does not count.
  LearningSamples samples = fill(5);
  samples.attenuation[0] = NAN;
  samples.color[4] = INFINITY;
  std::fill_n(samples.attenuation.begin() + 2 * kChannels, kChannels, 0.0f);
  samples.color[6] = 0.9f;
  EXPECT_LT(fitLearnedColor(samples, kNoPrior, 3).error, 1e-6);
}

TEST(LearnedColor, RefusesWhatItCannotLearnFrom) {
  const auto refuses = [](const char* words, const LearningSamples& samples, int clusters,
                          std::span<const glm::dvec3> prior = kNoPrior) {
    try {
      fitLearnedColor(samples, prior, clusters);
      ADD_FAILURE() << words;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::InvalidArgument);
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  LearningSamples samples = samplesOf(10, affine);
  refuses("0 clusters", samples, 0);
  refuses("257 clusters", samples, 257);
  refuses("and 2 of", samples, 3, std::span(kNoPrior).first(2));
  samples.color.pop_back();
  refuses("do not fit", samples, 3);
  refuses("do not fit", LearningSamples{}, 3);
  samples = samplesOf(10, affine);
  std::fill(samples.attenuation.begin(), samples.attenuation.end(), 0.0f);
  refuses("nothing to learn from", samples, 3);
}

}  // namespace
}  // namespace vestige
