// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/support/random_segments.h"

namespace vestige {
namespace {

using nlohmann::json;
using test::Segment;

class ClassifierGlsl : public testing::Test {
 protected:
  static void SetUpTestSuite() { device_ = gl::Device::create(); }
  static void TearDownTestSuite() { device_.reset(); }

  /// The greatest difference between a normalised classifier's weights and its shader's; infinite
  /// where the latter are not in [0, 1], up to the rounding of a sum.
  static double worst(const Classifier& classifier, const std::vector<Segment>& segments) {
    const std::vector<double> cpu = test::classifyOnCpu(classifier, segments);
    const std::vector<float> gpu = test::classifyOnGpu(*device_, classifier, segments);
    double most = 0.0;
    for (std::size_t i = 0; i < cpu.size(); ++i) {
      const double difference = std::abs(cpu[i] - double(gpu[i]));
      const bool bounded = gpu[i] >= 0.0f && gpu[i] <= 1.000001f;
      most = bounded ? std::max(most, difference) : double(INFINITY);
    }
    return most;
  }

  static std::shared_ptr<gl::Device> device_;
};
std::shared_ptr<gl::Device> ClassifierGlsl::device_;

json fieldNames(int count) {
  const std::vector<std::string> names{"a", "b", "c", "d"};
  return std::vector<std::string>(names.begin(), names.begin() + count);
}

// --- gaussian ------------------------------------------------------------------------------------

TEST_F(ClassifierGlsl, IntegratesGaussiansWithin2e6OfTheirWeightsOver100000Segments) {
  test::RandomSegments random(21);
  for (int round = 0; round < 100; ++round) {
    const int fields = 1 + round % 4;
    json object = {{"kind", "gaussian"}, {"fields", fieldNames(fields)}};
    std::vector<GaussianPrimitive> primitives;
    for (int i = 0; i < 16; ++i) {
      primitives.push_back(random.primitive(fields, i % 2 == 1, 30.0));
      object["primitives"].push_back(primitiveJson(primitives.back()));
    }
    std::vector<Segment> segments;
    for (std::size_t i = 0; i < 1024; ++i) {
      Segment segment = random.near(primitives[i % 16]);
      if (i % 2 == 0) segment.a.gradient = segment.b.gradient = 0.5;
      segments.push_back(segment);
    }
    ASSERT_LE(worst(*classifierFromJson(object, ""), segments), 2e-6) << "round " << round;
  }
}

TEST_F(ClassifierGlsl, KeepsToTheLimitsOfGaussians) {
  const auto classifier =
      classifierFromJson({{"kind", "gaussian"},
                          {"fields", {"a"}},
                          {"primitives",
                           {{{"center", {0.5}}, {"width", {0.1}}},
                            {{"center", {0.5}}, {"width", {1.0}}, {"thickness", 0.1}}}}},
                         "");
  const auto segment = [](double a, double b, double ga, double gb) {
    return Segment{{{a, 0, 0, 0}, ga}, {{b, 0, 0, 0}, gb}};
  };
  EXPECT_LE(worst(*classifier,
                  {segment(0.45, 0.45, 0, 0), segment(0.5, 0.5, 0, 0), segment(0.45, 0.45, 1, 1),
                   segment(0, 1, 0, 0), segment(0, 1, 1e-30, 1e-30), segment(0.5, 0.5, 1e-30, 0),
                   segment(0.3, 0.7, 1e20, 1e20), segment(-1e4, 1e4, 1, 1), segment(1e4, 1e4, 1, 1),
                   segment(0.45, 0.450001, 1, 1)}),
            2e-6);
}

// --- other kinds ---------------------------------------------------------------------------------

/// Segments between values in [0, 1], their length up to `most` of that.
std::vector<Segment> segmentsUpTo(double most) {
  std::mt19937 random(23);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  std::vector<Segment> segments(4096);
  for (Segment& segment : segments) {
    for (std::size_t i = 0; i < 3; ++i) {
      segment.a.values[i] = any(random);
      segment.b.values[i] = segment.a.values[i] + most * (any(random) - segment.a.values[i]);
    }
    segment.a.gradient = 4.0 * any(random) * any(random);
    segment.b.gradient = 4.0 * any(random) * any(random);
    segment = test::rounded(segment);
  }
  return segments;
}

TEST_F(ClassifierGlsl, IntegratesBoundariesWithin2e6) {
  const FieldDomain unit;
  const auto classifier = classifierFromJson(
      {{"kind", "boundaries"},
       {"fields", {"a"}},
       {"boundaries",
        {{{"value", 0.25}, {"thickness", 0.125}}, {{"value", 0.5}, {"thickness", 0.015625}}}}},
      "");
  auto segments = segmentsUpTo(1.0);
  segments.push_back({{{0.25, 0, 0, 0}, 0.0}, {{0.25, 0, 0, 0}, 0.0}});
  segments.push_back({{{0.25, 0, 0, 0}, 0.0}, {{0.5, 0, 0, 0}, 0.0}});
  segments.push_back({{{0.3, 0, 0, 0}, 1.0}, {{0.3, 0, 0, 0}, 1.0}});
  EXPECT_LE(worst(*classifier->resolved({&unit, 1}, 1.0), segments), 2e-6);
  EXPECT_LE(worst(*classifier->resolved({&unit, 1}, 1.0), segmentsUpTo(0.01)), 2e-6);
}

json materials() {
  return {{"kind", "materials"},
          {"fields", {"a"}},
          {"materials",
           {{{"mean", 0.0}, {"deviation", 0.02}},
            {{"mean", 0.25}, {"deviation", 0.01}},
            {{"mean", 0.28}, {"deviation", 0.0125}},
            {{"mean", 0.5}, {"deviation", 0.1}}}}};
}

TEST_F(ClassifierGlsl, IntegratesMaterialsByAQuadratureOfStatedError) {
  const auto classifier = classifierFromJson(materials(), "");
  // Segments no longer than the least deviation, which is how a field is to be sampled, and any.
  EXPECT_LE(worst(*classifier, segmentsUpTo(0.0)), 2e-5);
  EXPECT_LE(worst(*classifier, segmentsUpTo(0.01)), 2e-3);
  EXPECT_LE(worst(*classifier, segmentsUpTo(1.0)), 0.12);
}

TEST_F(ClassifierGlsl, KeepsValuesFarFromEveryMaterialOutOfZeroByZero) {
  const auto classifier = classifierFromJson(materials(), "");
  const Segment far{{{1e4, 0, 0, 0}, 0.0}, {{1e4, 0, 0, 0}, 0.0}};
  EXPECT_LE(worst(*classifier, {far}), 1e-6);
}

TEST_F(ClassifierGlsl, IntegratesColoursByAQuadratureOfStatedError) {
  for (const char* encoding : {"srgb", "linear"}) {
    for (const char* weight : {"luminance", "constant"}) {
      const auto classifier = classifierFromJson({{"kind", "color"},
                                                  {"fields", {"r", "g", "b"}},
                                                  {"encoding", encoding},
                                                  {"weight", weight}},
                                                 "");
      EXPECT_LE(worst(*classifier, segmentsUpTo(0.0)), 2e-6) << encoding << " " << weight;
      EXPECT_LE(worst(*classifier, segmentsUpTo(1.0)), 4e-5) << encoding << " " << weight;
      json clamped = classifier->json();
      clamped["range"] = {0.25, 0.75};
      EXPECT_LE(worst(*classifierFromJson(clamped, ""), segmentsUpTo(1.0)), 0.06)
          << encoding << " " << weight;
    }
  }
}

}  // namespace
}  // namespace vestige
