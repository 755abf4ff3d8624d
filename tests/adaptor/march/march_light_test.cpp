// SPDX-License-Identifier: BSD-3-Clause
//
// Attenuation and the reference picture under the base function.
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "proxy/base/error.h"
#include "tests/adaptor/march/march_fixture.h"

namespace vestige {
namespace {

TEST_P(March, UniformMediumAttenuatesExponentially) {
  const Scene scene = Scene::even({5, 5, 5}, kUnit, [](glm::dvec3) { return 0.8; });
  MarchRequest request = requestAll(kUnit, 0.0, 1.0, 4, perspective(kUnit));
  const double extinction = request.base.extinction(0.8);
  ASSERT_GT(extinction, 0.1);
  const RayImage image = marchWhole(marcher, scene, request);
  for (std::size_t i = 0; i < image.size.pixels(); ++i) {
    const double length = chord(image, request.camera, i);
    EXPECT_NEAR(image.transmittance[i], std::exp(-extinction * length), 1e-5);
    EXPECT_NEAR(image.attenuation[3 * image.size.pixels() + i],
                1.0 - std::exp(-extinction * length), 1e-5);
    EXPECT_EQ(image.runs[3 * image.size.pixels() + i], length > 0.0 ? 1.0f : 0.0f);
    EXPECT_EQ(image.first[i], length > 0.0 ? 3 : 255);
    for (int c = 0; c < 3; ++c) {
      const glm::dvec3 color = request.base.color(0.8);
      EXPECT_NEAR(image.reference[c * image.size.pixels() + i],
                  color[c] * (1.0 - std::exp(-extinction * length)), 1e-4);
    }
  }
}

TEST_P(March, AttenuationIsTheIntegralUnderTheBaseFunction) {
  // f = y along the ray; a_k from the extinction integrated finely in double.
  const Scene scene = Scene::even({4, 12, 4}, kUnit, [](glm::dvec3 p) { return p.y; });
  MarchRequest request =
      requestAll(kUnit, 0.0, 1.0, 5, frameBox(kUnit, {0, 1, 0}, {0, 0, 1}, 1.0), {4, 4});
  const RayImage image = marchWhole(marcher, scene, request);
  std::vector<double> expected(5);
  glm::dvec3 light{0.0};
  double depth = 0.0;
  constexpr int kSteps = 200000;
  for (int i = 0; i < kSteps; ++i) {
    const double f = (i + 0.5) / kSteps;
    const double next = depth + request.base.extinction(f) / kSteps;
    expected[std::size_t(request.partition.channelOf(f))] += std::exp(-depth) - std::exp(-next);
    light += request.base.color(f) * (std::exp(-depth) - std::exp(-next));
    depth = next;
  }
  const std::size_t pixel = 5, pixels = image.size.pixels();
  for (std::size_t c = 0; c < 5; ++c) {
    EXPECT_NEAR(image.attenuation[c * pixels + pixel], expected[c], 2e-5) << c;
  }
  EXPECT_NEAR(image.transmittance[pixel], std::exp(-depth), 2e-5);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(image.reference[c * pixels + pixel], light[int(c)], 1.0 / 255.0);
  }
}

/// Opaque within 1e-4 of the range around 0.4203 only.
TransferFunction spike() {
  return TransferFunction({{0.42025, 0.0}, {0.4203, 0.9}, {0.42035, 0.0}}, 0.01,
                          Colormap::named("inferno"), 0.0, 1.0);
}

TEST_P(March, SpikesNarrowerThanAnyTableKeepTheirOpticalDepth) {
  // f = y / 8 and more: the spike lies between two samples, wherever they stand.
  for (double slope : {0.125, 0.5, 1.0}) {
    SCOPED_TRACE("slope " + std::to_string(slope));
    const Scene scene = Scene::even({4, 12, 4}, kUnit,
                                    [&](glm::dvec3 p) { return 0.4203 + slope * (p.y - 0.4567); });
    MarchRequest request =
        requestAll(kUnit, 0.0, 1.0, 5, frameBox(kUnit, {0, 1, 0}, {0, 0, 1}, 1.0), {4, 4});
    request.base = spike();
    // ∫ -ln(1 - o) over o from 0 to 0.9 and back, in closed form.
    const double depth = 1e-4 / 0.9 * (0.1 * std::log(0.1) + 0.9) / 0.01 / slope;
    const RayImage image = marchWhole(marcher, scene, request);
    const std::size_t pixel = 5, pixels = image.size.pixels();
    EXPECT_NEAR(image.transmittance[pixel], std::exp(-depth), 1e-4 * depth);
    EXPECT_NEAR(image.attenuation[2 * pixels + pixel], -std::expm1(-depth), 1e-4 * depth);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(image.reference[c * pixels + pixel],
                  -std::expm1(-depth) * request.base.color(0.4203)[int(c)], 1e-4);
    }
  }
}

TEST_P(March, SpikesAreOpaqueWhereTheyAreAndNowhereElse) {
  for (double value : {0.4202, 0.42024, 0.42028, 0.4203, 0.42033, 0.42036, 0.4204}) {
    const Scene scene = Scene::even({4, 4, 4}, kUnit, [=](glm::dvec3) { return value; });
    MarchRequest request = requestAll(kUnit, 0.0, 1.0, 4, oblique(kUnit));
    request.base = spike();
    const RayImage image = marchWhole(marcher, scene, request);
    const std::size_t pixel = image.size.pixels() / 2 + 16;
    // Values near 0.42 are 3e-8 off in single precision, table arguments as much again.
    const double path = chord(image, request.camera, pixel), off = 1e-7;
    const auto [least, most] =
        std::minmax({request.base.extinction(value - off), request.base.extinction(value + off)});
    EXPECT_LE(image.transmittance[pixel], std::exp(-0.98 * least * path) + 1e-5) << value;
    EXPECT_GE(image.transmittance[pixel], std::exp(-1.02 * most * path) - 1e-5) << value;
  }
}

}  // namespace
}  // namespace vestige
