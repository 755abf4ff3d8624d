// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "proxy/transfer/colormap.h"
#include "tests/proxy/classifier/classifier_fixture.h"
#include "tests/support/quadrature.h"

namespace vestige::test {
namespace {

using nlohmann::json;

json photograph() { return {{"kind", "color"}, {"fields", {"r", "g", "b"}}, {"range", {0, 255}}}; }

FieldSample rgb(double r, double g, double b) { return {{r, g, b, 0}, 0.0}; }

TEST(Color, IsWhatTheFieldsSayInLinearRgbWeighedByLuminance) {
  const auto classifier = read(photograph());
  EXPECT_EQ(classifier->channels(), (std::vector<std::string>{"opacity", "red", "green", "blue"}));
  const glm::dvec3 linear = linearFromSrgb(glm::dvec3(255, 128, 26) / 255.0);
  const double w = glm::dot(linear, glm::dvec3(0.2126, 0.7152, 0.0722));
  const auto weights = weightsOf(*classifier, rgb(255, 128, 26), rgb(255, 128, 26));
  EXPECT_NEAR(weights[0], w, 1e-12);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(weights[std::size_t(i) + 1], w * linear[i], 1e-12);
}

TEST(Color, ShowsAHomogeneousMediumInItsOwnColour) {
  const auto classifier = read(photograph());
  const auto optics = classifier->optics(2.0);
  const auto weights = weightsOf(*classifier, rgb(200, 100, 50), rgb(200, 100, 50));
  double extinction = 0.0;
  glm::dvec3 emission(0.0);
  for (std::size_t k = 0; k < 4; ++k) {
    extinction += weights[k] * optics[k].extinction;
    emission += weights[k] * optics[k].emission;
  }
  const glm::dvec3 expected = linearFromSrgb(glm::dvec3(200, 100, 50) / 255.0);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR((emission / extinction)[i], expected[i], 1e-12);
}

TEST(Color, CanBeLinearAndOfConstantWeight) {
  json object = photograph();
  object["encoding"] = "linear";
  object["weight"] = "constant";
  const auto weights = weightsOf(*read(object), rgb(51, 102, 0), rgb(153, 102, 510));
  EXPECT_NEAR(weights[0], 1.0, 1e-12);
  EXPECT_NEAR(weights[1], 0.4, 1e-12);
  EXPECT_NEAR(weights[2], 0.4, 1e-12);
  EXPECT_NEAR(weights[3], 0.75, 1e-12) << "clamped at 255, half way";
}

TEST(Color, IntegratesAsQuadratureDoes) {
  const auto classifier = read(photograph());
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-40.0, 300.0);
  double worst = 0.0;
  for (int i = 0; i < 100; ++i) {
    const FieldSample a = rgb(any(random), any(random), any(random)),
                      b = rgb(any(random), any(random), any(random));
    const auto weights = weightsOf(*classifier, a, b);
    std::vector<double> bends;
    for (int k = 1; k < 64; ++k) bends.push_back(k / 64.0);
    for (std::size_t k = 0; k < 4; ++k) {
      const double exact = integrateUnit(
          [&](double t) {
            const FieldSample at = between(a, b, t);
            return weightsOf(*classifier, at, at)[k];
          },
          bends, 1e-10);
      worst = std::max(worst, std::abs(weights[k] - exact));
    }
  }
  EXPECT_LE(worst, 1e-8);
}

TEST(Color, WeighsNothingWhereAnyFieldHasNoData) {
  const auto classifier = read(photograph());
  for (std::size_t i = 0; i < 3; ++i) {
    FieldSample bad = rgb(1, 2, 3);
    bad.values[i] = NAN;
    EXPECT_EQ(weightsOf(*classifier, bad, rgb(1, 2, 3)), std::vector<double>(4, 0.0));
    EXPECT_EQ(weightsOf(*classifier, rgb(1, 2, 3), bad), std::vector<double>(4, 0.0));
  }
}

TEST(Color, TakesOneRangeForAllThreeSoThatGreyStaysGrey) {
  const std::vector<FieldDomain> domains{{10, 200, 0}, {0, 250, 0}, {20, 255, 0}};
  const auto classifier =
      read({{"kind", "color"}, {"fields", {"r", "g", "b"}}})->resolved(domains, 1.0);
  EXPECT_EQ(classifier->json()["range"], json({0.0, 255.0}));
  const auto grey = weightsOf(*classifier, rgb(90, 90, 90), rgb(90, 90, 90));
  EXPECT_NEAR(grey[1], grey[3], 1e-15);
  // Values that were normalised each by its own field.
  const auto unit = classifier->normalised(domains);
  const auto same = weightsOf(*unit, rgb(80 / 190.0, 90 / 250.0, 70 / 235.0),
                              rgb(80 / 190.0, 90 / 250.0, 70 / 235.0));
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(same[i], grey[i], 1e-12);
}

TEST(Color, IsTintedAndSwitchedOffAsAnyFeature) {
  const auto classifier = read(photograph());
  const FeatureEdit red{"color", 0.25, glm::dvec3(1, 0, 0), {}};
  classifier->edit({&red, 1});
  const auto optics = classifier->optics(1.0);
  EXPECT_NEAR(optics[0].extinction, -std::log(0.75), 1e-12);
  EXPECT_NEAR(optics[1].emission.r, -std::log(0.75), 1e-12);
  EXPECT_EQ(optics[3].emission, glm::dvec3(0.0));
  const FeatureEdit off{"color", {}, {}, false};
  classifier->edit({&off, 1});
  EXPECT_EQ(classifier->optics(1.0)[0].extinction, 0.0);
}

TEST(Color, ReadsWhatItWrites) {
  json object = photograph();
  object["weight"] = "constant";
  object["encoding"] = "linear";
  const json written = read(object)->json();
  EXPECT_EQ(read(written)->json(), written);
  EXPECT_EQ(written["weight"], "constant");
  EXPECT_FALSE(read({{"kind", "color"}, {"fields", {"r", "g", "b"}}})->json().contains("range"));
}

TEST(Color, NamesTheKeyThatIsWrong) {
  const auto but = [](const char* key, const json& to) {
    json object = photograph();
    object[key] = to;
    return object;
  };
  expectKeyError(but("range", {1}), "range", "two numbers");
  expectKeyError(but("range", {2, 2}), "range", "lower first");
  expectKeyError(but("range", {NAN, 2}), "range", "two numbers");
  expectKeyError(but("encoding", "gamma"), "encoding", "choices: srgb, linear");
  expectKeyError(but("weight", 1), "weight", "choices: luminance, constant");
  expectKeyError(but("opacity", 2), "opacity", "2");
  expectKeyError(but("primitives", json::array()), "primitives", "not known");
  expectKeyError(but("fields", {"r", "g"}), "fields", "color takes 3");
}

}  // namespace
}  // namespace vestige::test
