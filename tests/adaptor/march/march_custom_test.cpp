// SPDX-License-Identifier: BSD-3-Clause
//
// Position-dependent classification in situ.
#include <cmath>
#include <memory>
#include <vector>

#include "tests/adaptor/march/march_fixture.h"

namespace vestige {
namespace {

Customization everywhere(const SeedParameters& parameters) {
  Customization customization;
  customization.resolution = 32;
  customization.corners.fill(parameters);
  return customization;
}

std::shared_ptr<const CustomVolume> volumeOf(const Customization& customization, const Box& box) {
  return std::make_shared<const CustomVolume>(customVolume(customization, box));
}

Scene wavesScene() { return Scene::even({14, 12, 13}, kUnit, waves); }

TEST_P(March, ANeutralCustomisationChangesNothing) {
  MarchRequest request = requestAll(kUnit, 0.0, 1.0, 6, perspective(kUnit));
  const RayImage plain = marchWhole(marcher, wavesScene(), request);
  request.custom = volumeOf(everywhere({}), kUnit);
  expectSame(marchWhole(marcher, wavesScene(), request), plain, 1e-6);
}

TEST_P(March, AFactorEverywhereIsAnotherReferenceLength) {
  MarchRequest request = requestAll(kUnit, 0.0, 1.0, 6, oblique(kUnit));
  SeedParameters twice;
  twice.opacity = 2.0;
  MarchRequest halved = request;
  halved.base =
      TransferFunction(request.base.opacityPoints(), 0.5 * request.base.referenceLength(),
                       request.base.colormap(), request.base.colorLow(), request.base.colorHigh());
  const RayImage wanted = marchWhole(marcher, wavesScene(), halved);
  request.custom = volumeOf(everywhere(twice), kUnit);
  expectSame(marchWhole(marcher, wavesScene(), request), wanted, 2e-4);
}

TEST_P(March, GammaChangesWhatTheBaseFunctionAndTheMaximumSeeButNoLength) {
  const Scene scene = Scene::even({4, 40, 4}, kUnit, [](glm::dvec3 p) { return p.y; });
  MarchRequest request =
      requestAll(kUnit, 0.0, 1.0, 5, frameBox(kUnit, {0, 1, 0}, {0, 0, 1}, 1.0), {4, 4});
  const RayImage plain = marchWhole(marcher, scene, request);
  SeedParameters parameters;
  parameters.gamma = 2.0;
  Customization customization = everywhere(parameters);
  request.custom = volumeOf(customization, kUnit);
  const RayImage image = marchWhole(marcher, scene, request);
  EXPECT_EQ(image.length, plain.length);
  EXPECT_EQ(image.runs, plain.runs);
  double depth = 0.0;
  constexpr int kSteps = 20000;
  for (int i = 0; i < kSteps; ++i)
    depth += request.base.extinction(std::pow((i + 0.5) / kSteps, 2.0)) / kSteps;
  EXPECT_NEAR(image.transmittance[5], std::exp(-depth), 2e-3);
  double sum = image.transmittance[5];
  for (std::size_t c = 0; c < std::size_t(image.channels); ++c)
    sum += image.attenuation[c * image.size.pixels() + 5];
  EXPECT_NEAR(sum, 1.0, 1e-5);
  // The greatest value is at the far face, which 1^2 leaves where it is; in the middle it is not.
  const Scene flat = Scene::even({4, 4, 4}, kUnit, [](glm::dvec3) { return 0.5; });
  EXPECT_NEAR(marchWhole(marcher, flat, request).mip[5], 0.25, 1e-4);
  request.attenuation = request.reference = false;
  EXPECT_NEAR(marchWhole(marcher, flat, request).mip[5], 0.25, 1e-4);
}

TEST_P(March, FactorsAndShiftsAreThoseOfTheirPlaces) {
  // A uniform medium, opaque on one side.
  const Scene scene = Scene::even({5, 5, 5}, kUnit, [](glm::dvec3) { return 0.8; });
  Customization customization;
  customization.resolution = 32;
  for (std::size_t i = 0; i < 8; ++i) {
    customization.corners[i].opacity = i & 1 ? 3.0 : 0.25;
    customization.corners[i].shift = {i & 4 ? 0.3 : -0.1, 0.0, 0.2};
  }
  for (const bool perspectively : {false, true}) {
    const Camera camera = perspectively ? perspective(kUnit) : oblique(kUnit);
    MarchRequest request = requestAll(kUnit, 0.0, 1.0, 4, camera);
    request.stepLength = 1.0 / 64;
    request.custom = volumeOf(customization, kUnit);
    const RayImage image = marchWhole(marcher, scene, request);
    const double extinction = request.base.extinction(0.8);
    const std::size_t pixels = image.size.pixels();
    for (std::size_t i = 0; i < pixels; i += 5) {
      if (!(image.entry[i] < image.exit[i])) continue;
      const int x = int(i) % image.size.width, y = int(i) / image.size.width;
      const Ray ray = camera.rayThrough({x + 0.5, y + 0.5}, image.size);
      const double from = image.entry[i] / ray.depthPerLength;
      const double to = image.exit[i] / ray.depthPerLength;
      constexpr int kSteps = 1000;
      double depth = 0.0;
      glm::dvec3 light{0.0};
      for (int s = 0; s < kSteps; ++s) {
        const glm::dvec3 at =
            ray.origin + (from + (s + 0.5) / kSteps * (to - from)) * ray.direction;
        const LocalParameters p = request.custom->at(at);
        const double next = depth + double(p.opacity) * extinction * (to - from) / kSteps;
        light += (std::exp(-depth) - std::exp(-next)) *
                 glm::clamp(request.base.color(0.8) + glm::dvec3(p.shift), 0.0, 1.0);
        depth = next;
      }
      EXPECT_NEAR(image.transmittance[i], std::exp(-depth), 2e-3) << i;
      for (std::size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(image.reference[c * pixels + i], light[int(c)], 3e-3) << i;
    }
  }
}

TEST_P(March, CustomisationDoesNotDependOnTheBlocks) {
  Customization customization;
  customization.resolution = 32;
  for (std::size_t i = 0; i < 8; ++i) {
    customization.corners[i].opacity = i & 1 ? 2.0 : 0.5;
    customization.corners[i].gamma = i & 2 ? 0.7 : 1.4;
  }
  MarchRequest request = requestAll(kUnit, 0.0, 1.0, 4, oblique(kUnit));
  request.custom = volumeOf(customization, kUnit);
  request.stepLength = 1.0 / 16;
  const Scene scene = wavesScene();
  expectSame(marchBlocks(marcher, scene, request, {{{0, 6, 13}, {0, 11}, {0, 5, 12}}}, 1),
             marchWhole(marcher, scene, request), 2e-4);
}

TEST_P(March, LayersHoldTheLightOfACustomisedPicture) {
  Customization customization;
  customization.resolution = 32;
  for (std::size_t i = 0; i < 8; ++i) {
    customization.corners[i].opacity = i & 1 ? 2.0 : 0.5;
    customization.corners[i].gamma = i & 2 ? 0.7 : 1.4;
    customization.corners[i].shift = {0.0, i & 4 ? 0.2 : -0.2, 0.0};
  }
  MarchRequest request = requestAll(kUnit, 0.0, 1.0, 4, oblique(kUnit));
  request.custom = volumeOf(customization, kUnit);
  const RayImage image = marchWhole(marcher, wavesScene(), request);
  LayerRequest layers;
  layers.layers = 4;
  const std::vector<float> front(image.size.pixels(), 1.0f);
  layers.front = front;
  layers.end = image.transmittance;
  const LayerRays rays = marcher.marchLayers(request, layers);
  const std::size_t pixels = image.size.pixels();
  for (std::size_t i = 0; i < pixels; ++i) {
    EXPECT_NEAR(std::exp(-rays.tau[i]), image.transmittance[i], 1e-4) << i;
    for (std::size_t c = 0; c < 3; ++c) {
      double light = 0.0;
      for (std::size_t l = 0; l < 4; ++l) light += rays.light[(3 * l + c) * pixels + i];
      EXPECT_NEAR(light, image.reference[c * pixels + i], 2e-3) << i;
    }
  }
}

}  // namespace
}  // namespace vestige
