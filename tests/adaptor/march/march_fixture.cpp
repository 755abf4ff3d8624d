// SPDX-License-Identifier: BSD-3-Clause
#include "tests/adaptor/march/march_fixture.h"

#include <cmath>

namespace vestige {
namespace {

double sumOfChannels(const std::vector<float>& planes, const RayImage& image, std::size_t pixel) {
  double sum = 0.0;
  for (int c = 0; c < image.channels; ++c) sum += planes[c * image.size.pixels() + pixel];
  return sum;
}

}  // namespace

double waves(glm::dvec3 p) {
  return 0.5 + 0.25 * std::sin(9.0 * p.x + 2.0 * p.y) * std::cos(7.0 * p.z - 3.0 * p.y) +
         0.2 * std::sin(11.0 * p.y + p.x);
}

Camera oblique(const Box& box, ImageSize size) {
  return frameBox(box, {0.8, 1.0, -0.6}, {0.0, 0.0, 1.0}, size.aspect());
}

Camera perspective(const Box& box, ImageSize size) {
  return frameBox(box, {-0.5, 1.0, 0.4}, {0.0, 0.0, 1.0}, size.aspect(), Projection::Perspective,
                  0.7);
}

double chord(const RayImage& image, const Camera& camera, std::size_t pixel) {
  if (image.entry[pixel] > image.exit[pixel]) return 0.0;
  const glm::dvec2 at{double(pixel % std::size_t(image.size.width)) + 0.5,
                      double(pixel / std::size_t(image.size.width)) + 0.5};
  return (double(image.exit[pixel]) - double(image.entry[pixel])) /
         camera.rayThrough(at, image.size).depthPerLength;
}

void expectInvariants(const RayImage& image, const MarchRequest& request) {
  std::size_t hits = 0;
  for (std::size_t i = 0; i < image.size.pixels(); ++i) {
    const double whole = sumOfChannels(image.attenuation, image, i) + image.transmittance[i];
    ASSERT_NEAR(whole, 1.0, 1e-5) << "pixel " << i;
    const double length = chord(image, request.camera, i);
    ASSERT_NEAR(sumOfChannels(image.length, image, i), length, 1e-5 * request.domain.diagonal());
    hits += image.entry[i] < image.exit[i];
    for (int c = 0; c < image.channels; ++c) {
      const std::size_t at = c * image.size.pixels() + i;
      ASSERT_GE(image.attenuation[at], -1e-6f);
      ASSERT_GE(image.length[at], 0.0f);
      ASSERT_EQ(image.runs[at] == 0.0f, image.length[at] == 0.0f);
      if (image.length[at] < 1e-4f * request.domain.diagonal()) continue;
      const double mean = double(image.moment[at]) / image.length[at];
      ASSERT_GE(mean, image.entry[i] - 1e-4 * request.domain.diagonal());
      ASSERT_LE(mean, image.exit[i] + 1e-4 * request.domain.diagonal());
    }
  }
  EXPECT_GT(hits, image.size.pixels() / 8);
}

void expectSame(const RayImage& a, const RayImage& b, double tolerance) {
  EXPECT_LE(greatestDifference(a.entry, b.entry), tolerance) << "entry";
  EXPECT_LE(greatestDifference(a.exit, b.exit), tolerance) << "exit";
  EXPECT_LE(greatestDifference(a.attenuation, b.attenuation), tolerance) << "attenuation";
  EXPECT_LE(greatestDifference(a.transmittance, b.transmittance), tolerance) << "transmittance";
  EXPECT_LE(greatestDifference(a.length, b.length), tolerance) << "length";
  EXPECT_LE(greatestDifference(a.moment, b.moment), 4.0 * tolerance) << "moment";
  EXPECT_LE(greatestDifference(a.depth, b.depth), tolerance) << "depth";
  EXPECT_LE(greatestDifference(a.normal, b.normal), 10.0 * tolerance) << "normal";
  EXPECT_LE(greatestDifference(a.mip, b.mip), tolerance) << "mip";
  EXPECT_LE(greatestDifference(a.reference, b.reference), tolerance) << "reference";
}

INSTANTIATE_TEST_SUITE_P(Backends, March, testing::Values("osmesa", "egl"),
                         [](const auto& backend) { return backend.param; });

}  // namespace vestige
