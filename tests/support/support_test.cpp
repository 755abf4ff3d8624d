// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numeric>

#include "proxy/base/error.h"
#include "tests/support/cpu_renderer.h"
#include "tests/support/random_transfer_function.h"
#include "tests/support/scenes.h"
#include "tests/support/turbulence.h"

namespace vestige::test {
namespace {

constexpr ImageSize kSize{24, 24};
const Box kUnitBox{glm::dvec3(0.0), glm::dvec3(1.0)};

Camera frontOf(const Box& box) { return frameBox(box, {0, 1, 0}, {0, 0, 1}, 1.0); }
std::size_t centre(ImageSize size) {
  return std::size_t(size.height / 2) * std::size_t(size.width) + std::size_t(size.width / 2);
}
MarchRequest requestFor(const Scene& scene, const IntervalPartition& partition) {
  const auto base = TransferFunction::ramp(scene.low, scene.high, scene.domain().diagonal() / 100);
  MarchRequest request{.camera = frontOf(scene.domain()),
                       .size = kSize,
                       .partition = partition,
                       .base = base,
                       .domain = scene.domain(),
                       .isovalues = {}};
  return request;
}
double greatestDifference(const std::vector<float>& a, const std::vector<float>& b) {
  double greatest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    greatest = std::max(greatest, std::abs(double(a[i]) - double(b[i])));
  }
  return greatest;
}

TEST(Scenes, SampleALinearFieldExactly) {
  const Scene scene = makeScene("linear", 9, {{-1, 0, 2}, {1, 3, 4}},
                                [](glm::dvec3 p) { return 2 * p.x - p.y + 0.5 * p.z; });
  EXPECT_NEAR(scene.sample({0.3, 1.7, 2.9}), 2 * 0.3 - 1.7 + 0.5 * 2.9, 1e-6);
  const glm::dvec3 gradient = scene.gradient({0.3, 1.7, 2.9});
  EXPECT_NEAR(gradient.x, 2.0, 1e-5);
  EXPECT_NEAR(gradient.y, -1.0, 1e-5);
  EXPECT_NEAR(gradient.z, 0.5, 1e-5);
  EXPECT_EQ(scene.sample({9, 9, 9}), scene.sample({1, 3, 4})) << "clamped beyond the last samples";
}

TEST(Scenes, NamedOnesSpanTheirStatedRange) {
  for (const char* name : {"smooth", "blob"}) {
    const Scene scene = namedScene(name, 33, {});
    for (float value : scene.values) {
      ASSERT_GE(value, scene.low) << name;
      ASSERT_LE(value, scene.high) << name;
    }
  }
}

TEST(Scenes, RefuseAnUnknownName) {
  try {
    namedScene("teapot", 8, {});
    FAIL() << "a teapot was made";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::InvalidArgument);
    EXPECT_NE(std::string(error.what()).find("teapot"), std::string::npos);
  }
}

TEST(Scenes, KeepTheTurbulentOneAndReadItBack) {
  const auto cache = std::filesystem::path(testing::TempDir()) / "vestige-scenes";
  std::filesystem::remove_all(cache);
  const Scene made = namedScene("turbulent", 16, cache);
  ASSERT_TRUE(std::filesystem::exists(cache / "turbulent-16.raw"));
  EXPECT_EQ(namedScene("turbulent", 16, cache).values, made.values);
  std::filesystem::remove_all(cache);
}

TEST(Turbulence, FillsTheUnitRangeAndDependsOnItsSeedOnly) {
  const auto field = turbulence(32, 1);
  EXPECT_EQ(*std::min_element(field.begin(), field.end()), 0.0f);
  EXPECT_EQ(*std::max_element(field.begin(), field.end()), 1.0f);
  EXPECT_EQ(field, turbulence(32, 1));
  EXPECT_NE(field, turbulence(32, 2));
}

TEST(Turbulence, IsTheSameFieldAtAnotherResolution) {
  // Above the Nyquist frequency of 32 points there is little left: |k|^(-11/6) at 16 is 0.6 %.
  const auto coarse = turbulence(32, 1), fine = turbulence(64, 1);
  double meanCoarse = 0.0, meanFine = 0.0;
  std::vector<double> sampled;
  for (std::size_t z = 0; z < 32; ++z) {
    for (std::size_t y = 0; y < 32; ++y) {
      for (std::size_t x = 0; x < 32; ++x) {
        sampled.push_back(double(fine[(2 * z * 64 + 2 * y) * 64 + 2 * x]));
        meanFine += sampled.back();
        meanCoarse += double(coarse[(z * 32 + y) * 32 + x]);
      }
    }
  }
  meanCoarse /= double(sampled.size());
  meanFine /= double(sampled.size());
  double ab = 0.0, aa = 0.0, bb = 0.0;
  for (std::size_t i = 0; i < sampled.size(); ++i) {
    const double a = sampled[i] - meanFine, b = double(coarse[i]) - meanCoarse;
    ab += a * b;
    aa += a * a;
    bb += b * b;
  }
  EXPECT_GT(ab / std::sqrt(aa * bb), 0.98);
}

TEST(RandomTransferFunctions, AreReproducibleAndInTheirRanges) {
  const auto partition = IntervalPartition::uniform(-1.0, 3.0, 16);
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const RandomTransferFunction function(seed, partition, 2.0);
    const IntervalLook look = function.constant();
    EXPECT_EQ(look.extinction, RandomTransferFunction(seed, partition, 2.0).constant().extinction);
    for (double extinction : look.extinction) {
      EXPECT_GE(extinction, 0.0);
      EXPECT_LE(extinction * 2.0, 3 * 27.0);
    }
    for (const glm::dvec3& color : look.color) {
      EXPECT_GE(std::min({color.r, color.g, color.b}), 0.0);
      EXPECT_LT(std::max({color.r, color.g, color.b}), 1.0);
    }
    EXPECT_NEAR(function.extinction(-1.0 + 3.5 * 0.25), look.extinction[3], 1e-12);
    EXPECT_EQ(function.extinction(3.1), 0.0);
  }
}

TEST(RandomTransferFunctions, MeansKeepTheIntegralOfTheContinuousFunction) {
  const auto partition = IntervalPartition::uniform(0.0, 1.0, 16);
  const RandomTransferFunction function(3, partition, 1.0);
  double fine = 0.0;
  constexpr int kSamples = 1 << 14;
  for (int i = 0; i < kSamples; ++i) fine += function.extinction((i + 0.5) / kSamples) / kSamples;
  const auto means = function.meansOfContinuous().extinction;
  EXPECT_NEAR(std::accumulate(means.begin(), means.end(), 0.0) / 16, fine, 1e-5 * fine);
}

TEST(CpuRenderer, GivesBeersLawInAUniformMedium) {
  const Scene scene = makeScene("uniform", 5, kUnitBox, [](glm::dvec3) { return 0.5; });
  const Medium medium = [](double) { return Optics{1.7, {1.0, 0.5, 0.25}}; };
  const auto picture = renderContinuous(scene, frontOf(kUnitBox), kSize, {&medium, 1})[0];
  const double alpha = 1.0 - std::exp(-1.7);
  EXPECT_NEAR(picture.rgb[centre(kSize) * 3], alpha, 1e-6);
  EXPECT_NEAR(picture.rgb[centre(kSize) * 3 + 1], 0.5 * alpha, 1e-6);
  EXPECT_NEAR(picture.rgb[centre(kSize) * 3 + 2], 0.25 * alpha, 1e-6);
}

TEST(CpuRenderer, IntegratesALinearFieldAsOneDoesByHand) {
  // f = y along the ray, extinction f, colour f: C = ∫ f σ T ds = ∫ y² exp(-y²/2) dy over [0, 1].
  const Scene scene = makeScene("ramp", 33, kUnitBox, [](glm::dvec3 p) { return p.y; });
  const Medium medium = [](double f) { return Optics{f, glm::dvec3(f)}; };
  const auto picture = renderContinuous(scene, frontOf(kUnitBox), kSize, {&medium, 1}, 8)[0];
  const double exact =
      std::sqrt(std::acos(-1.0) / 2.0) * std::erf(1.0 / std::sqrt(2.0)) - std::exp(-0.5);
  EXPECT_NEAR(picture.rgb[centre(kSize) * 3], exact, 1e-5);
}

TEST(CpuRenderer, ConvergesWithTheNumberOfSamples) {
  const Scene scene = namedScene("smooth", 65, {});
  const auto partition = IntervalPartition::uniform(0.0, 1.0, 16);
  const RandomTransferFunction function(7, partition, 6.0);
  const IntervalLook look = function.constant();
  const Medium medium = [&](double f) { return Optics{function.extinction(f), glm::dvec3(f)}; };
  const Camera camera = frontOf(scene.domain());
  const auto intervals = [&](int n) {
    return renderIntervals(scene, camera, kSize, partition, {&look, 1}, n)[0].rgb;
  };
  const auto continuous = [&](int n) {
    return renderContinuous(scene, camera, kSize, {&medium, 1}, n)[0].rgb;
  };
  EXPECT_LT(greatestDifference(intervals(4), intervals(8)), 1e-3);
  EXPECT_LT(greatestDifference(continuous(4), continuous(8)), 1e-3);
}

TEST(CpuRenderer, TabulatesAFunctionOfTheValue) {
  const Medium medium = tabulated([](double f) { return Optics{f * f, {f, 0.0, 1.0}}; }, 0.0, 2.0);
  EXPECT_NEAR(medium(1.3).extinction, 1.69, 1e-6);
  EXPECT_NEAR(medium(1.3).color.r, 1.3, 1e-12);
  EXPECT_NEAR(medium(5.0).extinction, 4.0, 1e-12);
  EXPECT_EQ(medium(NAN).extinction, 0.0);
}

TEST(CpuMarch, ConservesLightAndChord) {
  const Scene scene = namedScene("smooth", 33, {});
  const auto partition = IntervalPartition::uniform(0.1, 0.9, 12);  // some below, some above
  MarchRequest request = requestFor(scene, partition);
  request.camera = request.camera.orbited(scene.domain().center(), 0.4, 0.3);
  const RayImage image = marchOnCpu(scene, request);
  for (std::size_t i = 0; i < kSize.pixels(); ++i) {
    double light = double(image.transmittance[i]), length = 0.0;
    for (std::size_t k = 0; k < std::size_t(image.channels); ++k) {
      light += double(image.attenuation[k * kSize.pixels() + i]);
      length += double(image.length[k * kSize.pixels() + i]);
    }
    EXPECT_NEAR(light, 1.0, 1e-6);
    EXPECT_NEAR(length, std::max(0.0, double(image.exit[i] - image.entry[i])), 1e-5);
  }
}

TEST(CpuMarch, MeasuresALinearRamp) {
  const Scene scene = makeScene("ramp", 17, kUnitBox, [](glm::dvec3 p) { return p.y; });
  MarchRequest request = requestFor(scene, IntervalPartition::uniform(0.0, 1.0, 4));
  request.isovalues = {0.625};
  request.mip = true;
  const RayImage image = marchOnCpu(scene, request);
  const std::size_t pixel = centre(kSize), pixels = kSize.pixels();
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(image.length[k * pixels + pixel], 0.25, 1e-6);
    EXPECT_EQ(image.runs[k * pixels + pixel], 1.0f);
    const double mean = double(image.moment[k * pixels + pixel]) / 0.25;
    EXPECT_NEAR(mean - double(image.entry[pixel]), 0.25 * double(k) + 0.125, 1e-5);
  }
  EXPECT_NEAR(image.depth[pixel] - image.entry[pixel], 0.625, 1e-5);
  EXPECT_NEAR(image.normal[2 * pixels + pixel], 1.0, 1e-6) << "turned to the viewer";
  EXPECT_EQ(image.mip[pixel], 1.0f);
  EXPECT_EQ(image.first[pixel], 0);
  EXPECT_EQ(image.last[pixel], 3);
}

TEST(CpuMarch, CountsRunsOfAWave) {
  const Scene scene = makeScene("wave", 129, kUnitBox, [](glm::dvec3 p) {
    return 0.5 - 0.5 * std::cos(2 * 2 * std::acos(-1.0) * p.y);  // two periods
  });
  const RayImage image =
      marchOnCpu(scene, requestFor(scene, IntervalPartition::uniform(0.0, 1.0, 3)));
  const std::size_t pixel = centre(kSize), pixels = kSize.pixels();
  EXPECT_EQ(image.runs[pixel], 3.0f);
  EXPECT_EQ(image.runs[pixels + pixel], 4.0f);
  EXPECT_EQ(image.runs[2 * pixels + pixel], 2.0f);
}

TEST(CpuMarch, LeavesNoDataTransparent) {
  const Scene scene = makeScene("hole", 17, kUnitBox,
                                [](glm::dvec3 p) { return p.y > 0.4 && p.y < 0.6 ? NAN : 0.9; });
  const auto partition = IntervalPartition::uniform(0.0, 1.0, 4);
  const RayImage image = marchOnCpu(scene, requestFor(scene, partition));
  const std::size_t pixel = centre(kSize), pixels = kSize.pixels();
  EXPECT_GT(image.length[std::size_t(partition.noData()) * pixels + pixel], 0.18f);
  EXPECT_EQ(image.attenuation[std::size_t(partition.noData()) * pixels + pixel], 0.0f);
  EXPECT_EQ(image.runs[3 * pixels + pixel], 2.0f);
}

}  // namespace
}  // namespace vestige::test
