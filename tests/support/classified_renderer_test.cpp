// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/classified_renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace vestige::test {
namespace {

constexpr ImageSize kSize{20, 20};
constexpr double kReference = 0.05;
const Box kBox{glm::dvec3(0.0), glm::dvec3(1.0)};

Scene ramp(int axis) {
  return makeScene("ramp", 9, kBox, [axis](glm::dvec3 p) { return p[axis]; });
}

ClassifiedView frontOf(const Box& box) {
  return {.camera = frameBox(box, {0, 1, 0}, {0, 0, 1}, 1.0), .size = kSize};
}

std::unique_ptr<Classifier> gaussian(const nlohmann::json& primitives, int fields = 1) {
  const std::vector<std::string> names{"a", "b"};
  return classifierFromJson(
      {{"kind", "gaussian"},
       {"fields", std::vector<std::string>(names.begin(), names.begin() + fields)},
       {"primitives", primitives}},
      "");
}

std::vector<std::vector<ChannelOptics>> lookOf(const Classifier& classifier) {
  return {classifier.optics(kReference)};
}

double meanDifference(const RgbPicture& a, const RgbPicture& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i)
    sum += std::abs(double(a.rgb[i]) - double(b.rgb[i]));
  return sum / double(a.rgb.size());
}

TEST(ClassifiedRenderer, AbsorbsAlongAHomogeneousMediumAsTheFormulaSays) {
  const Scene flat = makeScene("flat", 5, kBox, [](glm::dvec3) { return 0.5; });
  const auto classifier =
      gaussian({{{"center", {0.5}}, {"width", {0.1}}, {"opacity", 0.1}, {"color", "#ff0000"}}});
  const auto looks = lookOf(*classifier);
  const RgbPicture picture =
      renderClassified(FieldScenes({flat}), *classifier, looks, frontOf(kBox))[0];
  const std::size_t pixel = 3 * (10 * 20 + 10);
  EXPECT_NEAR(picture.rgb[pixel], 1.0 - std::pow(0.9, 1.0 / kReference), 1e-6);
  EXPECT_EQ(picture.rgb[pixel + 1], 0.0f);
}

TEST(ClassifiedRenderer, IntegratesAThinSheetWhateverTheSteps) {
  // The field is linear: the analytic integral is exact at any step.
  const auto classifier = gaussian({{{"center", {0.5}}, {"width", {0.01}}, {"opacity", 0.9}}});
  const auto looks = lookOf(*classifier);
  ClassifiedView view = frontOf(kBox);
  view.samplesPerVoxel = 1;
  const FieldScenes scenes({ramp(1)});
  const RgbPicture coarse = renderClassified(scenes, *classifier, looks, view)[0];
  const double depth = 0.01 * std::sqrt(M_PI) * -std::log(0.1) / kReference;
  EXPECT_NEAR(coarse.rgb[3 * (10 * 20 + 10)], 1.0 - std::exp(-depth), 1e-6);
}

TEST(ClassifiedRenderer, ConvergesWithSamplesOverTwoFieldsAndAGradient) {
  const Scene smooth = namedScene("smooth", 24, {});
  Scene second = smooth;
  for (std::size_t i = 0; i < second.values.size(); ++i)
    second.values[i] = 1.0f - second.values[i] * second.values[i];
  const FieldScenes scenes({smooth, second});
  const auto classifier = gaussian(
      {{{"center", {0.6, 0.5}}, {"width", {0.2, 0.5}}},
       {{"center", {0.3, 0.8}}, {"thickness", 0.2}, {"width", {1.0, 1.0}}, {"color", "#0000ff"}}},
      2);
  const auto looks = lookOf(*classifier);
  ClassifiedView view = frontOf(smooth.domain());
  std::vector<RgbPicture> pictures;
  for (const int samples : {2, 8, 32}) {
    view.samplesPerVoxel = samples;
    pictures.push_back(renderClassified(scenes, *classifier, looks, view)[0]);
  }
  EXPECT_LT(meanDifference(pictures[1], pictures[2]), 1e-3);
  EXPECT_LT(meanDifference(pictures[1], pictures[2]),
            0.25 * meanDifference(pictures[0], pictures[2]));
}

TEST(ClassifiedRenderer, DrawsEachOfSeveralLooksAsIfAlone) {
  const FieldScenes scenes({ramp(0), ramp(1)});
  const auto classifier = gaussian({{{"center", {0.5, 0.5}}, {"width", {0.3, 0.2}}},
                                    {{"center", {0.2, 0.8}}, {"width", {0.2, 0.3}}}},
                                   2);
  std::vector<std::vector<ChannelOptics>> looks = lookOf(*classifier);
  const FeatureEdit edit{"primitive0", 0.1, glm::dvec3(0, 1, 0), true};
  classifier->edit({&edit, 1});
  looks.push_back(classifier->optics(kReference));
  const ClassifiedView view = frontOf(kBox);
  const auto both = renderClassified(scenes, *classifier, looks, view);
  const auto alone = renderClassified(scenes, *classifier, {&looks[1], 1}, view);
  EXPECT_EQ(both[1].rgb, alone[0].rgb);
  EXPECT_NE(both[0].rgb, both[1].rgb);
}

/// What light makes of the middle of a picture of a ramp along an axis, seen along y.
double lightOn(const Classifier& classifier, int axis) {
  const auto looks = lookOf(classifier);
  const FieldScenes scenes({ramp(axis)});
  ClassifiedView view = frontOf(kBox);
  const auto middle = [&] {
    return double(renderClassified(scenes, classifier, looks, view)[0].rgb[3 * (10 * 20 + 10)]);
  };
  const double plain = middle();
  view.lit = true;
  return middle() / plain;
}

TEST(ClassifiedRenderer, LightsSurfacesThatFaceTheViewer) {
  const auto classifier = gaussian({{{"center", {0.5}}, {"width", {0.2}}, {"opacity", 0.05}}});
  EXPECT_NEAR(lightOn(*classifier, 1), 1.2, 1e-6);
  EXPECT_NEAR(lightOn(*classifier, 0), 0.3, 1e-6);
}

TEST(ClassifiedRenderer, LightsTheSurfacesOfDensity) {
  // Materials of one opacity have one extinction throughout; only their density has a slope.
  const auto classifier = classifierFromJson(
      {{"kind", "materials"},
       {"fields", {"f"}},
       {"materials",
        {{{"mean", 0.25}, {"deviation", 0.3}, {"density", 1.0}, {"opacity", 0.02}},
         {{"mean", 0.75}, {"deviation", 0.3}, {"density", 2.0}, {"opacity", 0.02}}}}},
      "");
  EXPECT_NEAR(lightOn(*classifier, 1), 1.2, 1e-6);
  EXPECT_NEAR(lightOn(*classifier, 0), 0.3, 1e-6);
}

TEST(ClassifiedRenderer, LightsInFullWhereDensityHasNoSlope) {
  const auto classifier = classifierFromJson(
      {{"kind", "materials"},
       {"fields", {"f"}},
       {"materials",
        {{{"mean", 0.25}, {"deviation", 0.3}, {"density", 1.7}, {"opacity", 0.01}},
         {{"mean", 0.75}, {"deviation", 0.3}, {"density", 1.7}, {"opacity", 0.02}}}}},
      "");
  EXPECT_NEAR(lightOn(*classifier, 0), 1.2, 1e-6);
}

TEST(ClassifiedRenderer, ShowsTheColourOfTheGreatestValue) {
  Scene scene = namedScene("blob", 24, {});
  scene.values[5] = NAN;
  const auto classifier = classifierFromJson(
      {{"kind", "maximum"}, {"fields", {"f"}}, {"colormap", "grey"}, {"range", {0, 1}}}, "");
  const FieldScenes scenes({scene});
  const ClassifiedView view = frontOf(scene.domain());
  const RgbPicture picture = renderMaximum(scenes, *classifier, view);
  Camera back = view.camera;
  back.position += back.forward * (back.nearDepth + back.farDepth);
  back.forward = -back.forward;
  const RgbPicture behind = renderMaximum(scenes, *classifier, {back, kSize});
  float most = 0.0f;
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      const auto i = 3 * std::size_t(y * kSize.width + x);
      const auto mirrored = 3 * std::size_t(y * kSize.width + kSize.width - 1 - x);
      EXPECT_NEAR(picture.rgb[i], behind.rgb[mirrored], 0.02) << "a maximum knows no order";
      most = std::max(most, picture.rgb[i]);
    }
  }
  const float greatest = *std::max_element(scene.values.begin(), scene.values.end(),
                                           [](float a, float b) { return !(a >= b); });
  EXPECT_NEAR(most, Colormap::named("grey").at(double(greatest)).r, 0.05);
}

TEST(ClassifiedRenderer, KnowsRangesAndMediansOfItsFields) {
  Scene scene = ramp(0);
  scene.low = -1.0;
  const FieldScenes scenes({scene});
  EXPECT_EQ(scenes.domains[0].range(), 2.0);
  EXPECT_NEAR(scenes.domains[0].median, 0.5, 1e-6);
  EXPECT_NEAR(scenes.sample({0.5, 0.5, 0.5}, true).gradient, 0.5, 1e-6);
  EXPECT_EQ(scenes.sample({0.5, 0.5, 0.5}, false).gradient, 0.0);
}

}  // namespace
}  // namespace vestige::test
