// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/classifier/gaussian.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/proxy/classifier/classifier_fixture.h"
#include "tests/support/quadrature.h"
#include "tests/support/random_segments.h"

namespace vestige {
namespace {

using nlohmann::json;
using test::between;
using test::expectKeyError;
using test::read;
using test::Segment;
using test::value;

GaussianPrimitive line(double center, double scale, double thickness = 0.0) {
  GaussianPrimitive primitive{.fields = 1, .center = {center}, .thickness = thickness};
  primitive.scale[0][0] = scale;
  return primitive;
}

json with(const json& primitive, int fields = 2) {
  json names = json::array({"T", "u", "v", "w"});
  while (names.size() > std::size_t(fields)) names.erase(names.size() - 1);
  return {{"kind", "gaussian"}, {"fields", names}, {"primitives", json::array({primitive})}};
}

// --- integrals -----------------------------------------------------------------------------------

TEST(GaussianPrimitive, IntegratesAsQuadratureDoesOver100000Segments) {
  test::RandomSegments random(11);
  double worst = 0.0, most = 0.0;
  for (int i = 0; i < 100000; ++i) {
    const GaussianPrimitive primitive = random.primitive(1 + i % 4, i % 8 >= 4);
    const Segment segment = random.near(primitive);
    const double mean = primitive.mean(segment.a, segment.b);
    worst = std::max(worst, std::abs(mean - test::meanByQuadrature(primitive, segment)));
    most = std::max(most, mean);
  }
  EXPECT_LE(worst, 1e-9);
  EXPECT_GT(most, 0.5) << "the segments meet their primitives";
}

TEST(GaussianPrimitive, IsItsValueOnASegmentOfNoLength) {
  const GaussianPrimitive g = line(0.4, 10.0);
  EXPECT_DOUBLE_EQ(g.mean(value(0.45), value(0.45)), std::exp(-0.25));
  EXPECT_DOUBLE_EQ(g.at(value(0.4)), 1.0);
  EXPECT_NEAR(g.mean(value(0.45), value(0.45 + 1e-12)), std::exp(-0.25), 1e-10);
}

TEST(GaussianPrimitive, HasNoStepWhereItsFormulaChanges) {
  // meanOfGaussian() changes over at a difference of 1e-3.
  for (double x = -3.0; x <= 3.0; x += 0.1) {
    EXPECT_NEAR(meanOfGaussian(x, x + 0.99999e-3), meanOfGaussian(x, x + 1.00001e-3), 2e-8);
    EXPECT_NEAR(
        meanOfGaussian(x, x + 0.99999e-3),
        test::integrate([&](double t) { return std::exp(-std::pow(x + t * 0.99999e-3, 2)); }, 0.0,
                        1.0, 1e-15),
        1e-12);
  }
}

TEST(GaussianPrimitive, KeepsItsDigitsInTheTail) {
  const double exact = test::integrate(
      [](double t) { return std::exp(-std::pow(5.0 + 2.0 * t, 2)); }, 0.0, 1.0, 1e-25);
  EXPECT_NEAR(meanOfGaussian(5.0, 7.0) / exact, 1.0, 1e-12);
  EXPECT_NEAR(meanOfGaussian(-7.0, -5.0) / exact, 1.0, 1e-12);
}

TEST(GaussianPrimitive, WeighsNothingWithoutGradientWhenTriangular) {
  const GaussianPrimitive g = line(0.5, 1.0, 0.1);
  EXPECT_EQ(g.mean(value(0.5), value(0.5)), 0.0);
  EXPECT_EQ(g.mean(value(0.5, -1.0), value(0.5, 1.0)), 0.0);
  EXPECT_DOUBLE_EQ(g.mean(value(0.5, 0.0), value(0.5, 1e-300)), 1.0) << "at its very centre";
  EXPECT_EQ(g.mean(value(0.6, 1e-300), value(0.6, 1e-300)), 0.0);
}

TEST(GaussianPrimitive, WidensWithTheGradientWhenTriangular) {
  const GaussianPrimitive g = line(0.5, 1.0, 0.1);
  EXPECT_DOUBLE_EQ(g.at(value(0.6, 1.0)), std::exp(-1.0));
  EXPECT_DOUBLE_EQ(g.at(value(0.7, 2.0)), std::exp(-1.0));
  EXPECT_DOUBLE_EQ(g.at(value(1e3, INFINITY)), 1.0);
}

TEST(GaussianPrimitive, WeighsNothingWhereAValueIsMissing) {
  for (const double bad : {double(NAN), double(INFINITY), -double(INFINITY)}) {
    EXPECT_EQ(line(0.5, 1.0).mean(value(bad), value(0.5)), 0.0);
    EXPECT_EQ(line(0.5, 1.0).mean(value(0.5), value(bad)), 0.0);
    EXPECT_EQ(line(0.5, 1.0).mean(value(bad), value(bad)), 0.0);
  }
  EXPECT_EQ(line(0.5, 1.0, 1.0).mean(value(0.5, NAN), value(0.5, 1.0)), 0.0);
}

// --- properties ----------------------------------------------------------------------------------

TEST(GaussianPrimitive, IsTheSameForwardsAndBackwardsAndStaysInZeroToOne) {
  test::RandomSegments random(12);
  for (int i = 0; i < 10000; ++i) {
    const GaussianPrimitive primitive = random.primitive(1 + i % 4, i % 8 >= 4);
    const Segment segment = random.near(primitive);
    const double there = primitive.mean(segment.a, segment.b);
    EXPECT_NEAR(there, primitive.mean(segment.b, segment.a), 1e-12);
    EXPECT_GE(there, 0.0);
    EXPECT_LE(there, 1.0);
  }
}

TEST(GaussianPrimitive, AddsUpOverHalves) {
  test::RandomSegments random(13);
  for (int i = 0; i < 10000; ++i) {
    const GaussianPrimitive primitive = random.primitive(1 + i % 4, i % 8 >= 4);
    Segment segment = random.near(primitive);
    // Of one gradient: the triangular form takes the mean of each segment's ends.
    segment.b.gradient = segment.a.gradient;
    const FieldSample middle = between(segment.a, segment.b, 0.5);
    EXPECT_NEAR(primitive.mean(segment.a, segment.b),
                0.5 * (primitive.mean(segment.a, middle) + primitive.mean(middle, segment.b)),
                1e-9);
  }
}

TEST(GaussianPrimitive, KnowsNoTurnOfKFromTheLeft) {
  test::RandomSegments random(14);
  const double c = std::cos(0.7), s = std::sin(0.7);
  for (int i = 0; i < 2000; ++i) {
    const GaussianPrimitive primitive = random.primitive(3, false);
    const Segment segment = random.near(primitive);
    GaussianPrimitive turned = primitive;
    for (std::size_t j = 0; j < 4; ++j) {
      const double x = primitive.scale[0][j], y = primitive.scale[2][j];
      turned.scale[0][j] = c * x - s * y;
      turned.scale[2][j] = s * x + c * y;
    }
    EXPECT_NEAR(primitive.mean(segment.a, segment.b), turned.mean(segment.a, segment.b), 1e-9);
  }
}

TEST(GaussianPrimitive, TurnsWithItsFields) {
  GaussianPrimitive g{.fields = 2, .center = {0.5, 0.3}};
  g.scale[0][0] = 8.0;
  g.scale[1][1] = 3.0;
  GaussianPrimitive swapped{.fields = 2, .center = {0.3, 0.5}};
  swapped.scale[0][1] = 8.0;
  swapped.scale[1][0] = 3.0;
  EXPECT_DOUBLE_EQ(g.mean({{0.4, 0.2}}, {{0.6, 0.7}}), swapped.mean({{0.2, 0.4}}, {{0.7, 0.6}}));
}

TEST(GaussianPrimitive, IsNeverMoreThanItsMostInABox) {
  test::RandomSegments random(15);
  for (int i = 0; i < 10000; ++i) {
    const GaussianPrimitive primitive = random.primitive(1 + i % 4, i % 8 >= 4);
    const Segment segment = random.near(primitive);
    FieldSample low = segment.a, high = segment.b;
    for (std::size_t j = 0; j < 4; ++j)
      std::tie(low.values[j], high.values[j]) =
          std::minmax({segment.a.values[j], segment.b.values[j]});
    std::tie(low.gradient, high.gradient) = std::minmax({segment.a.gradient, segment.b.gradient});
    EXPECT_LE(primitive.mean(segment.a, segment.b), primitive.most(low, high) + 1e-12);
  }
}

// --- the classifier ------------------------------------------------------------------------------

TEST(GaussianClassifier, GivesEachPrimitiveAChannelWhoseSumIsTheClassification) {
  const auto classifier =
      read({{"kind", "gaussian"},
            {"fields", {"T"}},
            {"primitives",
             {{{"name", "cold"}, {"center", {0.2}}, {"width", {0.1}}, {"opacity", 0.25}},
              {{"name", "hot"}, {"center", {0.8}}, {"width", {0.3}}, {"color", "#ff0000"}}}}});
  EXPECT_EQ(classifier->channels(), (std::vector<std::string>{"cold", "hot"}));
  std::array<double, 2> weights{};
  classifier->weights(value(0.3), value(0.5), weights);
  EXPECT_NEAR(weights[0], line(0.2, 10.0).mean(value(0.3), value(0.5)), 1e-15);
  EXPECT_NEAR(weights[1], line(0.8, 1.0 / 0.3).mean(value(0.3), value(0.5)), 1e-15);
  const auto optics = classifier->optics(2.0);
  EXPECT_NEAR(optics[0].extinction, -std::log(0.75) / 2.0, 1e-15);
  EXPECT_EQ(optics[1].emission, glm::dvec3(optics[1].extinction, 0.0, 0.0));
  FeatureEdit off{"hot", {}, {}, false};
  classifier->edit({&off, 1});
  EXPECT_EQ(classifier->optics(2.0)[1].extinction, 0.0);
}

TEST(GaussianClassifier, WithoutPrimitivesIsATriangularOneAtTheMedians) {
  const std::vector<FieldDomain> domains{{0.0, 10.0, 4.0}, {-1.0, 1.0, 0.5}};
  const auto bare = read({{"kind", "gaussian"}, {"fields", {"T", "u"}}});
  ASSERT_EQ(bare->channels().size(), 1u);
  EXPECT_TRUE(bare->needsGradient());
  const json resolved = bare->resolved(domains, 0.25)->json().at("primitives")[0];
  EXPECT_EQ(resolved.at("center"), json({4.0, 0.5}));
  EXPECT_EQ(resolved.at("width"), json({10.0, 2.0}));
  EXPECT_EQ(resolved.at("thickness"), 0.25);
}

TEST(GaussianClassifier, FillsInOnlyWhatIsMissing) {
  const std::vector<FieldDomain> domains{{0.0, 10.0, 4.0}, {-1.0, 1.0, 0.5}};
  const auto centred = read(with({{"center", {1, 0}}}))->resolved(domains, 0.25)->json();
  EXPECT_EQ(centred.at("primitives")[0].at("center"), json({1.0, 0.0}));
  EXPECT_EQ(centred.at("primitives")[0].at("thickness"), 0.25);
  const auto wide = read(with({{"width", {2, 3}}}))->resolved(domains, 0.25)->json();
  EXPECT_EQ(wide.at("primitives")[0].at("center"), json({4.0, 0.5}));
  EXPECT_FALSE(wide.at("primitives")[0].contains("thickness"));
  EXPECT_FALSE(read(with({{"width", {2, 3}}}))->needsGradient());
  const auto thick = read(with({{"thickness", 7}}))->resolved(domains, 0.25)->json();
  EXPECT_EQ(thick.at("primitives")[0].at("width"), json({10.0, 2.0}));
  EXPECT_EQ(thick.at("primitives")[0].at("thickness"), 7.0);
}

TEST(GaussianClassifier, WeighsNormalisedValuesAsItWeighsValues) {
  const std::vector<FieldDomain> domains{{100.0, 300.0, 150.0}, {-1.0, 3.0, 0.5}};
  const auto classifier = read(with({{"center", {210, 1}}, {"matrix", {0.05, 0.4, -0.01, 2.0}}}));
  const auto normalised = classifier->normalised(domains);
  double raw = 0.0, unit = 0.0;
  classifier->weights({{190, 0.5}}, {{230, 1.5}}, {&raw, 1});
  normalised->weights({{0.45, 0.375}}, {{0.65, 0.625}}, {&unit, 1});
  EXPECT_NEAR(raw, unit, 1e-12);
  EXPECT_GT(raw, 0.1);
}

TEST(GaussianClassifier, VanishesOnlyWhereNoPrimitiveWeighsAnything) {
  const auto classifier = read(with({{"center", {0.5}}, {"width", {0.1}}}, 1));
  EXPECT_TRUE(classifier->vanishes(value(0.9), value(1.0)));
  EXPECT_FALSE(classifier->vanishes(value(0.0), value(1.0)));
  EXPECT_FALSE(classifier->vanishes(value(0.6), value(1.0)));
}

TEST(GaussianClassifier, ReadsWhatItWrites) {
  const json object = {{"kind", "gaussian"},
                       {"fields", {"T", "u"}},
                       {"primitives",
                        {{{"name", "front"},
                          {"center", {1, 2}},
                          {"width", {0.5, 4.0}},
                          {"opacity", 0.125},
                          {"color", {1.0, 0.0, 0.0}},
                          {"enabled", false}},
                         {{"name", "tilted"}, {"center", {3, 4}}, {"matrix", {1.0, 0.5, 0.0, 2.0}}},
                         {{"name", "edge"}, {"thickness", 0.5}},
                         {{"name", "open"}}}}};
  const json written = read(object)->json();
  EXPECT_EQ(read(written)->json(), written);
  for (std::size_t i = 0; i < 4; ++i)
    for (const auto& [key, entry] : object["primitives"][i].items()) {
      if (key != "color") {
        EXPECT_EQ(written["primitives"][i].at(key), entry) << key;
      }
    }
  EXPECT_NEAR(written["primitives"][0]["color"][0].get<double>(), 1.0, 1e-12);
  EXPECT_FALSE(written["primitives"][3].contains("center"));
}

TEST(GaussianClassifier, WritesAPrimitiveAsItIsRead) {
  test::RandomSegments random(16);
  for (int n = 1; n <= 4; ++n) {
    const GaussianPrimitive primitive = random.primitive(n, true);
    const auto classifier = read(with(primitiveJson(primitive), n));
    const Segment segment = random.near(primitive);
    double weight = 0.0;
    classifier->weights(segment.a, segment.b, {&weight, 1});
    EXPECT_NEAR(weight, primitive.mean(segment.a, segment.b), 1e-12);
  }
}

TEST(GaussianClassifier, NamesTheKeyThatIsWrong) {
  const json good = {{"center", {1, 2}}, {"width", {1, 2}}};
  const auto but = [&](const char* key, const json& value) {
    json entry = good;
    entry[key] = value;
    return with(entry);
  };
  expectKeyError(but("center", {1}), "primitives[0].center", "must hold 2 numbers");
  expectKeyError(but("center", "x"), "primitives[0].center", "list of numbers");
  expectKeyError(but("width", {1, 0}), "primitives[0].width", "0 is not positive");
  expectKeyError(but("width", {1, -1}), "primitives[0].width", "-1 is not positive");
  expectKeyError(but("width", {1, 2, 3}), "primitives[0].width", "not 3");
  expectKeyError(but("matrix", {1, 0, 0, 1}), "primitives[0].matrix", "both given");
  expectKeyError(with({{"matrix", {1, 2, 3}}}), "primitives[0].matrix", "4 numbers, not 3");
  expectKeyError(but("thickness", 0), "primitives[0].thickness", "not positive");
  expectKeyError(but("thickness", "thick"), "primitives[0].thickness", "number");
  expectKeyError(but("opacity", 1.5), "primitives[0].opacity", "1.5");
  expectKeyError(but("opacity", -0.1), "primitives[0].opacity", "-0.1");
  expectKeyError(but("color", "red"), "primitives[0].color", "\"red\"");
  expectKeyError(but("color", {1, 2}), "primitives[0].color", "[1,2]");
  expectKeyError(but("color", {1, 2, 0}), "primitives[0].color", "[1,2,0]");
  expectKeyError(but("enabled", 1), "primitives[0].enabled", "true or false");
  expectKeyError(but("name", "a.b"), "primitives[0].name", "a.b");
  expectKeyError(but("name", ""), "primitives[0].name", "''");
  expectKeyError(but("widht", {1, 2}), "primitives[0].widht", "not known");
}

TEST(GaussianClassifier, RefusesNumbersThatAreNone) {
  json entry = {{"center", {1, 2}}, {"width", {1, 2}}};
  entry["center"][1] = NAN;
  expectKeyError(with(entry), "primitives[0].center", "nan");
  entry = {{"width", {INFINITY, 1.0}}};
  expectKeyError(with(entry), "primitives[0].width", "inf");
  entry = {{"matrix", {1.0, NAN, 0.0, 1.0}}};
  expectKeyError(with(entry), "primitives[0].matrix", "nan");
  entry = {{"thickness", INFINITY}};
  expectKeyError(with(entry), "primitives[0].thickness", "inf");
}

TEST(GaussianClassifier, RefusesAListThatMakesNoSense) {
  const json head = {{"kind", "gaussian"}, {"fields", {"T"}}};
  const auto primitives = [&](const json& list) {
    json object = head;
    object["primitives"] = list;
    return object;
  };
  expectKeyError(primitives(json::array()), "primitives", "empty");
  expectKeyError(primitives(3), "primitives", "list");
  expectKeyError(primitives(json::array({3})), "primitives[0]", "object");
  json many = json::array();
  for (int i = 0; i < 17; ++i) many.push_back(json::object());
  expectKeyError(primitives(many), "primitives", "17");
  expectKeyError(primitives({{{"name", "a"}}, {{"name", "a"}}}), "kind", "two features called 'a'");
}

TEST(GaussianClassifier, RefusesOtherNumbersOfFields) {
  expectKeyError({{"kind", "gaussian"}}, "fields", "0 names; gaussian takes 1 to 4");
  expectKeyError({{"kind", "gaussian"}, {"fields", {"a", "b", "c", "d", "e"}}}, "fields",
                 "5 names");
  expectKeyError({{"kind", "gaussian"}, {"fields", "T"}}, "fields", "list of names");
  expectKeyError({{"kind", "gaussian"}, {"fields", {1}}}, "fields", "list of names");
  expectKeyError({{"fields", {"T"}}}, "kind", "missing");
  expectKeyError({{"kind", "gauss"}, {"fields", {"T"}}}, "kind", "'gauss'; choices: gaussian");
  expectKeyError({{"kind", "gaussian"}, {"fields", {"T"}}, {"color", 1}}, "color", "not known");
}

}  // namespace
}  // namespace vestige
