// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/layout/feature_layout.h"

#include <nlohmann/json.hpp>
#include <random>

#include "proxy/base/durable_file.h"
#include "proxy/format/exr/exr_file.h"
#include "proxy/format/layout/proxy_check.h"
#include "tests/proxy/archive/archive_fixture.h"

namespace vestige::test {
namespace {

constexpr ImageSize kSize{19, 13};

FeatureOrigin someFeatures() {
  const auto json = nlohmann::json::parse(R"({"kind": "gaussian", "fields": ["t", "vorticity"],
    "primitives": [{"name": "T", "center": [300.5, 0.25], "width": [10, 0.1], "opacity": 0.25},
                   {"name": "rim", "color": "#ff8000", "thickness": 0.125, "center": [310, 0.5]},
                   {"name": "off", "enabled": false}]})");
  FeatureOrigin features;
  features.domains = {{280.0, 340.0, 301.25}, {0.0, 2.0 / 3.0, 0.01}};
  features.referenceLength = 0.05;
  features.classifier =
      classifierFromJson(json, "").get()->resolved(features.domains, features.referenceLength);
  return features;
}

ProxyHeader header() {
  ProxyHeader header = someHeader(kSize);
  header.field = "hot-front";
  header.partition.reset();
  header.base.reset();
  header.isovalues.clear();
  header.features = someFeatures();
  return header;
}

struct FeaturePlanes {
  std::vector<float> attenuation, transmittance, integral, moment;
};

/// Random planes; some pixels meet nothing.
FeaturePlanes somePlanes(const ProxyHeader& header) {
  const std::size_t pixels = header.size.pixels();
  FeaturePlanes planes{std::vector<float>(3 * pixels), std::vector<float>(pixels, 1.0f),
                       std::vector<float>(3 * pixels), std::vector<float>(3 * pixels)};
  const DepthRange range = depthRange(header.camera, header.domain);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (std::size_t i = 0; i < pixels; ++i) {
    if (i % 4 == 0) continue;
    double left = 1.0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double integral = 0.3 * header.domain.diagonal() * std::pow(10.0, -8.0 * unit(random));
      const double a = c < 2 ? 0.5 * left * unit(random) : 0.0;
      planes.integral[c * pixels + i] = float(integral);
      planes.moment[c * pixels + i] =
          float(integral * (range.low + unit(random) * (range.high - range.low)));
      planes.attenuation[c * pixels + i] = float(a);
      left -= a;
    }
    planes.transmittance[i] = float(left);
  }
  return planes;
}

ProxyImage someProxy(const ProxyHeader& header) {
  const FeaturePlanes planes = somePlanes(header);
  return featureProxy(header, planes.attenuation, planes.transmittance, planes.integral,
                      planes.moment);
}

/// An orthographic view from below, slabs of different thickness, rays that miss at the rim.
FeatureStack someStack() {
  FeatureStack stack{header(), {}};
  stack.header.camera = frameBox(stack.header.domain, {0, 0, 1}, {0, 1, 0}, kSize.aspect());
  stack.header.camera.viewHeight *= 1.2;
  const DepthRange range = depthRange(stack.header.camera, stack.header.domain);
  for (const double share : {0.0, 0.2, 0.3, 0.7, 1.0})
    stack.header.slabDepths.push_back(range.low + share * (range.high - range.low));
  const SlabChords chords(stack.header);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int s = 0; s < 4; ++s) {
    auto& slab = stack.slabs.emplace_back();
    for (int c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < kSize.pixels(); ++i)
        slab.push_back(i % 3 == 0 ? 0.0f : float(chords.chord(s, i) * std::pow(unit(random), 6.0)));
  }
  return stack;
}

ProxyImage written(const std::vector<std::byte>& bytes, const Folder& folder) {
  const fs::path path = folder / "features.exr";
  writeDurably(path, bytes);
  return ExrFile(path).image();
}

TEST(FeatureLayout, SharesAreStoredInStepsOfA4096th) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> exponent(-16.0, 0.0);
  for (int i = 0; i < 100000; ++i) {
    const double share = std::exp2(exponent(random));
    const float stored = storedShare(share);
    ASSERT_LE(std::abs(double(stored) - share), share < 0.5 ? 0x1p-13 : 0x1p-12) << share;
    ASSERT_EQ(storedShare(stored), stored) << "rounding twice changes nothing";
  }
  for (const double share : {0.0, -1.0, double(NAN)}) EXPECT_EQ(storedShare(share), 0.0f);
  for (const double share : {1.0, 1.5, HUGE_VAL}) EXPECT_EQ(storedShare(share), 1.0f);
}

TEST(FeatureLayout, TheClassifierSurvivesItsHeader) {
  const FeatureOrigin features = someFeatures();
  const FeatureOrigin back = featureOriginFromJson(toJson(features));
  EXPECT_EQ(toJson(back), toJson(features));
  EXPECT_EQ(back.classifier->channels(), features.classifier->channels());
  std::array<double, 3> a{}, b{};
  const FieldSample from{{299.0, 0.2}, 3.0}, to{{310.0, 0.4}, 5.0};
  features.classifier->weights(from, to, a);
  back.classifier->weights(from, to, b);
  EXPECT_EQ(a, b);
}

TEST(FeatureLayout, HeadersWithoutSenseAreRefused) {
  const nlohmann::json good = toJson(someFeatures());
  const auto refused = [&](const std::string& words, const auto& spoil) {
    nlohmann::json bad = good;
    spoil(bad);
    expectError(ErrorCode::Format, words, [&] { featureOriginFromJson(bad); });
  };
  refused("it is no object", [](auto& j) { j = 3; });
  refused("'classifier' is missing", [](auto& j) { j.erase("classifier"); });
  refused("'domains' is no list", [](auto& j) { j["domains"] = 1; });
  refused("a domain is no object", [](auto& j) { j["domains"][0] = 1; });
  refused("'high' is missing", [](auto& j) { j["domains"][0].erase("high"); });
  refused("a domain is 340 .. 340", [](auto& j) { j["domains"][0]["low"] = 340; });
  refused("2 fields have 1 domains", [](auto& j) { j["domains"].erase(1); });
  refused("'referenceLength' is 0", [](auto& j) { j["referenceLength"] = 0; });
  refused("classifier.primitives[0].width", [](auto& j) {
    j["classifier"]["primitives"][0]["width"] = {1, -1};
  });
  refused("'what'", [](auto& j) { j["classifier"]["kind"] = "what"; });
}

TEST(FeatureLayout, RaysSurviveStorageToTheStatedErrors) {
  const Folder folder;
  const ProxyHeader head = header();
  const FeaturePlanes planes = somePlanes(head);
  const ProxyImage made = someProxy(head);
  EXPECT_EQ(problemsOf(made), std::vector<std::string>{});
  const ProxyImage proxy = written(encodeExr(made), folder);
  EXPECT_EQ(problemsOf(proxy), std::vector<std::string>{});
  EXPECT_EQ(proxy.header.kind, kind::kFeatures);
  ASSERT_TRUE(proxy.header.features);
  EXPECT_EQ(toJson(*proxy.header.features), toJson(*head.features));
  const FeatureImage image = featureImage(proxy);
  const double diagonal = head.domain.diagonal();
  for (std::size_t at = 0; at < planes.integral.size(); ++at) {
    const double integral = planes.integral[at];
    ASSERT_NEAR(image.integral[at], integral,
                1.0001 * std::max(0x1p-9 * integral, 0x1p-25 * diagonal));
    ASSERT_NEAR(image.attenuation[at], planes.attenuation[at], proxy.part("attenuation").error);
    if (image.integral[at] > 0.0f) {
      ASSERT_NEAR(image.depth[at], planes.moment[at] / integral,
                  proxy.part("depth").error * 1.001 + 1e-5);
    } else {
      ASSERT_EQ(image.depth[at], 0.0f);
    }
  }
  // What is read is what was made, bit for bit.
  EXPECT_EQ(image.integral, featureImage(made).integral);
  EXPECT_EQ(image.depth, featureImage(made).depth);
  EXPECT_EQ(image.transmittance, featureImage(made).transmittance);
}

TEST(FeatureLayout, EachWrongValueOfAViewIsFound) {
  const ProxyImage good = someProxy(header());
  const auto expectProblem = [&](const char* part, std::size_t channel, std::size_t pixel,
                                 float value, const std::string& words) {
    ProxyImage image = good;
    for (ProxyPart& p : image.parts)
      if (p.name == part) p.channels[channel].values[pixel] = value;
    const std::vector<std::string> problems = problemsOf(image);
    ASSERT_FALSE(problems.empty()) << part << ": " << words;
    EXPECT_NE(problems[0].find(words), std::string::npos) << problems[0];
  };
  expectProblem("attenuation", 1, 5, -0.5f, "a fraction of light");
  expectProblem("attenuation", 0, 4, 0.5f, "add up to 1 with the transmittance");
  expectProblem("transmittance", 0, 5, NAN, "a fraction of light");
  expectProblem("integral", 2, 5, 1e6f, "a length within the domain");
  expectProblem("integral", 2, 5, NAN, "a length within the domain");
  expectProblem("depth", 2, 5, 1e6f, "a depth within the domain");
  expectProblem("depth", 2, 4, good.part("depth").channels[2].values[5],
                "0 where the integral is 0");
  for (const char* part : {"attenuation", "transmittance", "integral", "depth"}) {
    ProxyImage missing = good;
    std::erase_if(missing.parts, [&](const ProxyPart& p) { return p.name == part; });
    EXPECT_FALSE(problemsOf(missing).empty());
    expectError(ErrorCode::NotFound, part, [&] { featureImage(missing); });
  }
  ProxyImage nameless = good;
  nameless.header.features.reset();
  EXPECT_EQ(problemsOf(nameless), std::vector<std::string>{"it has no classifier"});
  expectError(ErrorCode::Format, "has no classifier", [&] { featureImage(nameless); });
  ProxyImage other = good;
  other.header.kind = kind::kMip;
  expectError(ErrorCode::Format, "is not one of features", [&] { featureImage(other); });
}

TEST(FeatureLayout, PlanesOfAnotherSizeAreRefused) {
  FeaturePlanes planes = somePlanes(header());
  planes.moment.pop_back();
  const auto make = [&](const ProxyHeader& head) {
    featureProxy(head, planes.attenuation, planes.transmittance, planes.integral, planes.moment);
  };
  expectError(ErrorCode::InvalidArgument, "moment has 740 values, 3 planes of 19 x 13 need 741",
              [&] { make(header()); });
  ProxyHeader nameless = header();
  nameless.features.reset();
  expectError(ErrorCode::InvalidArgument, "has no classifier", [&] { make(nameless); });
}

TEST(FeatureLayout, StacksGiveBackWhatRoundingLeft) {
  const Folder folder;
  FeatureStack stack = someStack();
  writeDurably(folder / "stack.exr", encodeFeatureStack(stack));
  const ExrFile file(folder / "stack.exr");
  EXPECT_EQ(problemsOf(file), std::vector<std::string>{});
  const FeatureStack read = readFeatureStack(file);
  EXPECT_EQ(read.header.kind, kind::kSlicedFeatures);
  EXPECT_EQ(read.header.slabDepths, stack.header.slabDepths);
  const SlabChords chords(stack.header);
  for (std::size_t s = 0; s < stack.slabs.size(); ++s)
    for (std::size_t at = 0; at < stack.slabs[s].size(); ++at) {
      const double integral = stack.slabs[s][at];
      const double chord = chords.chord(int(s), at % kSize.pixels());
      ASSERT_NEAR(read.slabs[s][at], integral, 0x1p-12 * 1.001 * chord);
    }
  roundToStored(stack);
  EXPECT_EQ(read.slabs, stack.slabs) << "what is stored can be had without a file";
}

TEST(FeatureLayout, StacksWithoutSenseAreNotWritten) {
  const auto refused = [&](const std::string& words, const auto& spoil) {
    FeatureStack bad = someStack();
    spoil(bad);
    expectError(ErrorCode::InvalidArgument, words, [&] { encodeFeatureStack(bad); });
  };
  refused("4 slabs have 4 depths", [](auto& s) { s.header.slabDepths.pop_back(); });
  refused("0 slabs, not 1 to 64", [](auto& s) { s.slabs.clear(); });
  refused("a slab of features has 740 values", [](auto& s) { s.slabs[2].pop_back(); });
  refused("has no classifier", [](auto& s) { s.header.features.reset(); });
  refused("is perspective", [](auto& s) { s.header.camera.projection = Projection::Perspective; });
}

/// What reading says of a stack after `change` was made to its file's image.
std::string complaintAbout(const std::function<void(ProxyImage&)>& change) {
  const Folder folder;
  ProxyImage image = written(encodeFeatureStack(someStack()), folder);
  change(image);
  writeDurably(folder / "bad.exr", encodeExr(image));
  const auto problems = problemsOf(ExrFile(folder / "bad.exr"));
  return problems.empty() ? "" : problems.front();
}

TEST(FeatureLayout, HostileStacksAreRefused) {
  const auto expectComplaint = [](const std::string& words, const auto& change) {
    const std::string said = complaintAbout(change);
    EXPECT_NE(said.find(words), std::string::npos) << said;
  };
  EXPECT_EQ(complaintAbout([](ProxyImage&) {}), "");
  for (const float value : {-0.5f, 1.5f, NAN})
    expectComplaint("must be a share 0 .. 1",
                    [=](ProxyImage& image) { image.parts[1].channels[2].values[130] = value; });
  expectComplaint("channel 'T' of part 'slab03' is 0.5 at pixel (0, 0)",
                  [](ProxyImage& image) { image.parts[3].channels[0].values[0] = 0.5f; });
  expectComplaint("it has 3 parts for 4 slabs", [](ProxyImage& image) { image.parts.pop_back(); });
  expectComplaint("has no part 'slab02'", [](ProxyImage& image) { image.parts[2].name = "x"; });
  expectComplaint("other channels than the classifier",
                  [](ProxyImage& image) { image.parts[0].channels.pop_back(); });
  expectComplaint("other channels than the classifier",
                  [](ProxyImage& image) { image.parts[0].channels[1].name = "x"; });
  expectComplaint("depths do not rise", [](ProxyImage& image) {
    std::swap(image.header.slabDepths[1], image.header.slabDepths[2]);
  });
  expectComplaint("it has -1 slabs", [](ProxyImage& image) { image.header.slabDepths.clear(); });
  expectComplaint("it has no classifier", [](ProxyImage& image) { image.header.features.reset(); });
  expectComplaint("is not orthographic", [](ProxyImage& image) {
    image.header.camera.projection = Projection::Perspective;
  });
  const Folder folder;
  writeDurably(folder / "other.exr", encodeExr(someProxy(header())));
  expectError(ErrorCode::Format, "not one of sliced features",
              [&] { readFeatureStack(ExrFile(folder / "other.exr")); });
}

}  // namespace
}  // namespace vestige::test
