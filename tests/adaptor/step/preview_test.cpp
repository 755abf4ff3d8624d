// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/step/preview.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "proxy/format/image/proxy_image.h"

namespace vestige {
namespace {

/// Two pixels: the first holds something of interval 1 before interval 3, the second nothing.
struct Scene {
  Classification classification;
  RayImage rays;

  Scene() : classification(make()) {
    rays.size = {2, 1};
    rays.channels = classification.partition.channels();
    const auto planes = std::size_t(rays.channels) * 2;
    rays.attenuation.assign(planes, 0.0f);
    rays.length.assign(planes, 0.0f);
    rays.moment.assign(planes, 0.0f);
    rays.transmittance = {0.25f, 1.0f};
    rays.attenuation[2 * 1] = 0.5f;
    rays.attenuation[2 * 3] = 0.25f;
    rays.length[2 * 1] = 0.4f;
    rays.moment[2 * 1] = 0.4f * 2.0f;
    rays.length[2 * 3] = 0.3f;
    rays.moment[2 * 3] = 0.3f * 5.0f;
    const float none = std::numeric_limits<float>::infinity();
    rays.depth = {3.0f, none, 7.0f, none};
    rays.mip = {0.9f, std::numeric_limits<float>::quiet_NaN()};
    rays.reference = {0.2f, 0.0f, 0.1f, 0.0f, 0.3f, 0.0f};
  }
  static Classification make() {
    FieldStatistics statistics;
    statistics.count = 2;
    statistics.high = 1.0;
    FieldConfig config;
    config.intervals = 4;
    config.opacity = {{0.0, 0.5}, {1.0, 0.5}};
    return classify(config, statistics, 1.0);
  }
  /// 8-bit sRGB of linear light.
  static int byte(double linear) {
    return int(std::lround(255.0 * srgbFromLinear(glm::dvec3(linear)).x));
  }
};

void expectPixel(const Raster& raster, int pixel, glm::dvec3 linear, int alpha = 255) {
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(raster.rgba[std::size_t(4 * pixel + c)], Scene::byte(linear[c]), 1) << c;
  }
  EXPECT_EQ(raster.rgba[std::size_t(4 * pixel + 3)], alpha);
}

TEST(Preview, AttenuationIsTheSumOfItsIntervalsColours) {
  const Scene scene;
  const auto look = scene.classification.base.onIntervals(scene.classification.partition);
  const auto picture = preview(kind::kAttenuation, scene.rays, scene.classification, {});
  expectPixel(picture, 0, 0.5 * look.color[1] + 0.25 * look.color[3]);
  expectPixel(picture, 1, glm::dvec3(0.0));
}

TEST(Preview, LengthsAreRecomposedInTheOrderOfTheirMeanDepths) {
  const Scene scene;
  const auto look = scene.classification.base.onIntervals(scene.classification.partition);
  const double near = 1.0 - std::exp(-0.4 * look.extinction[1]);
  const double far = 1.0 - std::exp(-0.3 * look.extinction[3]);
  const auto picture = preview(kind::kLength, scene.rays, scene.classification, {});
  expectPixel(picture, 0, near * look.color[1] + (1.0 - near) * far * look.color[3]);
}

TEST(Preview, BackgroundShowsThroughOrIsLeftTransparent) {
  const Scene scene;
  const PreviewStyle white{glm::dvec3(1.0), false, 2};
  const auto over = preview(kind::kReference, scene.rays, scene.classification, white);
  expectPixel(over, 0, glm::dvec3(0.2, 0.1, 0.3) + 0.25);
  expectPixel(over, 1, glm::dvec3(1.0));
  const PreviewStyle clear{glm::dvec3(1.0), true, 1};
  const auto alone = preview(kind::kReference, scene.rays, scene.classification, clear);
  expectPixel(alone, 0, glm::dvec3(0.2, 0.1, 0.3) / 0.75, 191);
  EXPECT_EQ(alone.rgba[7], 0);
}

TEST(Preview, DepthShowsTheNearestLayerAndMipTheColourMap) {
  const Scene scene;
  const auto depth = preview(kind::kDepth, scene.rays, scene.classification, {});
  EXPECT_EQ(depth.rgba[0], 255);
  EXPECT_EQ(depth.rgba[4], 0);
  const auto mip = preview(kind::kMip, scene.rays, scene.classification, {});
  expectPixel(mip, 0, scene.classification.base.color(0.9f));
  expectPixel(mip, 1, glm::dvec3(0.0));
}

TEST(Preview, DoesNotDependOnThreads) {
  const Scene scene;
  for (const auto kind : {kind::kAttenuation, kind::kLength, kind::kDepth, kind::kMip}) {
    EXPECT_EQ(preview(kind, scene.rays, scene.classification, {{}, false, 1}).rgba,
              preview(kind, scene.rays, scene.classification, {{}, false, 4}).rgba);
  }
}

}  // namespace
}  // namespace vestige
