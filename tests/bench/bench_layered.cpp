// SPDX-License-Identifier: BSD-3-Clause
// novel_view_dssim_SCENE_layered_DEG: layers of the front view as the adaptor stores them, drawn by
// the explorer after a turn, against the raw field rendered on the CPU (method §2 and §10;
// [Lochmann 2016, Tables 1 and 2, Fig. 9]). The look is unlit, so that both sides see
// the same light.
// usage: bench_layered --seeds A..B LINE...
#include <cmath>
#include <cstdio>
#include <glm/trigonometric.hpp>
#include <map>

#include "explorer/layers/analytic_layer_pass.h"
#include "explorer/picture/metrics.h"
#include "proxy/format/exr/exr_file.h"
#include "tests/bench/bench_run.h"
#include "tests/bench/layered_scenes.h"
#include "tests/bench/layered_storage.h"
#include "tests/fidelity/novel_view_peers.h"
#include "tests/support/cpu_renderer.h"

namespace vestige::test {
namespace {

constexpr ImageSize kSize{512, 512};
constexpr int kAngles[] = {0, 5, 10, 15, 30, 45, 60, 90};

/// The raw field's pictures of one look, by angle.
class Truth {
 public:
  Truth(const Scene& scene, const MarchRequest& request)
      : scene_(scene),
        front_(request.camera),
        medium_(tabulated(
            [&](double v) {
              return Optics{request.base.extinction(v), request.base.color(v)};
            },
            scene.low, scene.high)) {}

  Camera camera(int degrees) const {
    return front_.orbited(scene_.domain().center(), glm::radians(double(degrees)), 0.0);
  }
  const Medium& medium() const { return medium_; }
  const RgbPicture& at(int degrees) {
    auto& picture = pictures_[degrees];
    if (picture.rgb.empty()) {
      picture = renderContinuous(scene_, camera(degrees), kSize, std::span(&medium_, 1), 2)[0];
    }
    return picture;
  }
  double dssimOf(const Picture& picture, int degrees) {
    return dssim(RgbView::interleaved(kSize, picture.rgba, 4),
                 RgbView::interleaved(kSize, at(degrees).rgb),
                 projectedRect(camera(degrees), scene_.domain(), kSize));
  }

 private:
  const Scene& scene_;
  Camera front_;
  Medium medium_;
  std::map<int, RgbPicture> pictures_;
};

/// Layers of a request as they are stored and read.
struct StoredLayers {
  ProxyHeader header;
  AnalyticLayerPlanes planes;
  std::size_t bytes;
};

StoredLayers storedLayers(Marcher& marcher, const Scene& scene, const MarchRequest& request,
                          int layers) {
  const RayImage rays = marchOnGpu(marcher, scene, request);
  LayerGatherer gatherer(layers, rays.transmittance);
  gatherer.add(marcher.marchLayers(request, gatherer.request(nullptr)));
  ProxyHeader header;
  header.field = "field";
  header.view = "front";
  header.camera = request.camera;
  header.size = request.size;
  header.domain = request.domain;
  header.base = request.base;
  const ProxyImage image = layeredImage(header, gatherer.planes(rays.exit));
  return {image.header, layeredPlanes(image), encodeExr(image).size()};
}

void print(const std::string& line, double value) {
  std::printf("%s\t%.5f\n", line.c_str(), value);
  std::fflush(stdout);
}

/// The made and the true picture side by side in names, if VESTIGE_BENCH_PICTURES names a folder.
void keepPictures(const std::string& line, Picture made, const RgbPicture& truth) {
  const char* folder = std::getenv("VESTIGE_BENCH_PICTURES");
  if (!folder) return;
  Picture wanted = Picture::blank(kSize);
  for (std::size_t i = 0; i < kSize.pixels(); ++i) {
    made.rgba[4 * i + 3] = wanted.rgba[4 * i + 3] = 1.0f;
    for (std::size_t c = 0; c < 3; ++c) wanted.rgba[4 * i + c] = truth.rgb[3 * i + c];
  }
  const std::string base = std::string(folder) + "/" + line;
  writePicture(base + "_made.png", made);
  writePicture(base + "_true.png", wanted);
}

void measureLayers(const std::shared_ptr<gl::Device>& device, const Scene& scene,
                   const LayeredScene& subject, const BenchOptions& options) {
  const MarchRequest request = subject.request(scene, kSize);
  Marcher marcher(device);
  Truth truth(scene, request);
  for (const int layers : {4, 2, 8}) {
    const std::string tier =
        scene.name + "_layered" + (layers == 4 ? "" : "_k" + std::to_string(layers));
    const std::string bytes = "novel_view_bytes_percent_" + tier;
    if (!options.wantsAny("novel_view_dssim_" + tier + "_") && !options.wants(bytes)) continue;
    const StoredLayers stored = storedLayers(marcher, scene, request, layers);
    if (options.wants(bytes)) {
      const std::size_t native = scene.values.size() * std::size_t(scene.nativeBytes);
      print(bytes, 100.0 * double(stored.bytes) / double(native));
    }
    device->run([&] {
      AnalyticLayerPass pass;
      const AnalyticLayerTextures textures(stored.header, stored.planes);
      for (const int degrees : kAngles) {
        const std::string line = "novel_view_dssim_" + tier + "_" + std::to_string(degrees);
        if (!options.wants(line)) continue;
        const AnalyticLayerView view = pass.render(textures, truth.camera(degrees), kSize);
        print(line, truth.dssimOf(view.picture, degrees));
        keepPictures(line, view.picture, truth.at(degrees));
      }
    });
  }
}

/// Layers (k = 4) and the paper's peers at 10 degrees, at some density: Table 2 and Fig. 9.
void measurePeers(const std::shared_ptr<gl::Device>& device, const Scene& scene,
                  const LayeredScene& subject, double density, const std::string& suffix,
                  const BenchOptions& options) {
  constexpr int kDegrees = 10, kLayers = 4;
  const auto lineOf = [&](const char* tier) {
    return "novel_view_dssim_" + scene.name + "_" + tier + "_10" + suffix;
  };
  const bool own = !suffix.empty() && options.wants(lineOf("layered"));
  if (!own && !options.wants(lineOf("zellmann")) && !options.wants(lineOf("mueller"))) return;
  const MarchRequest request = subject.request(scene, kSize, density);
  Truth truth(scene, request);
  const Camera target = truth.camera(kDegrees);
  const auto report = [&](const char* tier, const auto& make) {
    if (!options.wants(lineOf(tier))) return;
    const Picture picture = make();
    print(lineOf(tier), truth.dssimOf(picture, kDegrees));
    keepPictures(lineOf(tier), picture, truth.at(kDegrees));
  };
  if (own) {
    report("layered", [&] {
      Marcher marcher(device);
      const StoredLayers stored = storedLayers(marcher, scene, request, kLayers);
      AnalyticLayerView view;
      device->run([&] {
        view = AnalyticLayerPass().render(AnalyticLayerTextures(stored.header, stored.planes),
                                          target, kSize);
      });
      return view.picture;
    });
  }
  report("zellmann", [&] {
    return warpPoints(renderSlabs(scene, request.camera, kSize, truth.medium(), 1), target);
  });
  report("mueller", [&] {
    return warpHeightFields(renderSlabs(scene, request.camera, kSize, truth.medium(), kLayers),
                            target);
  });
}

/// What OpenEXR's compressions make of four layers, in bytes and at 10 degrees (Fig. 7).
void measureStorage(const std::shared_ptr<gl::Device>& device, const Scene& scene,
                    const LayeredScene& subject, const BenchOptions& options) {
  constexpr int kDegrees = 10, kLayers = 4;
  const std::string prefix = "layered_storage_" + scene.name + "_";
  if (!options.wantsAny(prefix)) return;
  const MarchRequest request = subject.request(scene, kSize);
  Marcher marcher(device);
  Truth truth(scene, request);
  const StoredLayers layers = storedLayers(marcher, scene, request, kLayers);
  const double native = double(scene.values.size()) * scene.nativeBytes;
  for (const LayeredStorage& storage : layeredStorages()) {
    const std::string bytes = prefix + storage.name + "_bytes_percent";
    const std::string error = prefix + storage.name + "_dssim_10";
    if (!options.wants(bytes) && !options.wants(error)) continue;
    const StoredAs stored = storeLayers(layers.header, layers.planes, storage);
    if (options.wants(bytes)) print(bytes, 100.0 * double(stored.bytes) / native);
    if (!options.wants(error)) continue;
    AnalyticLayerView view;
    device->run([&] {
      view = AnalyticLayerPass().render(AnalyticLayerTextures(layers.header, stored.planes),
                                        truth.camera(kDegrees), kSize);
    });
    print(error, truth.dssimOf(view.picture, kDegrees));
  }
}

void measure(const std::shared_ptr<gl::Device>& device, const LayeredScene& subject,
             const BenchOptions& options) {
  const Scene scene = namedScene(subject.name, subject.size, sceneCache());
  measureLayers(device, scene, subject, options);
  measureStorage(device, scene, subject, options);
  measurePeers(device, scene, subject, 1.0, "", options);
  for (const auto& [density, suffix] : {std::pair{0.1, "_density_0.1"},
                                        {0.3, "_density_0.3"},
                                        {3.0, "_density_3"},
                                        {10.0, "_density_10"}}) {
    measurePeers(device, scene, subject, density, suffix, options);
  }
}

}  // namespace
}  // namespace vestige::test

int main(int argc, char** argv) {
  using namespace vestige::test;
  return runBench("bench_layered", argc, argv, [](const auto& options, const auto& device) {
    for (const LayeredScene& subject : kLayeredScenes) {
      const std::string name = subject.name;
      if (!options.wantsAny("novel_view_dssim_" + name + "_") &&
          !options.wantsAny("novel_view_bytes_percent_" + name + "_") &&
          !options.wantsAny("layered_storage_" + name + "_")) {
        continue;
      }
      std::fprintf(stderr, "bench_layered: %s\n", subject.name);
      measure(device, subject, options);
    }
  });
}
