// SPDX-License-Identifier: BSD-3-Clause
//
// [[classifier]] through a session: two shared fields become proxies of their features.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "proxy/archive/archive.h"
#include "proxy/format/layout/feature_layout.h"
#include "simulation.h"

namespace vestige::test {
namespace {

constexpr const char* kTwoPrimitives = R"(
[[classifier]]
name = "front"
kind = "gaussian"
fields = ["f", "g"]
[[classifier.primitives]]
name = "hot"
center = [0.8, 0.3]
width = [0.4, 0.5]
color = "#ff4000"
opacity = 0.2
[[classifier.primitives]]
name = "rim"
)";

std::string withProxies(const std::string& proxies, const std::string& rest) {
  return std::string(kSmallImage) + "proxies = [" + proxies + "]\n" + rest;
}

/// The sample as "f", and a second field "g" at points or cells; in two blocks if asked.
class TwoFieldRun {
 public:
  explicit TwoFieldRun(const std::string& output, const std::string& config, bool halves = false)
      : run(output, config), halves_(halves) {
    for (std::size_t i = 0; i < sample_.values.size(); ++i)
      second_.push_back(0.5f + 0.4f * float(std::cos(0.01 * double(i))) * sample_.values[i]);
  }

  int step(std::int64_t cycle, bool cells = false) {
    const int location = cells ? VESTIGE_CELL : VESTIGE_POINT;
    for (int b = 0; b < (halves_ ? 2 : 1); ++b) {
      vestige_grid grid = sample_.grid;
      int first = 0;
      if (halves_) {
        // 16 layers: 0..8 and 8..15, with a ghost layer each.
        first = b == 0 ? 0 : 7;
        grid.points[2] = b == 0 ? 10 : 9;
        grid.ghosts[b == 0 ? 5 : 4] = 1;
        grid.first[2] = first;
      }
      const std::size_t offset = std::size_t(first) * 24 * 20;
      vestige_block(run.session, b, &grid);
      vestige_share_field(run.session, b, "f", VESTIGE_FLOAT32, VESTIGE_POINT, 1,
                          sample_.values.data() + offset, nullptr);
      vestige_share_field(run.session, b, "g", VESTIGE_FLOAT32, vestige_location(location), 1,
                          second_.data() + offset, nullptr);
    }
    return vestige_execute(run.session, cycle, 0.1 * double(cycle));
  }

  Simulation run;

 private:
  bool halves_;
  Sample sample_;
  std::vector<float> second_;
};

std::string archiveOf(const Folder& folder, const std::string& config, bool halves = false) {
  const std::string path = folder / (halves ? "halves.cdb" : "a.cdb");
  TwoFieldRun two(path, config, halves);
  EXPECT_EQ(two.run.opened, VESTIGE_OK) << two.run.error();
  EXPECT_EQ(two.step(1), VESTIGE_OK) << two.run.error();
  EXPECT_EQ(damageOf(path), "");
  return path;
}

ExrFile open(const std::string& path, const std::string& view, std::string_view kind,
             long cycle = 1, const std::string& name = "front") {
  const Archive archive(path);
  const ArchiveRow* row = archive.find(cycle, view, name, kind);
  if (!row) throw std::runtime_error("no " + std::string(kind) + " of " + view);
  EXPECT_TRUE(row->hasPreview());
  return archive.open(*row);
}

float sumOf(const std::vector<float>& values) {
  float sum = 0.0f;
  for (const float v : values) sum += v;
  return sum;
}

TEST(FeatureSession, ClassifiersAloneStoreFlatFeaturesAndNothingElse) {
  const Folder folder;
  const std::string path = archiveOf(folder, std::string(kSmallImage) + kTwoPrimitives);
  const Archive archive(path);
  EXPECT_EQ(archive.fields(), std::vector<std::string>{"front"});
  EXPECT_EQ(archive.proxies(), std::vector<std::string>{"features"});
  const FeatureImage image = featureImage(open(path, "front", kind::kFeatures).image());
  const FeatureOrigin& features = featuresOf(image.header);
  EXPECT_EQ(features.classifier->channels(), (std::vector<std::string>{"hot", "rim"}));
  EXPECT_EQ(features.classifier->fields(), (std::vector<std::string>{"f", "g"}));
  ASSERT_EQ(features.domains.size(), 2u);
  EXPECT_GT(features.domains[0].median, features.domains[0].low);
  EXPECT_NEAR(features.referenceLength, std::sqrt(3.0) / 100.0, 1e-6);
  EXPECT_EQ(image.header.size, (ImageSize{48, 40}));
  EXPECT_GT(sumOf(image.integral), 1.0f);
  EXPECT_GT(sumOf(image.attenuation), 1.0f);
}

TEST(FeatureSession, FieldsKeepTheirOwnProxiesBesideThem) {
  const Folder folder;
  const std::string path =
      archiveOf(folder, std::string(kSmallImage) + "[[field]]\nname = \"g\"\n" + kTwoPrimitives);
  const Archive archive(path);
  EXPECT_EQ(archive.fields(), (std::vector<std::string>{"g", "front"}));
  EXPECT_NE(archive.find(1, "front", "g", kind::kLength), nullptr);
  EXPECT_NE(archive.find(1, "front", "front", kind::kFeatures), nullptr);
}

TEST(FeatureSession, StacksHoldWhatTheFlatProxyHolds) {
  const Folder folder;
  const std::string config =
      withProxies("'features', 'sliced-features'",
                  std::string("[sliced]\nstacks = 'views'\nslabs = 6\n[[view]]\nset = 'axes'\n") +
                      kTwoPrimitives);
  const std::string path = archiveOf(folder, config);
  for (const char* view : {"front", "left", "top"}) {
    const FeatureImage image = featureImage(open(path, view, kind::kFeatures).image());
    const FeatureStack stack = readFeatureStack(open(path, view, kind::kSlicedFeatures));
    ASSERT_EQ(stack.slabs.size(), 6u);
    for (std::size_t at = 0; at < image.integral.size(); ++at) {
      double sum = 0.0;
      for (const auto& slab : stack.slabs) sum += slab[at];
      ASSERT_NEAR(sum, image.integral[at], 5e-3 * sum + 5e-4) << view;
    }
  }
}

TEST(FeatureSession, StacksOfASetHaveAPixelOnEverySample) {
  const Folder folder;
  const std::string path =
      archiveOf(folder, withProxies("'sliced-features'", "[sliced]\nslabs = 3\n") + kTwoPrimitives);
  const FeatureStack stack = readFeatureStack(open(path, "stack-top", kind::kSlicedFeatures));
  EXPECT_EQ(stack.header.size, (ImageSize{24, 20}));
  EXPECT_GT(sumOf(stack.slabs[1]), 0.1f);
}

TEST(FeatureSession, TheSplitOfTheDomainDoesNotMatter) {
  const Folder folder;
  const std::string config =
      withProxies("'features', 'sliced-features'", "[sliced]\nslabs = 5\nstacks = 'front'\n") +
      kTwoPrimitives;
  const std::string whole = archiveOf(folder, config), halves = archiveOf(folder, config, true);
  const FeatureImage a = featureImage(open(whole, "front", kind::kFeatures).image());
  const FeatureImage b = featureImage(open(halves, "front", kind::kFeatures).image());
  EXPECT_EQ(toJson(*a.header.features), toJson(*b.header.features));
  for (std::size_t at = 0; at < a.integral.size(); ++at) {
    ASSERT_NEAR(a.integral[at], b.integral[at], 5e-3 * a.integral[at] + 1e-5);
    ASSERT_NEAR(a.attenuation[at], b.attenuation[at], 5e-3);
  }
  const FeatureStack c = readFeatureStack(open(whole, "stack-front", kind::kSlicedFeatures));
  const FeatureStack d = readFeatureStack(open(halves, "stack-front", kind::kSlicedFeatures));
  for (std::size_t s = 0; s < c.slabs.size(); ++s)
    for (std::size_t at = 0; at < c.slabs[s].size(); ++at)
      ASSERT_NEAR(c.slabs[s][at], d.slabs[s][at], 2e-4) << "a step of storage";
}

TEST(FeatureSession, PrimitivesAreFittedToARegionOnceForAll) {
  const Folder folder;
  const std::string config = std::string(kSmallImage) + R"(
[output]
existing = "append"
[[classifier]]
kind = "gaussian"
fields = ["f", "g"]
[[classifier.primitives]]
name = "slice"
fit = { low = [0, 0, 0.5], high = [1, 1, 0.5], full = true }
[[classifier.primitives]]
name = "corner"
fit = { low = [0, 0, 0], high = [0.3, 0.3, 0.3] }
)";
  const std::string path = folder / "a.cdb";
  {
    TwoFieldRun two(path, config);
    ASSERT_EQ(two.step(1), VESTIGE_OK) << two.run.error();
    ASSERT_EQ(two.step(2), VESTIGE_OK) << two.run.error();
  }
  {
    TwoFieldRun again(path, config);  // a restart
    ASSERT_EQ(again.step(3), VESTIGE_OK) << again.run.error();
  }
  EXPECT_EQ(damageOf(path), "");
  const auto json = [&](long cycle) {
    return toJson(featuresOf(open(path, "front", kind::kFeatures, cycle, "features").header()));
  };
  const auto primitives = json(1)["classifier"]["primitives"];
  EXPECT_EQ(primitives[0]["matrix"].size(), 4u);
  EXPECT_EQ(primitives[1]["width"].size(), 2u);
  // Of f in the slice z = 0.5 (layer 7 or 8 of 16), sin x cos y averages out and 0.1 z is left.
  EXPECT_NEAR(primitives[0]["center"][0].get<double>(), 0.75, 0.15);
  EXPECT_EQ(json(2), json(1));
  EXPECT_EQ(json(3), json(1)) << "a restart keeps what the archive says";
}

TEST(FeatureSession, ARestartWithOtherFeaturesBeginsAnew) {
  const Folder folder;
  const std::string path = folder / "a.cdb";
  const std::string head = std::string(kSmallImage) + "[output]\nexisting = 'append'\n";
  {
    TwoFieldRun two(path, head + kTwoPrimitives);
    ASSERT_EQ(two.step(1), VESTIGE_OK) << two.run.error();
  }
  TwoFieldRun again(path, head +
                              "[[classifier]]\nname = 'front'\nkind = 'gaussian'\nfields = "
                              "['g']\n");
  ASSERT_EQ(again.step(2), VESTIGE_OK) << again.run.error();
  EXPECT_TRUE(again.run.logged("'front' has other fields or features than in the earlier run"));
  const ExrFile file = open(path, "front", kind::kFeatures, 2);
  EXPECT_EQ(featuresOf(file.header()).classifier->channels(), std::vector<std::string>{"median"});
}

TEST(FeatureSession, AGradientNormIsAFieldLikeOthers) {
  const Folder folder;
  const std::string path = archiveOf(folder, std::string(kSmallImage) + R"(
[[field]]
name = "steepness"
gradient_norm = ["f", "g"]
[[classifier]]
kind = "gaussian"
fields = ["g", "steepness"]
)");
  const Archive archive(path);
  EXPECT_EQ(archive.fields(), (std::vector<std::string>{"steepness", "features"}));
  const FeatureImage image =
      featureImage(open(path, "front", kind::kFeatures, 1, "features").image());
  const auto& domains = featuresOf(image.header).domains;
  // f changes by 0.3 of about 1.6 a node of 1/23 and g likewise: a few times the range a unit.
  EXPECT_GT(domains[1].high, 3.0);
  EXPECT_LT(domains[1].high, 100.0);
  EXPECT_GT(sumOf(image.integral), 0.1f);
}

TEST(FeatureSession, WhatMakesNoSenseIsSaidAtTheStep) {
  const auto refused = [](const std::string& config, int code, const std::string& words,
                          bool cells = false) {
    const Folder folder;
    TwoFieldRun two(folder / "a.cdb", config);
    ASSERT_EQ(two.run.opened, VESTIGE_OK) << two.run.error();
    EXPECT_EQ(two.step(1, cells), code);
    EXPECT_NE(two.run.error().find(words), std::string::npos) << two.run.error();
  };
  const auto over = [](const std::string& fields, const std::string& more = "") {
    return std::string(kSmallImage) + "[[classifier]]\nkind = 'gaussian'\nfields = [" + fields +
           "]\n" + more;
  };
  refused(over("'f', 'gg'"), VESTIGE_ERROR_NO_FIELD,
          "[[classifier]] 'features' names the field 'gg', which is neither configured nor shared; "
          "did you mean 'g'?");
  refused(over("'f', 'g'"), VESTIGE_ERROR_FIELD, "takes 'f' at points and 'g' at cells", true);
  refused(over("'f'", "name = 'g'\n"), VESTIGE_ERROR_CONFIG, "'g' has the name of a field");
  refused(over("'f'", "[[classifier.primitives]]\nfit = {low = [5, 5, 5], high = [6, 6, 6]}\n"),
          VESTIGE_ERROR_CONFIG, "primitives[0] cannot be fitted to the 0 samples from (5, 5, 5)");
  refused(std::string(kSmallImage) + "[[field]]\ngradient_norm = ['f', 'h']\n",
          VESTIGE_ERROR_NO_FIELD, "[[field]] 'gradient_norm' names the field 'h'");
}

}  // namespace
}  // namespace vestige::test
