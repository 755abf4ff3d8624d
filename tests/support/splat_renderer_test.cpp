// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/splat_renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace vestige::test {
namespace {

using nlohmann::json;

double psnrOf(const RgbPicture& a, const RgbPicture& b) {
  double square = 0.0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i)
    square += std::pow(double(a.rgb[i]) - double(b.rgb[i]), 2);
  return -10.0 * std::log10(square / double(a.rgb.size()));
}

/// Ray casting against splatting.
double agreement(const FieldScenes& scenes, const json& object, const glm::dvec3& forward,
                 ImageSize size, double deviation = 0.5) {
  const Box box = scenes.fields[0].domain();
  const auto classifier =
      classifierFromJson(object, "")->resolved(scenes.domains, 0.01 * box.diagonal());
  const std::vector<std::vector<ChannelOptics>> looks{classifier->optics(0.01 * box.diagonal())};
  const ClassifiedView view{.camera = frameBox(box, forward, {0, 0, 1}, size.aspect()),
                            .size = size};
  const RgbPicture splats = renderSplats(scenes, *classifier, looks[0], view, deviation);
  return psnrOf(renderClassified(scenes, *classifier, looks, view)[0], splats);
}

/// The CT head averaged over 4 x 4 x 2 samples: what is left is smooth against its grid only after
/// it has been resampled at `refinement` times as many points, where it is the same field.
Scene smallHead(int refinement) {
  const Scene whole = namedScene("ct", 0, {});
  Scene small = whole;
  small.values.clear();
  small.size = {64, 64, 54};
  small.spacing *= glm::dvec3(4, 4, 2);
  for (int z = 0; z < 54; ++z)
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x) {
        float sum = 0.0f;
        for (int i = 0; i < 32; ++i)
          sum += whole.at(4 * x + i % 4, 4 * y + i / 4 % 4, 2 * z + i / 16);
        small.values.push_back(sum / 32.0f);
      }
  Scene fine = small;
  fine.values.clear();
  fine.spacing /= double(refinement);
  for (int& count : fine.size) count = (count - 1) * refinement + 1;
  for (int z = 0; z < fine.size[2]; ++z)
    for (int y = 0; y < fine.size[1]; ++y)
      for (int x = 0; x < fine.size[0]; ++x)
        fine.values.push_back(
            float(small.sample(fine.origin + fine.spacing * glm::dvec3(x, y, z))));
  return fine;
}

TEST(SplatRenderer, DrawsAHomogeneousBoxExactly) {
  const Scene flat =
      makeScene("flat", 9, {glm::dvec3(0), glm::dvec3(1)}, [](glm::dvec3) { return 0.5; });
  const json object = {
      {"kind", "gaussian"},
      {"fields", {"f"}},
      {"primitives",
       {{{"center", {0.5}}, {"width", {1}}, {"opacity", 0.02}, {"color", "#ff8040"}}}}};
  for (const glm::dvec3 forward : {glm::dvec3(0, 1, 0), glm::dvec3(0.5, -1, 0.3)})
    EXPECT_GT(agreement(FieldScenes({flat}), object, forward, {48, 48}), 90.0);
}

TEST(SplatRenderer, AgreesWithRaysOnSmoothDataFromAnywhere) {
  const Scene smooth = namedScene("smooth", 64, {});
  const json object = {
      {"kind", "gaussian"},
      {"fields", {"f"}},
      {"primitives",
       {{{"center", {0.8}}, {"width", {0.2}}, {"color", "#ff4000"}},
        {{"center", {0.25}}, {"width", {0.2}}, {"opacity", 0.1}, {"color", "#0080ff"}}}}};
  for (const glm::dvec3 forward :
       {glm::dvec3(0, 1, 0), glm::dvec3(-1, 0.2, 0.1), glm::dvec3(0.6, 1, -0.7)})
    EXPECT_GT(agreement(FieldScenes({smooth}), object, forward, {96, 96}), 35.0);
}

TEST(SplatRenderer, ComesNearerToRaysAsTheGridGrowsFiner) {
  const json object = {
      {"kind", "materials"},
      {"fields", {"f"}},
      {"materials",
       {{{"mean", 0.1}, {"deviation", 0.15}, {"opacity", 0.0}},
        {{"mean", 0.6}, {"deviation", 0.15}, {"opacity", 0.2}, {"color", "#40ff40"}}}}};
  const auto at = [&](int n) {
    return agreement(FieldScenes({namedScene("blob", n, {})}), object, {0.3, 1, 0.2}, {64, 64});
  };
  const double coarse = at(16), fine = at(48);
  EXPECT_GT(fine, coarse + 6.0);
  EXPECT_GT(fine, 40.0);
}

TEST(SplatRenderer, AgreesWithRaysOnTheCtHead) {
  if (ctHeadPath().empty()) GTEST_SKIP() << "the CT head is not there: scripts/fetch-ct-head";
  const json object = {
      {"kind", "materials"},
      {"fields", {"ct"}},
      {"materials",
       {{{"mean", -1000.0}, {"deviation", 200.0}, {"opacity", 0.0}},
        {{"mean", 0.0}, {"deviation", 150.0}, {"opacity", 0.05}, {"color", "#e0a080"}},
        {{"mean", 900.0}, {"deviation", 350.0}, {"opacity", 0.6}}}}};
  const auto at = [&](int refinement) {
    return agreement(FieldScenes({smallHead(refinement)}), object, {0.5, 1, -0.2}, {80, 80});
  };
  const double coarse = at(1), fine = at(2);

  EXPECT_GT(coarse, 24.0);
  EXPECT_GT(fine, coarse + 2.0);
}

}  // namespace
}  // namespace vestige::test
