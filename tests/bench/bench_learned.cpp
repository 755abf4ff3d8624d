// SPDX-License-Identifier: BSD-3-Clause
// learned_error_SCENE_K{1,8,24,48}, _T{1,2,3} and _function: lit pictures with learned colours
// [Tikhonova 2010, §6.2, Figs. 12 and 13] under opacities that no training picture had,
// through an archive as users make them, against the run's own marcher.
// usage: bench_learned --seeds A..B LINE...
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <random>

#include "adaptor/plan/training_looks.h"
#include "explorer/picture/metrics.h"
#include "explorer/renderer/renderer.h"
#include "explorer/training/training.h"
#include "proxy/format/layout/proxy_layout.h"
#include "tests/bench/bench_run.h"
#include "tests/bench/layered_scenes.h"

namespace vestige::test {
namespace {

namespace fs = std::filesystem;

constexpr ImageSize kSize{256, 256};
constexpr int kPictures = 3;
constexpr double kScale = 0.1;  // as [training] scale has it by default
constexpr int kClusters = 24;

/// The base function with four groups of values, of equal shares of the partition, each at a random
/// share of its opacity: what someone does who looks for what is inside.
TransferFunction heldOut(const TransferFunction& base, const IntervalPartition& partition,
                         std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  TransferFunction function = base;
  for (int group = 0; group < 4; ++group) {
    function = withScaledOpacity(function, partition.denormalised(0.25 * group),
                                 partition.denormalised(0.25 * (group + 1)), share(random));
  }
  return function;
}

/// A run's archive of one view: lengths and lit training pictures.
class Subject {
 public:
  Subject(const std::shared_ptr<gl::Device>& device, const LayeredScene& subject,
          const BenchOptions& options)
      : device_(device) {
    const Scene scene = namedScene(subject.name, subject.size, sceneCache());
    MarchRequest request = subject.request(scene, kSize);
    request.phong = true;
    Marcher marcher(device);
    uploadScene(marcher, scene, request.partition);
    ProxyHeader header;
    header.field = subject.name;
    header.view = "front";
    header.camera = request.camera;
    header.size = kSize;
    header.domain = request.domain;
    header.partition = request.partition;
    header.base = request.base;
    header.shading = "headlight";
    header.statistics.low = scene.low;
    header.statistics.high = scene.high;
    header.looks = trainingLooks(request.base, request.partition, kPictures, kScale);
    std::vector<EncodedProxy> proxies;
    std::vector<RayImage> rays;
    for (const TransferFunction& look : header.looks) {
      request.base = look;
      request.length = rays.empty();
      rays.push_back(marcher.march(request));
    }
    request.length = false;
    std::vector<LightPlanes> pictures;
    for (const RayImage& each : rays) pictures.push_back({each.reference, each.transmittance});
    proxies.push_back(encodeProxy(lengthImage(header, rays[0].length, rays[0].moment, rays[0].runs,
                                              rays[0].first, rays[0].last)));
    proxies.push_back(encodeProxy(trainingImage(header, pictures)));
    ArchiveWriter(path_, ExistingArchive::Overwrite).writeStep(proxies);
    for (std::uint64_t seed = options.firstSeed; seed <= options.lastSeed; ++seed) {
      request.base = heldOut(*header.base, *header.partition, seed);
      looks_.push_back(request.base);
      truth_.push_back(marcher.march(request).reference);
    }
    rect_ = projectedRect(request.camera, request.domain, kSize);
    request_.view = "front";
    request_.field = subject.name;
  }
  ~Subject() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }

  /// Mean squared error of linear RGB inside the box's projection, over all held-out looks.
  double learned(int clusters, int pictures) {
    request_.clusters = clusters;
    request_.pictures = pictures;
    const ProxyImage table = trainColors(*device_, Archive(path_), request_);
    ArchiveWriter(path_, ExistingArchive::Append).addToStep(encodeProxy(table));
    std::fprintf(stderr, "bench_learned: %d clusters, %d pictures: RMS %.4f in training\n",
                 clusters, pictures, table.header.learned->error);
    return error(Coloring::Learned);
  }
  double error(Coloring color) {
    Renderer renderer(device_, std::make_shared<const Archive>(path_));
    Look look;
    look.color = color;
    look.background = std::nullopt;
    double sum = 0.0;
    for (std::size_t i = 0; i < looks_.size(); ++i) {
      look.opacity = looks_[i].opacityPoints();
      sum += difference(renderer.render(look).picture, truth_[i]) / double(looks_.size());
    }
    return sum;
  }

 private:
  double difference(const Picture& made, const std::vector<float>& truth) const {
    const std::span<const float> planes(truth);
    const std::size_t n = kSize.pixels();
    const RgbView wanted =
        RgbView::planar(kSize, planes.first(n), planes.subspan(n, n), planes.subspan(2 * n, n));
    return std::pow(10.0, -0.1 * psnr(RgbView::interleaved(kSize, made.rgba, 4), wanted, rect_));
  }

  std::shared_ptr<gl::Device> device_;
  fs::path path_ = fs::temp_directory_path() / "vestige-bench-learned.cdb";
  TrainingRequest request_;
  std::vector<TransferFunction> looks_;
  std::vector<std::vector<float>> truth_;
  std::optional<PixelRect> rect_;
};

void measure(const std::shared_ptr<gl::Device>& device, const LayeredScene& scene,
             const BenchOptions& options) {
  const std::string prefix = std::string("learned_error_") + scene.name;
  std::fprintf(stderr, "bench_learned: %s\n", scene.name);
  Subject subject(device, scene, options);
  const auto print = [&](const std::string& line, double value) {
    std::printf("%s\t%.6g\n", line.c_str(), value);
    std::fflush(stdout);
  };
  for (const int clusters : {1, 8, 24, 48}) {
    const std::string line = prefix + "_K" + std::to_string(clusters);
    if (options.wants(line)) print(line, subject.learned(clusters, kPictures));
  }
  for (int pictures = 1; pictures <= kPictures; ++pictures) {
    const std::string line = prefix + "_T" + std::to_string(pictures);
    if (options.wants(line)) print(line, subject.learned(kClusters, pictures));
  }
  if (options.wants(prefix + "_function"))
    print(prefix + "_function", subject.error(Coloring::Function));
}

}  // namespace
}  // namespace vestige::test

int main(int argc, char** argv) {
  using namespace vestige::test;
  return runBench("bench_learned", argc, argv, [](const auto& options, const auto& device) {
    for (const LayeredScene& scene : kLayeredScenes) {
      if (options.wantsAny(std::string("learned_error_") + scene.name + "_"))
        measure(device, scene, options);
    }
  });
}
