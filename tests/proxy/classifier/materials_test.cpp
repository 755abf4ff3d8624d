// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numeric>
#include <random>

#include "tests/proxy/classifier/classifier_fixture.h"
#include "tests/support/quadrature.h"

namespace vestige::test {
namespace {

using nlohmann::json;

/// Roughly a CT head's.
json head() {
  return {{"kind", "materials"},
          {"fields", {"ct"}},
          {"materials",
           {{{"name", "air"},
             {"mean", -1000.0},
             {"deviation", 60.0},
             {"density", 0.0},
             {"opacity", 0.0}},
            {{"name", "fat"}, {"mean", -80.0}, {"deviation", 40.0}, {"density", 1.0}},
            {{"name", "tissue"},
             {"mean", 40.0},
             {"deviation", 50.0},
             {"density", 1.1},
             {"color", "#ff8000"}},
            {{"name", "bone"}, {"mean", 900.0}, {"deviation", 350.0}, {"density", 2.0}}}}};
}

/// p_m by the formula itself.
std::vector<double> probabilities(double v) {
  std::vector<double> p;
  static const json kHead = head();
  for (const json& m : kHead["materials"]) {
    const double s = m["deviation"], x = (v - double(m["mean"])) / s;
    p.push_back(std::exp(-0.5 * x * x) / s);
  }
  const double sum = std::accumulate(p.begin(), p.end(), 0.0);
  for (double& each : p) each /= sum;
  return p;
}

TEST(Materials, AreAsProbableAsTheirDensitiesSay) {
  const auto classifier = read(head());
  for (double v = -1100.0; v < 1500.0; v += 37.0) {
    const auto weights = weightsOf(*classifier, value(v), value(v));
    const auto expected = probabilities(v);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(weights[i], expected[i], 1e-12) << v;
  }
}

TEST(Materials, IntegrateAsQuadratureDoes) {
  const auto classifier = read(head());
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1200.0, 2000.0), share(0.0, 1.0);
  double worst = 0.0;
  for (int i = 0; i < 500; ++i) {
    const double from = any(random);
    const double to = from + (any(random) - from) * std::pow(10.0, -6.0 * share(random));
    const auto weights = weightsOf(*classifier, value(from), value(to));
    std::vector<double> bends;
    for (int k = 1; k < 64; ++k) bends.push_back(k / 64.0);
    for (std::size_t m = 0; m < 4; ++m) {
      const double exact = integrateUnit(
          [&](double t) { return probabilities(from + t * (to - from))[m]; }, bends, 1e-11);
      worst = std::max(worst, std::abs(weights[m] - exact));
    }
  }
  EXPECT_LE(worst, 1e-9);
}

TEST(Materials, IntegrateMixturesThatNeverCross) {
  // A broad material over a narrow one of the same mean, and two of nearly the same width.
  const auto classifier = read({{"kind", "materials"},
                                {"fields", {"f"}},
                                {"materials",
                                 {{{"mean", 0.0}, {"deviation", 1.0}},
                                  {{"mean", 0.0}, {"deviation", 0.1}},
                                  {{"mean", 0.5}, {"deviation", 1.0}},
                                  {{"mean", 0.6}, {"deviation", 1.0000001}}}}});
  std::vector<double> bends;
  for (int k = 1; k < 256; ++k) bends.push_back(k / 256.0);
  for (std::size_t m = 0; m < 4; ++m) {
    const double exact = integrateUnit(
        [&](double t) { return weightsOf(*classifier, value(8 * t - 4), value(8 * t - 4))[m]; },
        bends, 1e-12);
    EXPECT_NEAR(weightsOf(*classifier, value(-4), value(4))[m], exact, 1e-9);
  }
}

TEST(Materials, SumToOneEverywhereForwardsAndBackwards) {
  const auto classifier = read(head());
  for (const auto& [a, b] : {std::pair{-1e6, 1e6}, {-50.0, 60.0}, {1e9, 1e9}, {-1e9, -1e9}}) {
    const auto there = weightsOf(*classifier, value(a), value(b));
    EXPECT_NEAR(std::accumulate(there.begin(), there.end(), 0.0), 1.0, 1e-9) << a << " " << b;
    const auto back = weightsOf(*classifier, value(b), value(a));
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(there[i], back[i], 1e-12);
  }
}

TEST(Materials, GiveValuesFarFromAllToTheWidest) {
  const auto classifier = read(head());
  for (const double far : {-1e8, 1e8}) {
    const auto weights = weightsOf(*classifier, value(far), value(far));
    EXPECT_EQ(weights, (std::vector<double>{0.0, 0.0, 0.0, 1.0})) << "bone";
  }
}

TEST(Materials, WeighNothingWithoutData) {
  const auto classifier = read(head());
  for (const double bad : {double(NAN), double(INFINITY)}) {
    EXPECT_EQ(weightsOf(*classifier, value(bad), value(0)), std::vector<double>(4, 0.0));
    EXPECT_EQ(weightsOf(*classifier, value(0), value(bad)), std::vector<double>(4, 0.0));
  }
}

TEST(Materials, GiveTheDensityThatLightFallsOn) {
  const auto classifier = read(head());
  EXPECT_EQ(classifier->densities(), (std::vector<double>{0.0, 1.0, 1.1, 2.0}));
  EXPECT_FALSE(classifier->needsGradient());
  json bare = head();
  bare["materials"][3].erase("density");
  EXPECT_EQ(read(bare)->densities()[3], 900.0) << "by default the mean";
}

TEST(Materials, MixOpacitiesAndColoursByProbability) {
  const auto classifier = read(head());
  const auto optics = classifier->optics(1.0);
  EXPECT_EQ(optics[0].extinction, 0.0);
  EXPECT_NEAR(optics[1].extinction, std::log(2.0), 1e-12);
  EXPECT_NEAR(optics[2].emission.r, std::log(2.0), 1e-12);
  EXPECT_EQ(optics[2].emission.b, 0.0);
}

TEST(Materials, WeighNormalisedValuesAsTheyWeighValues) {
  const FieldDomain domain{-1024.0, 2986.0, 0.0};
  const auto classifier = read(head())->resolved({&domain, 1}, 1.0);
  const auto unit = classifier->normalised({&domain, 1});
  const auto at = [&](double v) { return value((v - domain.low) / domain.range()); };
  const auto raw = weightsOf(*classifier, value(-60), value(200));
  const auto normalised = weightsOf(*unit, at(-60), at(200));
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(raw[i], normalised[i], 1e-9);
}

TEST(Materials, ReadWhatTheyWrite) {
  const json written = read(head())->json();
  EXPECT_EQ(read(written)->json(), written);
  EXPECT_EQ(written["materials"][3]["deviation"], 350.0);
}

TEST(Materials, NameTheKeyThatIsWrong) {
  const auto but = [](const char* key, const json& to) {
    json object = head();
    object["materials"][1][key] = to;
    return object;
  };
  json without = head();
  without["materials"][1].erase("mean");
  expectKeyError(without, "materials[1].mean", "missing");
  without = head();
  without["materials"][1].erase("deviation");
  expectKeyError(without, "materials[1].deviation", "missing");
  without = head();
  without.erase("materials");
  expectKeyError(without, "materials", "missing");
  expectKeyError(but("mean", "x"), "materials[1].mean", "number");
  expectKeyError(but("mean", NAN), "materials[1].mean", "nan");
  expectKeyError(but("deviation", 0), "materials[1].deviation", "0 is not positive");
  expectKeyError(but("density", INFINITY), "materials[1].density", "inf");
  expectKeyError(but("denisty", 1), "materials[1].denisty", "not known");
  expectKeyError(but("name", "bone"), "kind", "'bone'");
  json object = head();
  object["materials"] = json::array();
  expectKeyError(object, "materials", "empty");
  object = head();
  object["fields"] = {"a", "b"};
  expectKeyError(object, "fields", "materials takes 1");
}

}  // namespace
}  // namespace vestige::test
