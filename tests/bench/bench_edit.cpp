// SPDX-License-Identifier: BSD-3-Clause
// edit_psnr_SCENE_{mean,min}[_continuous]: the flat tier at its stored view, edited with random
// transfer functions, against the raw field rendered on the CPU (method §7).
// usage: bench_edit --seeds A..B LINE...
#include <algorithm>
#include <cstdio>

#include "explorer/edit_pass.h"
#include "explorer/metrics.h"
#include "explorer/pieces.h"
#include "proxy/proxy_layout.h"
#include "tests/bench/bench_run.h"
#include "tests/support/cpu_renderer.h"
#include "tests/support/random_transfer_function.h"

namespace vestige::test {
namespace {

constexpr ImageSize kSize{512, 512};
constexpr int kIntervals = 16;
constexpr int kSamplesPerVoxel = 2;  // each step is split at bounds, or in halves

/// Marches a scene on the GPU and packs its lengths as an archive would hold them.
LengthPlanes storedLengths(Marcher& marcher, const Scene& scene, const MarchRequest& request) {
  const RayImage rays = marchOnGpu(marcher, scene, request);
  ProxyHeader header;
  header.camera = request.camera;
  header.size = request.size;
  header.domain = request.domain;
  header.partition = request.partition;
  return lengthPlanes(
      lengthImage(header, rays.length, rays.moment, rays.runs, rays.first, rays.last));
}

struct Figures {
  double mean = 0.0, least = 1e9;
};

/// PSNR of edits by the explorer's own pass over each of the true pictures.
Figures judge(gl::Device& device, const PieceLists& lists, const MarchRequest& request,
              const std::vector<IntervalLook>& looks, const std::vector<RgbPicture>& truth) {
  Figures figures;
  const auto rect = projectedRect(request.camera, request.domain, kSize);
  std::vector<Picture> edits(looks.size());
  device.run([&] {
    EditPass pass;
    const PieceTextures textures(lists);
    for (std::size_t i = 0; i < looks.size(); ++i) {
      edits[i] = pass.render(textures, tableForLength(looks[i]));
    }
  });
  for (std::size_t i = 0; i < looks.size(); ++i) {
    const double dB = psnr(RgbView::interleaved(kSize, truth[i].rgb),
                           RgbView::interleaved(kSize, edits[i].rgba, 4), rect);
    figures.mean += dB / double(looks.size());
    figures.least = std::min(figures.least, dB);
  }
  return figures;
}

void print(const std::string& scene, const char* suffix, const Figures& figures) {
  std::printf("edit_psnr_%s_mean%s\t%.3f\n", scene.c_str(), suffix, figures.mean);
  std::printf("edit_psnr_%s_min%s\t%.3f\n", scene.c_str(), suffix, figures.least);
  std::fflush(stdout);
}

void measure(const std::shared_ptr<gl::Device>& device, const std::string& name,
             const BenchOptions& options) {
  const Scene scene = namedScene(name, name == "plume" ? 128 : 256, sceneCache());
  const auto partition = IntervalPartition::uniform(scene.low, scene.high, kIntervals);
  const double diagonal = scene.domain().diagonal();
  MarchRequest request{.camera = frameBox(scene.domain(), {0, 1, 0}, {0, 0, 1}, 1.0),
                       .size = kSize,
                       .partition = partition,
                       .base = TransferFunction::ramp(scene.low, scene.high, diagonal / 100),
                       .domain = scene.domain(),
                       .isovalues = {}};
  request.attenuation = false;
  Marcher marcher(device);
  const PieceLists lists = piecesFromLength(storedLengths(marcher, scene, request), Order::Auto);

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
  if (options.wants("edit_psnr_" + name + "_mean") || options.wants("edit_psnr_" + name + "_min")) {
    const auto truth =
        renderIntervals(scene, request.camera, kSize, partition, constant, kSamplesPerVoxel);
    print(name, "", judge(*device, lists, request, constant, truth));
  }
  if (options.wants("edit_psnr_" + name + "_mean_continuous") ||
      options.wants("edit_psnr_" + name + "_min_continuous")) {
    const auto truth = renderContinuous(scene, request.camera, kSize, media, kSamplesPerVoxel);
    print(name, "_continuous", judge(*device, lists, request, means, truth));
  }
}

}  // namespace
}  // namespace vestige::test

int main(int argc, char** argv) {
  using namespace vestige::test;
  return runBench("bench_edit", argc, argv, [](const auto& options, const auto& device) {
    for (const char* scene : {"ct", "plume", "smooth", "turbulent"}) {
      if (!options.wantsAny(std::string("edit_psnr_") + scene + "_")) continue;
      std::fprintf(stderr, "bench_edit: %s\n", scene);
      measure(device, scene, options);
    }
  });
}
