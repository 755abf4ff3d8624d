// SPDX-License-Identifier: BSD-3-Clause
// Position-dependent classification: the time of a customisation volume, how far it is from
// continuous natural neighbours, and what it costs a picture ([Brix 2015]
// §5.4).
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <random>

#include "adaptor/volume/customization_pass.h"
#include "explorer/volume/grid_painter.h"
#include "proxy/customization/customization.h"
#include "proxy/gl/device.h"
#include "tests/bench/bench_options.h"
#include "tests/support/sibson.h"
#include "tests/support/turbulence.h"

namespace vestige::test {
namespace {

constexpr int kSeeds = 32;

/// Least milliseconds of several turns.
double milliseconds(const std::function<void()>& work, int turns = 5) {
  using Clock = std::chrono::steady_clock;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < turns; ++i) {
    const auto start = Clock::now();
    work();
    least =
        std::min(least, std::chrono::duration<double, std::milli>(Clock::now() - start).count());
  }
  return least;
}

/// Opacity, gamma and colour, different at each seed.
Customization randomCustomization(int resolution, const Box& box, std::uint64_t randomSeed) {
  std::mt19937_64 random(randomSeed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Customization customization;
  customization.resolution = resolution;
  for (int i = 0; i < kSeeds; ++i) {
    SeedPrimitive& seed = customization.seeds.emplace_back();
    for (int axis = 0; axis < 3; ++axis)
      seed.position[axis] = box.low[axis] + unit(random) * box.size()[axis];
    seed.parameters.opacity = 0.25 + 1.5 * unit(random);
    seed.parameters.gamma = 0.6 + 0.8 * unit(random);
    seed.parameters.shift = {0.4 * unit(random) - 0.2, 0.4 * unit(random) - 0.2, 0.0};
  }
  return customization;
}

void measureVolumes(const BenchOptions& options) {
  const Box box{glm::dvec3(0.0), glm::dvec3(1.0)};
  const auto line = [&](const char* name, int resolution, int seeds, SeedMetric metric) {
    if (!options.wants(name)) return;
    double sum = 0.0;
    constexpr int kScenes = 4;
    for (std::uint64_t i = 0; i < kScenes; ++i) {
      Customization customization = randomCustomization(resolution, box, options.firstSeed + i);
      customization.seeds.resize(std::size_t(seeds));
      customization.metric = metric;
      sum += milliseconds([&] { customVolume(customization, box); });
    }
    std::printf("%s\t%.4g\n", name, sum / kScenes);
  };
  line("customisation_64_ms", 64, kSeeds, SeedMetric::Euclidean);
  line("customisation_64_manhattan_ms", 64, kSeeds, SeedMetric::Manhattan);
  line("customisation_64_one_seed_ms", 64, 1, SeedMetric::Euclidean);
  line("customisation_32_ms", 32, kSeeds, SeedMetric::Euclidean);
}

/// The compute shader, and how many times the CPU's time it takes. (A software rasteriser is on the
/// same cores.)
void measureOnDevice(const BenchOptions& options) {
  const char* time = "customisation_64_gpu_ms";
  const char* ratio = "customisation_64_gpu_over_cpu";
  if (!options.wants(time) && !options.wants(ratio)) return;
  const Box box{glm::dvec3(0.0), glm::dvec3(1.0)};
  const Customization customization = randomCustomization(64, box, options.firstSeed);
  const std::shared_ptr<gl::Device> device = gl::Device::create("auto");
  customVolume(*device, customization, box);  // wakes the device
  const double gpu = milliseconds([&] { customVolume(*device, customization, box); }, 3);
  const double cpu = milliseconds([&] { customVolume(customization, box); });
  if (options.wants(time)) std::printf("%s\t%.4g\n", time, gpu);
  if (options.wants(ratio)) std::printf("%s\t%.4g\n", ratio, gpu / cpu);
}

void measureError(const BenchOptions& options) {
  const char* name = "customisation_vs_cgal_max_error";
  if (!options.wants(name)) return;
  double greatest = 0.0;
  for (unsigned i = 0; i < 4; ++i)
    greatest =
        std::max(greatest, differenceFromSibson(64, kSeeds, unsigned(options.firstSeed) + i));
  std::printf("%s\t%.4g\n", name, greatest);
}

/// A picture of a turbulent grid with and without.
void measurePictures(const BenchOptions& options) {
  if (!options.wantsAny("customised_over_plain_")) return;
  const std::shared_ptr<gl::Device> device = gl::Device::create("auto");
  constexpr int kNodes = 128;
  const Box box{glm::dvec3(-1.0), glm::dvec3(1.0)};
  const std::vector<float> values = turbulence(kNodes, options.firstSeed);
  const double from = 0.0, to = 1.0;
  const IntervalPartition partition = IntervalPartition::uniform(from, to, 16);
  const TransferFunction function = TransferFunction::ramp(from, to, box.diagonal() / 100.0);
  const Camera camera = frameBox(box, {0.4, 1.0, -0.3}, {0.0, 0.0, 1.0}, 1.0);
  device->run([&] {
    const glm::dmat4 place = glm::scale(glm::translate(glm::dmat4(1.0), box.low), box.size());
    LookGrid grid = LookGrid::scalar(glm::ivec3(kNodes), place, values);
    GridPainter painter;
    for (const auto& [name, draw] : {std::pair("customised_over_plain_field", Draw::Volume),
                                     std::pair("customised_over_plain_mip", Draw::Mip)}) {
      if (!options.wants(name)) continue;
      Look look;
      look.draw = draw;
      const auto picture = [&] {
        painter.draw(grid, look, function, &partition, box, camera, {512, 512});
      };
      picture();  // compiles
      const double plain = milliseconds(picture, 3);
      look.customization = randomCustomization(64, box, options.firstSeed);
      picture();
      std::printf("%s\t%.4g\n", name, milliseconds(picture, 3) / plain);
    }
  });
}

}  // namespace
}  // namespace vestige::test

int main(int argc, char** argv) {
  try {
    const vestige::test::BenchOptions options(argc, argv);
    vestige::test::measureVolumes(options);
    vestige::test::measureOnDevice(options);
    vestige::test::measureError(options);
    vestige::test::measurePictures(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_customisation: %s\n", error.what());
    return 1;
  }
  return 0;
}
