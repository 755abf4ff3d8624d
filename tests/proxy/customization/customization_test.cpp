// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/customization/customization.h"

#include <gtest/gtest.h>

#include <functional>
#include <glm/common.hpp>
#include <nlohmann/json.hpp>

#include "proxy/base/error.h"
#include "proxy/base/json_object.h"

namespace vestige {
namespace {

using nlohmann::json;

const Box kBox{{-1.0, 0.0, 10.0}, {3.0, 2.0, 13.0}};

Customization fromText(const std::string& text) { return customizationFromJson(json::parse(text)); }

TEST(Customization, IsTheSameAfterJson) {
  const Customization written = fromText(R"({"resolution": 48, "metric": "manhattan",
    "corners": [{}, {"opacity": 0.5}, {}, {}, {"gamma": 2}, {}, {}, {}],
    "seeds": [{"name": "heart", "position": [1, 1, 11], "extent": [0, 0.5, 1], "opacity": 3,
               "gamma": 0.5, "shift": [0.1, -0.2, 0.3], "enabled": false},
              {"position": [0, 0, 10], "blend": 0.25,
               "function": {"opacity": [[0, 0], [1, 0.5]], "referenceLength": 0.1,
                            "colormap": "magma", "colorRange": [0, 2]}}]})");
  EXPECT_EQ(written.resolution, 48);
  EXPECT_EQ(written.metric, SeedMetric::Manhattan);
  EXPECT_EQ(written.corners[1].opacity, 0.5);
  EXPECT_EQ(written.seeds[0].parameters.shift, glm::dvec3(0.1, -0.2, 0.3));
  EXPECT_FALSE(written.seeds[0].enabled);
  EXPECT_EQ(written.seeds[1].parameters.function->colorRange->second, 2.0);
  EXPECT_EQ(customizationFromJson(json::parse(toJson(written).dump())), written);
}

TEST(Customization, OneTableOfCornersStandsForAllEight) {
  for (const SeedParameters& corner : fromText(R"({"corners": {"opacity": 0}})").corners)
    EXPECT_EQ(corner.opacity, 0.0);
}

TEST(Customization, AFunctionIsBlendedToFullyUnlessBlendSaysOtherwise) {
  const auto blend = [](const char* rest) {
    return fromText(std::string(R"({"seeds": [{"position": [0,0,0], "function": {})") + rest +
                    "}]}")
        .seeds[0]
        .parameters.blend;
  };
  EXPECT_EQ(blend(""), 1.0);
  EXPECT_EQ(blend(R"(, "blend": 0.5)"), 0.5);
}

TEST(Customization, AFunctionKeepsWhatIsLeftOutOfTheBase) {
  const TransferFunction base({{0.0, 0.25}}, 2.0, Colormap::named("viridis"), 0.0, 1.0);
  BlendFunction function;
  EXPECT_EQ(toJson(function.over(base)), toJson(base));
  function.colormap = "magma";
  EXPECT_EQ(function.over(base).colormap().name(), "magma");
  EXPECT_EQ(function.over(base).opacityPoints(), base.opacityPoints());
}

TEST(Customization, PrimitivesAreGroupsOfSeedsAtTheirCorners) {
  Customization customization;
  const auto seedsOf = [&](glm::dvec3 extent) {
    customization.seeds = {{"", {1.0, 1.0, 11.0}, extent, true, {}}};
    const auto points = customization.points(kBox);
    for (const SeedPoint& point : points) {
      if (point.primitive < 0) continue;
      EXPECT_EQ(glm::abs(point.position - customization.seeds[0].position), 0.5 * extent);
    }
    return points.size() - 8;
  };
  EXPECT_EQ(seedsOf({0.0, 0.0, 0.0}), 1u);
  EXPECT_EQ(seedsOf({0.0, 0.5, 0.0}), 2u);
  EXPECT_EQ(seedsOf({0.5, 0.0, 1.0}), 4u);
  EXPECT_EQ(seedsOf({0.5, 0.25, 1.0}), 8u);
}

TEST(Customization, VolumeHoldsTheParametersOfCornersAndSeedsExactly) {
  const Customization customization = fromText(R"({
    "corners": [{}, {"opacity": 0.5}, {}, {}, {"gamma": 2}, {}, {}, {"shift": [0.5, 0, -1]}],
    "seeds": [{"position": [1, 1, 11.5], "opacity": 3, "function": {"colormap": "magma"}}]})");
  const CustomVolume volume = customVolume(customization, kBox);
  EXPECT_EQ(volume.nodes, glm::ivec3(64, 33, 48));
  EXPECT_EQ(volume.at(kBox.corner(0)).opacity, 1.0f);
  EXPECT_EQ(volume.at(kBox.corner(1)).opacity, 0.5f);
  EXPECT_EQ(volume.at(kBox.corner(4)).gamma, 2.0f);
  EXPECT_EQ(volume.at(kBox.corner(7)).shift, glm::vec3(0.5f, 0.0f, -1.0f));
  // A seed between nodes stands on the nearest one.
  const glm::dvec3 node = kBox.low + kBox.size() * glm::dvec3(32.0 / 63, 0.5, 24.0 / 47);
  EXPECT_NEAR(volume.at(node).opacity, 3.0f, 1e-5f);
  EXPECT_NEAR(volume.at(node).shares.x, 1.0f, 1e-5f);
}

TEST(Customization, CornersAloneMakeAGradient) {
  // [Brix 2015, §4.4]: the default seeds apply simple gradients.
  Customization customization;
  customization.resolution = 32;
  for (std::size_t i = 0; i < 8; ++i) customization.corners[i].opacity = i & 1 ? 2.0 : 0.0;
  const CustomVolume volume = customVolume(customization, {{0, 0, 0}, {1, 1, 1}});
  double previous = -1.0;
  for (double x = 0.0; x <= 1.0; x += 0.0625) {
    const double here = volume.at({x, 0.5, 0.5}).opacity;
    EXPECT_GE(here, previous);
    EXPECT_NEAR(here + volume.at({1.0 - x, 0.5, 0.5}).opacity, 2.0, 0.05);
    previous = here;
  }
  EXPECT_GT(previous, 1.5);
}

TEST(Customization, DisabledSeedsAreAsIfTheyWereNotThere) {
  Customization with = fromText(R"({"resolution": 32, "seeds": [
    {"position": [1, 1, 11], "opacity": 0}, {"position": [0, 1, 11], "gamma": 3}]})");
  with.seeds[1].enabled = false;
  Customization without = with;
  without.seeds.pop_back();
  EXPECT_EQ(customVolume(with, kBox).optics, customVolume(without, kBox).optics);
  EXPECT_EQ(customVolume(with, kBox).values, customVolume(without, kBox).values);
  EXPECT_FALSE(with.hasGamma());
  with.seeds[0].enabled = false;
  EXPECT_TRUE(with.isNeutral());
}

TEST(Customization, OfSeedsOnOneNodeTheLastOneCounts) {
  const Customization customization = fromText(R"({"resolution": 32, "seeds": [
    {"position": [1, 1, 11], "opacity": 0}, {"position": [1, 1, 11.001], "opacity": 5},
    {"position": [-1, 0, 10], "opacity": 7}]})");
  const CustomVolume volume = customVolume(customization, kBox);
  EXPECT_EQ(std::count_if(volume.optics.begin(), volume.optics.end(),
                          [](const glm::vec4& o) { return o.x < 0.99f; }),
            0);
  EXPECT_EQ(volume.at(kBox.corner(0)).opacity, 7.0f);
}

TEST(Customization, ACoarserOneDiffersInResolutionAlone) {
  Customization customization;
  customization.resolution = 128;
  customization.seeds.emplace_back().position = {1.0, 1.0, 11.0};
  const Customization coarse = customization.coarse();
  EXPECT_EQ(coarse.resolution, 32);
  customization.resolution = 32;
  EXPECT_EQ(coarse, customization);
}

TEST(Customization, AFlatDomainHasOneNodeAcross) {
  const Customization customization =
      fromText(R"({"resolution": 33, "seeds": [{"position": [0.5, 0.5, 0], "opacity": 0}]})");
  const CustomVolume volume = customVolume(customization, {{0, 0, 0}, {1, 1, 0}});
  EXPECT_EQ(volume.nodes, glm::ivec3(33, 33, 1));
  EXPECT_LT(volume.at({0.5, 0.5, 0.0}).opacity, 0.05f);
}

TEST(Customization, ErrorsNameTheKey) {
  const std::pair<const char*, const char*> cases[] = {
      {R"({"resolution": 31})",
       "look key 'customization.resolution' is 31, it must be in [32, 128]"},
      {R"({"resolution": 40.5})", "look key 'customization.resolution' must be a whole number"},
      {R"({"metric": "chess"})",
       "look key 'customization.metric' is \"chess\"; choices: euclidean, manhattan"},
      {R"({"seed": []})",
       "look key 'customization.seed' is not known here (did you mean 'seeds'?); known: "
       "resolution, metric, corners, "
       "seeds"},
      {R"({"seeds": [{}]})", "look key 'customization.seeds[0].position' is missing"},
      {R"({"seeds": [{"position": [1, 2]}]})",
       "look key 'customization.seeds[0].position' must hold 3 numbers, not 2"},
      {R"({"seeds": [{"position": [1, 2, 3], "extent": [0, -1, 0]}]})",
       "look key 'customization.seeds[0].extent' is -1, it must be in [0, 1e+300]"},
      {R"({"seeds": [{"position": [1, 2, 3], "opacity": -1}]})",
       "look key 'customization.seeds[0].opacity' is -1, it must be in [0, 1000]"},
      {R"({"seeds": [{"position": [1, 2, 3], "gamma": 0}]})",
       "look key 'customization.seeds[0].gamma' is 0, it must be in [0.01, 100]"},
      {R"({"seeds": [{"position": [1, 2, 3], "shift": [0, 2, 0]}]})",
       "look key 'customization.seeds[0].shift' is 2, it must be in [-1, 1]"},
      {R"({"seeds": [{"position": [1, 2, 3], "blend": 0.5}]})",
       "look key 'customization.seeds[0].blend' needs a 'function' to blend to"},
      {R"({"seeds": [{"position": [1, 2, 3], "function": {"colour": 1}}]})",
       "look key 'customization.seeds[0].function.colour' is not known here; known: opacity, "
       "referenceLength, colormap, colorRange"},
      {R"({"seeds": [{"position": [1, 2, 3], "function": {"referenceLength": 0}}]})",
       "look key 'customization.seeds[0].function.referenceLength' is 0, it must be above 0"},
      {R"({"corners": [{}]})",
       "look key 'customization.corners' lists 1 corners, not 8: x low and high, then y, then z"},
      {R"({"corners": {"gamma": 101}})",
       "look key 'customization.corners.gamma' is 101, it must be in [0.01, 100]"}};
  for (const auto& [text, sentence] : cases) {
    try {
      fromText(text);
      ADD_FAILURE() << text;
    } catch (const KeyError& error) {
      EXPECT_STREQ(error.what(), sentence);
    }
  }
  json many{{"seeds", json::array()}};
  for (int i = 0; i < 4; ++i) {
    many["seeds"].push_back(
        {{"position", {0, 0, 0}}, {"function", {{"colorRange", {0.0, 1.0 + i}}}}});
  }
  EXPECT_THROW(customizationFromJson(many), KeyError);
  many["seeds"] = json(257, {{"position", {0, 0, 0}}});
  EXPECT_THROW(customizationFromJson(many), KeyError);
}

TEST(Customization, SeedsOutsideTheDomainAreNamed) {
  const Customization outside =
      fromText(R"({"seeds": [{"name": "moon", "position": [0, 5, 11], "opacity": 0}]})");
  const auto sentenceOf = [](const std::function<void()>& work) -> std::string {
    try {
      work();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::InvalidArgument);
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(sentenceOf([&] { customVolume(outside, kBox); }),
            "seed 0 'moon' stands at 0, 5, 11, outside the domain from -1, 0, 10 to 3, 2, 13");
  EXPECT_EQ(sentenceOf([&] {
              customVolume(Customization{}, {{1, 1, 1}, {1, 1, 1}});
            }),
            "a box of 0 x 0 x 0 has no room for seeds");
}

}  // namespace
}  // namespace vestige
