// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "proxy/transfer/colormap.h"
#include "tests/proxy/classifier/classifier_fixture.h"

namespace vestige::test {
namespace {

using nlohmann::json;

const FieldDomain kDomain{-100.0, 300.0, 0.0};

json vessels() {
  return {{"kind", "maximum"}, {"fields", {"ct"}}, {"colormap", "hot"}, {"range", {0, 200}}};
}

TEST(Maximum, HasNoWeightsButAColourForEveryValue) {
  const auto classifier = read(vessels());
  EXPECT_TRUE(classifier->channels().empty());
  EXPECT_TRUE(classifier->optics(1.0).empty());
  EXPECT_TRUE(weightsOf(*classifier, value(0), value(1)).empty());
  EXPECT_FALSE(classifier->vanishes(value(0), value(1)));
  ASSERT_NE(classifier->maximum(), nullptr);
  EXPECT_EQ(classifier->maximum()->color(50.0), Colormap::named("hot").at(0.25));
  EXPECT_EQ(classifier->maximum()->color(-1e9), Colormap::named("hot").at(0.0));
  EXPECT_EQ(classifier->maximum()->color(1e9), Colormap::named("hot").at(1.0));
  EXPECT_EQ(classifier->maximum()->color(NAN), glm::dvec3(0.0));
}

TEST(Maximum, SpansTheFieldByDefaultInViridis) {
  const auto classifier =
      read({{"kind", "maximum"}, {"fields", {"ct"}}})->resolved({&kDomain, 1}, 1.0);
  EXPECT_EQ(classifier->maximum()->color(300.0), Colormap::named("viridis").at(1.0));
  EXPECT_EQ(classifier->json()["range"], json({-100.0, 300.0}));
}

TEST(Maximum, ColoursNormalisedValuesAsItColoursValues) {
  const auto classifier = read(vessels())->resolved({&kDomain, 1}, 1.0);
  const auto unit = classifier->normalised({&kDomain, 1});
  const glm::dvec3 a = classifier->maximum()->color(120.0), b = unit->maximum()->color(0.55);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], 1e-12);
}

TEST(Maximum, StepsWhereItsRangeHasNoWidth) {
  json object = vessels();
  object["range"] = {50, 50};
  const auto classifier = read(object);
  EXPECT_EQ(classifier->maximum()->color(49.0), Colormap::named("hot").at(0.0));
  EXPECT_EQ(classifier->maximum()->color(51.0), Colormap::named("hot").at(1.0));
}

TEST(Maximum, ReadsWhatItWritesAndNamesTheKeyThatIsWrong) {
  const json written = read(vessels())->json();
  EXPECT_EQ(written, vessels());
  const auto but = [](const char* key, const json& to) {
    json object = vessels();
    object[key] = to;
    return object;
  };
  expectKeyError(but("colormap", "hott"), "colormap", "'hott'");
  expectKeyError(but("colormap", 1), "colormap", "string");
  expectKeyError(but("range", {1, 0}), "range", "lower first");
  expectKeyError(but("range", {1}), "range", "two numbers");
  expectKeyError(but("opacity", 1), "opacity", "not known");
  expectKeyError(but("fields", {"a", "b"}), "fields", "maximum takes 1");
}

}  // namespace
}  // namespace vestige::test
