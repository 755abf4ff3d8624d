// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <random>

#include "tests/proxy/classifier/classifier_fixture.h"
#include "tests/support/quadrature.h"

namespace vestige::test {
namespace {

using nlohmann::json;

const FieldDomain kDomain{100.0, 300.0, 150.0};

json skin() {
  return {{"kind", "boundaries"},
          {"fields", {"ct"}},
          {"boundaries", {{{"name", "skin"}, {"value", 200.0}, {"thickness", 0.5}}}}};
}

std::unique_ptr<Classifier> resolved(const json& object) {
  return read(object)->resolved({&kDomain, 1}, 2.0);
}

double weight(const Classifier& classifier, const FieldSample& a, const FieldSample& b) {
  return weightsOf(classifier, a, b)[0];
}

TEST(Boundaries, AreAsThickInTheWorldAsTheySayHoweverSteepTheField) {
  const auto classifier = resolved(skin());
  // Along the gradient the field rises by range * gradient a world unit: at 0.25 units from the
  // surface a boundary 0.5 thick has half its weight.
  for (const double gradient : {0.01, 0.1, 3.0}) {
    const double beside = 200.0 + 0.25 * gradient * kDomain.range();
    EXPECT_NEAR(weight(*classifier, value(beside, gradient), value(beside, gradient)), 0.5, 1e-12);
    const double end = 200.0 - 0.5 * gradient * kDomain.range();
    EXPECT_NEAR(weight(*classifier, value(end, gradient), value(end, gradient)), 0.0, 1e-12);
  }
}

TEST(Boundaries, WeighOneOnTheirValueInAFlatField) {
  const auto classifier = resolved(skin());
  EXPECT_EQ(weight(*classifier, value(200.0), value(200.0)), 1.0);
  EXPECT_EQ(weight(*classifier, value(200.0001), value(200.0001)), 0.0);
  EXPECT_EQ(weight(*classifier, value(200.0), value(201.0)), 0.0);
}

TEST(Boundaries, IntegrateAsQuadratureDoes) {
  const auto classifier = resolved(skin());
  std::mt19937 random(4);
  std::uniform_real_distribution<double> any(100.0, 300.0), steep(0.0, 2.0), share(0.0, 1.0);
  for (int i = 0; i < 20000; ++i) {
    const double from = any(random), gradient = steep(random) * std::pow(10, -2 * share(random));
    const double to = from + (any(random) - from) * std::pow(10.0, -12.0 * share(random));
    const double width = 0.5 * gradient * kDomain.range();
    std::array<double, 3> bends{(200.0 - width - from) / (to - from), (200.0 - from) / (to - from),
                                (200.0 + width - from) / (to - from)};
    const double exact = integrateUnit(
        [&](double t) {
          return std::max(0.0, 1.0 - std::abs(from + t * (to - from) - 200.0) / width);
        },
        bends, 1e-12);
    // The mean of both ends' gradients holds along the segment.
    ASSERT_NEAR(weight(*classifier, value(from, 0.5 * gradient), value(to, 1.5 * gradient)), exact,
                1e-9)
        << from << " " << to;
  }
}

TEST(Boundaries, AreTheSameForwardsAndBackwardsAndAddUpOverHalves) {
  const auto classifier = resolved(skin());
  const FieldSample a = value(170.0, 0.4), b = value(260.0, 0.4), middle = between(a, b, 0.5);
  EXPECT_EQ(weight(*classifier, a, b), weight(*classifier, b, a));
  EXPECT_NEAR(weight(*classifier, a, b),
              0.5 * (weight(*classifier, a, middle) + weight(*classifier, middle, b)), 1e-12);
}

TEST(Boundaries, WeighNothingWithoutData) {
  const auto classifier = resolved(skin());
  for (const double bad : {double(NAN), double(INFINITY)}) {
    EXPECT_EQ(weight(*classifier, value(bad, 1), value(200, 1)), 0.0);
    EXPECT_EQ(weight(*classifier, value(200, 1), value(bad, 1)), 0.0);
  }
  EXPECT_EQ(weight(*classifier, value(200, NAN), value(200, 1)), 0.0);
}

TEST(Boundaries, WeighNormalisedValuesAsTheyWeighValues) {
  const auto classifier = resolved(skin());
  const auto unit = classifier->normalised({&kDomain, 1});
  EXPECT_NEAR(weight(*classifier, value(190, 0.3), value(230, 0.5)),
              weight(*unit, value(0.45, 0.3), value(0.65, 0.5)), 1e-12);
  EXPECT_GT(weight(*classifier, value(190, 0.3), value(230, 0.5)), 0.1);
}

TEST(Boundaries, StandAtTheMedianAndAreAReferenceLengthThickByDefault) {
  const auto classifier = resolved({{"kind", "boundaries"}, {"fields", {"ct"}}});
  const json entry = classifier->json()["boundaries"][0];
  EXPECT_EQ(entry["value"], 150.0);
  EXPECT_EQ(entry["thickness"], 2.0);
  EXPECT_TRUE(classifier->needsGradient());
  EXPECT_TRUE(classifier->densities().empty());
}

TEST(Boundaries, VanishOnlyWhereTheyWeighNothing) {
  const auto classifier = resolved(skin());
  EXPECT_TRUE(classifier->vanishes(value(100, 0), value(150, 0.1)));
  EXPECT_FALSE(classifier->vanishes(value(100, 0), value(150, 1.0)));
  EXPECT_FALSE(classifier->vanishes(value(100, 0), value(200, 0)));
  EXPECT_FALSE(classifier->vanishes(value(150, 0), value(250, 0)));
}

TEST(Boundaries, ReadWhatTheyWrite) {
  const json written = read(skin())->json();
  EXPECT_EQ(read(written)->json(), written);
  const json bare =
      read({{"kind", "boundaries"}, {"fields", {"ct"}}, {"boundaries", {{{"name", "a"}}}}})->json();
  EXPECT_FALSE(bare["boundaries"][0].contains("value"));
}

TEST(Boundaries, NameTheKeyThatIsWrong) {
  const auto but = [](const char* key, const json& to) {
    json object = skin();
    object["boundaries"][0][key] = to;
    return object;
  };
  expectKeyError(but("value", "x"), "boundaries[0].value", "number");
  expectKeyError(but("value", NAN), "boundaries[0].value", "nan");
  expectKeyError(but("thickness", 0), "boundaries[0].thickness", "0 is not positive");
  expectKeyError(but("thickness", INFINITY), "boundaries[0].thickness", "inf");
  expectKeyError(but("width", 1), "boundaries[0].width", "not known");
  json object = skin();
  object["boundaries"] = json::array();
  expectKeyError(object, "boundaries", "empty");
  object = skin();
  object["fields"] = {"a", "b"};
  expectKeyError(object, "fields", "boundaries takes 1");
}

}  // namespace
}  // namespace vestige::test
