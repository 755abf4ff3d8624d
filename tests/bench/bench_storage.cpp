// SPDX-License-Identifier: BSD-3-Clause
// flat_storage_SCENE_P_N: bytes of N flat proxies (attenuation in N intervals) of P x P pixels of a
// field, and flat_storage_seconds_...: what marching and encoding them takes in situ
// [Tikhonova 2010, Fig. 15]. SCENE carries the samples along a side: smooth128.
// flat_storage_raw_SCENE: bytes of the field itself, float32.
// usage: bench_storage --seeds A..B LINE...   (nothing is random)
#include <cstdio>

#include "adaptor/common/stopwatch.h"
#include "proxy/archive/archive.h"
#include "proxy/format/layout/proxy_layout.h"
#include "tests/bench/bench_run.h"

namespace vestige::test {
namespace {

struct Subject {
  const char* name;
  int size;
  std::vector<int> sides;  ///< of pictures
};

void measure(Marcher& marcher, const Scene& scene, const std::string& suffix, int side, int proxies,
             const BenchOptions& options) {
  const std::string bytesLine = "flat_storage_" + suffix,
                    secondsLine = "flat_storage_seconds_" + suffix;
  if (!options.wants(bytesLine) && !options.wants(secondsLine)) return;
  const Box domain = scene.domain();
  MarchRequest request{
      .camera = frameBox(domain, {0, 1, 0}, {0, 0, 1}, 1.0),
      .size = {side, side},
      .partition = IntervalPartition::uniform(scene.low, scene.high, proxies),
      .base = TransferFunction::ramp(scene.low, scene.high, domain.diagonal() / 100),
      .domain = domain,
      .isovalues = {}};
  request.length = false;
  ProxyHeader header;
  header.field = "f";
  header.view = "front";
  header.camera = request.camera;
  header.size = request.size;
  header.domain = domain;
  header.partition = request.partition;
  header.base = request.base;
  uploadScene(marcher, scene, request.partition);
  // Programs are compiled once in a run.
  MarchRequest first = request;
  first.size = {16, 16};
  marcher.march(first);
  const Stopwatch watch;
  const RayImage rays = marcher.march(request);
  const EncodedProxy proxy =
      encodeProxy(attenuationImage(header, rays.attenuation, rays.transmittance));
  const double seconds = watch.seconds();
  std::printf("%s\t%zu\n%s\t%.4f\n", bytesLine.c_str(), proxy.exr.size(), secondsLine.c_str(),
              seconds);
  std::fflush(stdout);
}

}  // namespace
}  // namespace vestige::test

int main(int argc, char** argv) {
  using namespace vestige::test;
  const std::vector<Subject> subjects{{"smooth", 128, {512}},
                                      {"smooth", 256, {512}},
                                      {"smooth", 512, {512}},
                                      {"turbulent", 256, {512, 1024, 2048}}};
  return runBench("bench_storage", argc, argv, [&](const auto& options, const auto& device) {
    vestige::Marcher marcher(device);
    for (const Subject& subject : subjects) {
      const std::string name = subject.name + std::to_string(subject.size);
      if (!options.wantsAny("flat_storage_" + name) &&
          !options.wantsAny("flat_storage_seconds_" + name) &&
          !options.wants("flat_storage_raw_" + name))
        continue;
      const Scene scene = namedScene(subject.name, subject.size, sceneCache());
      std::printf("flat_storage_raw_%s\t%zu\n", name.c_str(), scene.values.size() * sizeof(float));
      for (const int side : subject.sides)
        for (const int proxies : {4, 16, 44})
          measure(marcher, scene, name + "_" + std::to_string(side) + "_" + std::to_string(proxies),
                  side, proxies, options);
    }
  });
}
