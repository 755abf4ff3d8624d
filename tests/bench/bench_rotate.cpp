// SPDX-License-Identifier: BSD-3-Clause
// rotate_depth_correlation_SCENE_DEG[_distorted][_covered] and
// rotate_relit_dssim_SCENE_DEG[_distorted]: depth layers of the front view as the adaptor stores
// them, orthographic or multi-perspective, warped and relit by the explorer, against the raw
// field's isosurface drawn on the CPU at the rotated view [Tikhonova 2010, Fig. 6a].
// usage: bench_rotate --seeds A..B LINE...
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <glm/trigonometric.hpp>
#include <iterator>

#include "explorer/picture/metrics.h"
#include "explorer/renderer/renderer.h"
#include "proxy/archive/archive.h"
#include "proxy/format/layout/proxy_layout.h"
#include "tests/bench/bench_run.h"
#include "tests/support/cpu_renderer.h"

namespace vestige::test {
namespace {

constexpr ImageSize kSize{512, 512};

/// One surface a scene: skin of the head, the blob, the plume's hull.
struct Subject {
  const char* name;
  int size;
  double isovalue;
};
constexpr Subject kSubjects[] = {{"ct", 256, -300.0}, {"blob", 256, 0.5}, {"plume", 128, 0.15}};

MarchRequest requestFor(const Scene& scene, const Camera& camera, double isovalue) {
  const double range = scene.high - scene.low;
  // Opaque from the isovalue on, so that the surface is what is to be seen.
  const TransferFunction base({{isovalue - 1e-3 * range, 0.0}, {isovalue, 1.0}},
                              scene.domain().diagonal() / 100, Colormap::named("viridis"),
                              scene.low, scene.high);
  MarchRequest request{.camera = camera,
                       .size = kSize,
                       .partition = IntervalPartition::uniform(scene.low, scene.high, 16),
                       .base = base,
                       .domain = scene.domain(),
                       .isovalues = {isovalue}};
  request.attenuation = request.length = false;
  return request;
}

/// An archive of one depth proxy.
std::shared_ptr<const Archive> archiveOf(const RayImage& rays, const MarchRequest& request,
                                         const std::filesystem::path& folder) {
  ProxyHeader header;
  header.field = "field";
  header.view = "front";
  header.camera = request.camera;
  header.size = request.size;
  header.domain = request.domain;
  header.base = request.base;
  header.isovalues = request.isovalues;
  header.statistics.low = request.partition.low();
  header.statistics.high = request.partition.high();
  const ProxyImage image = depthImage(header, rays.depth, rays.normal);
  ArchiveWriter(folder, ExistingArchive::Overwrite).writeStep({encodeProxy(image)});
  return std::make_shared<const Archive>(folder);
}

struct Agreement {
  double correlation, covered;
};

/// Pearson's correlation of two depth pictures where both have a surface, and the share of the
/// true surface's pixels where that is so.
Agreement agreement(const std::vector<float>& made, const std::vector<float>& truth) {
  double n = 0, all = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!std::isfinite(truth[i])) continue;
    ++all;
    if (!std::isfinite(made[i])) continue;
    const double x = double(made[i]), y = double(truth[i]);
    ++n;
    a += x;
    b += y;
    aa += x * x;
    bb += y * y;
    ab += x * y;
  }
  return {(n * ab - a * b) / std::sqrt((n * aa - a * a) * (n * bb - b * b)), n / all};
}

/// The raw field's isosurface, opaque, in the colour of its value, under the light and material of
/// the look: Blinn-Phong [Tikhonova 2010, §5] with the gradient's normals, in double. Lights
/// are given in eye space, where an orthographic camera's viewer is at +z.
RgbPicture litSurface(const RayImage& truth, const MarchRequest& request, const Look& look) {
  RgbPicture picture{kSize, std::vector<float>(kSize.pixels() * 3, 0.0f)};
  const glm::dvec3 color = request.base.color(request.isovalues[0]);
  for (std::size_t i = 0; i < kSize.pixels(); ++i) {
    if (!std::isfinite(truth.depth[i])) continue;
    const glm::dvec3 n{truth.normal[i], truth.normal[kSize.pixels() + i],
                       truth.normal[2 * kSize.pixels() + i]};
    double diffuse = 0.0, specular = 0.0;
    for (const Light& light : look.lights) {
      const double az = glm::radians(light.azimuth), el = glm::radians(light.elevation);
      const glm::dvec3 from{std::sin(az) * std::cos(el), std::sin(el), std::cos(az) * std::cos(el)};
      const double facing = glm::dot(n, from);
      if (facing <= 0.0) continue;
      diffuse += light.intensity * facing;
      const glm::dvec3 halfway = glm::normalize(from + glm::dvec3(0.0, 0.0, 1.0));
      specular +=
          light.intensity * std::pow(std::max(glm::dot(n, halfway), 0.0), look.material.shininess);
    }
    const glm::dvec3 lit = color * (look.material.ambient + look.material.diffuse * diffuse) +
                           look.material.specular * specular;
    for (int c = 0; c < 3; ++c) picture.rgb[3 * i + std::size_t(c)] = float(lit[c]);
  }
  return picture;
}

/// The figures of a subject at an angle have names that end in this.
std::string suffixOf(const Subject& subject, int degrees, bool distorted) {
  return std::string(subject.name) + "_" + std::to_string(degrees) +
         (distorted ? "_distorted" : "");
}

bool wanted(const BenchOptions& options, const std::string& suffix) {
  return options.wants("rotate_depth_correlation_" + suffix) ||
         options.wants("rotate_depth_correlation_" + suffix + "_covered") ||
         options.wants("rotate_relit_dssim_" + suffix);
}

constexpr int kDegrees[] = {15, 30, 45, 60};

void measure(const std::shared_ptr<gl::Device>& device, const Subject& subject, bool distorted,
             const BenchOptions& options) {
  const Scene scene = namedScene(subject.name, subject.size, sceneCache());
  const std::string folder =
      (std::filesystem::temp_directory_path() / ("vestige-bench-rotate-" + scene.name)).string();
  const Camera front =
      frameBox(scene.domain(), {0, 1, 0}, {0, 0, 1}, 1.0,
               distorted ? Projection::MultiPerspective : Projection::Orthographic);
  const MarchRequest stored = requestFor(scene, front, subject.isovalue);
  Marcher marcher(device);
  Renderer renderer(device, archiveOf(marchOnGpu(marcher, scene, stored), stored, folder + ".cdb"));
  for (const int degrees : kDegrees) {
    const std::string suffix = suffixOf(subject, degrees, distorted);
    if (!wanted(options, suffix)) continue;
    Look look;
    look.source = Source::Layers;
    look.shading = Shading::Phong;
    look.lights = {{30.0, 30.0, 1.0}};
    look.rotate.azimuth = degrees;
    const Rendered turned = renderer.render(look);
    const MarchRequest there = requestFor(scene, turned.camera, subject.isovalue);
    const RayImage truth = marchOnCpu(scene, there, 2);
    const Agreement figures = agreement(turned.depth, truth.depth);
    std::printf("rotate_depth_correlation_%s\t%.5f\n", suffix.c_str(), figures.correlation);
    std::printf("rotate_depth_correlation_%s_covered\t%.5f\n", suffix.c_str(), figures.covered);
    const RgbPicture lit = litSurface(truth, there, look);
    std::printf("rotate_relit_dssim_%s\t%.5f\n", suffix.c_str(),
                dssim(RgbView::interleaved(kSize, turned.picture.rgba, 4),
                      RgbView::interleaved(kSize, lit.rgb),
                      projectedRect(turned.camera, scene.domain(), kSize)));
    std::fflush(stdout);
  }
  std::filesystem::remove_all(folder + ".cdb");
}

}  // namespace
}  // namespace vestige::test

int main(int argc, char** argv) {
  using namespace vestige::test;
  return runBench("bench_rotate", argc, argv, [](const auto& options, const auto& device) {
    for (const Subject& subject : kSubjects) {
      for (const bool distorted : {false, true}) {
        if (std::none_of(std::begin(kDegrees), std::end(kDegrees), [&](int degrees) {
              return wanted(options, suffixOf(subject, degrees, distorted));
            })) {
          continue;
        }
        std::fprintf(stderr, "bench_rotate: %s%s\n", subject.name,
                     distorted ? ", multi-perspective" : "");
        measure(device, subject, distorted, options);
      }
    }
  });
}
