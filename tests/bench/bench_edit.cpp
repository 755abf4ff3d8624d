// SPDX-License-Identifier: BSD-3-Clause
// edit_psnr_SCENE[_flat_256px]_{mean,min}[_continuous]: the flat tier at its stored view (512^2, or
// 256^2 pixels), edited with random transfer functions, against the raw field rendered on the CPU
// (method §10); edit_bytes_percent_SCENE_flat[_256px]: its lengths, of the field in its own type.
// usage: bench_edit --seeds A..B LINE...
#include <algorithm>
#include <cstdio>

#include "explorer/picture/metrics.h"
#include "explorer/recomposition/edit_pass.h"
#include "explorer/recomposition/segments.h"
#include "proxy/format/exr/exr_file.h"
#include "proxy/format/layout/proxy_layout.h"
#include "tests/bench/bench_run.h"
#include "tests/support/cpu_renderer.h"
#include "tests/support/random_transfer_function.h"

namespace vestige::test {
namespace {

constexpr ImageSize kSizes[] = {{512, 512}, {256, 256}};
constexpr int kIntervals = 16;
constexpr int kSamplesPerVoxel = 2;  // each step is split at bounds, or in halves

/// Marches a scene on the GPU and packs its lengths as an archive would hold them.
ProxyImage storedLengths(Marcher& marcher, const Scene& scene, const MarchRequest& request) {
  const RayImage rays = marchOnGpu(marcher, scene, request);
  ProxyHeader header;
  header.field = "field";
  header.view = "front";
  header.camera = request.camera;
  header.size = request.size;
  header.domain = request.domain;
  header.partition = request.partition;
  return lengthImage(header, rays.length, rays.moment, rays.runs, rays.first, rays.last);
}

struct Figures {
  double mean = 0.0, least = 1e9;
};

/// PSNR of edits by the explorer's own pass over each of the true pictures.
Figures judge(gl::Device& device, const SegmentLists& lists, const MarchRequest& request,
              const std::vector<IntervalLook>& looks, const std::vector<RgbPicture>& truth) {
  Figures figures;
  const auto rect = projectedRect(request.camera, request.domain, request.size);
  std::vector<Picture> edits(looks.size());
  device.run([&] {
    EditPass pass;
    const SegmentTextures textures(lists);
    for (std::size_t i = 0; i < looks.size(); ++i) {
      edits[i] = pass.render(textures, tableForLength(looks[i]));
    }
  });
  for (std::size_t i = 0; i < looks.size(); ++i) {
    const double dB = psnr(RgbView::interleaved(request.size, truth[i].rgb),
                           RgbView::interleaved(request.size, edits[i].rgba, 4), rect);
    figures.mean += dB / double(looks.size());
    figures.least = std::min(figures.least, dB);
  }
  return figures;
}

void print(const std::string& prefix, const char* suffix, const Figures& figures) {
  std::printf("%smean%s\t%.3f\n", prefix.c_str(), suffix, figures.mean);
  std::printf("%smin%s\t%.3f\n", prefix.c_str(), suffix, figures.least);
  std::fflush(stdout);
}

void measure(const std::shared_ptr<gl::Device>& device, const Scene& scene, ImageSize size,
             const BenchOptions& options) {
  const std::string setting = size == kSizes[0] ? "" : "_" + std::to_string(size.width) + "px";
  const std::string prefix =
      "edit_psnr_" + scene.name + (setting.empty() ? "" : "_flat" + setting) + "_";
  const std::string bytes = "edit_bytes_percent_" + scene.name + "_flat" + setting;
  const auto wantsEither = [&](const char* suffix) {
    return options.wants(prefix + "mean" + suffix) || options.wants(prefix + "min" + suffix);
  };
  if (!wantsEither("") && !wantsEither("_continuous") && !options.wants(bytes)) return;
  const auto partition = IntervalPartition::uniform(scene.low, scene.high, kIntervals);
  const double diagonal = scene.domain().diagonal();
  MarchRequest request{.camera = frameBox(scene.domain(), {0, 1, 0}, {0, 0, 1}, 1.0),
                       .size = size,
                       .partition = partition,
                       .base = TransferFunction::ramp(scene.low, scene.high, diagonal / 100),
                       .domain = scene.domain(),
                       .isovalues = {}};
  request.attenuation = false;
  Marcher marcher(device);
  const ProxyImage lengths = storedLengths(marcher, scene, request);
  if (options.wants(bytes)) {
    std::printf("%s\t%.3f\n", bytes.c_str(),
                100.0 * double(encodeExr(lengths).size()) /
                    (double(scene.values.size()) * scene.nativeBytes));
  }
  const SegmentLists lists = segmentsFromLength(lengthPlanes(lengths), Order::Auto);

  std::vector<IntervalLook> constant, means;
  std::vector<Medium> media;
  for (std::uint64_t seed = options.firstSeed; seed <= options.lastSeed; ++seed) {
    const RandomTransferFunction function(seed, partition, boxLength(scene.domain()));
    constant.push_back(function.constant());
    means.push_back(function.meansOfContinuous());
    media.push_back(tabulated(
        [function](double f) {
          return Optics{function.extinction(f), function.color(f)};
        },
        scene.low, scene.high));
  }
  if (wantsEither("")) {
    const auto truth =
        renderIntervals(scene, request.camera, size, partition, constant, kSamplesPerVoxel);
    print(prefix, "", judge(*device, lists, request, constant, truth));
  }
  if (wantsEither("_continuous")) {
    const auto truth = renderContinuous(scene, request.camera, size, media, kSamplesPerVoxel);
    print(prefix, "_continuous", judge(*device, lists, request, means, truth));
  }
}

}  // namespace
}  // namespace vestige::test

int main(int argc, char** argv) {
  using namespace vestige::test;
  return runBench("bench_edit", argc, argv, [](const auto& options, const auto& device) {
    for (const char* scene : {"ct", "plume", "smooth", "turbulent"}) {
      if (!options.wantsAny(std::string("edit_psnr_") + scene + "_") &&
          !options.wantsAny(std::string("edit_bytes_percent_") + scene + "_flat")) {
        continue;
      }
      std::fprintf(stderr, "bench_edit: %s\n", scene);
      const Scene field =
          namedScene(scene, std::string(scene) == "plume" ? 128 : 256, sceneCache());
      for (const vestige::ImageSize size : kSizes) measure(device, field, size, options);
    }
  });
}
