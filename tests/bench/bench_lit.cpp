// SPDX-License-Identifier: BSD-3-Clause
// Our side of lit_stripes_*, driven by lit.py: a smooth ball, stored as a field within 1e-5 of its
// range and drawn with light by the explorer.
// usage: bench_lit FOLDER AZIMUTH ELEVATION      writes FOLDER/ball.raw, FOLDER/scene.json for
// vtk_side.py, and FOLDER/ours.f32: the luminance of the picture, linear, row by row from the top
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <nlohmann/json.hpp>

#include "explorer/layers/depth_layer_pass.h"
#include "explorer/volume/field_source.h"
#include "proxy/format/exr/exr_file.h"
#include "proxy/gl/device.h"
#include "tests/bench/vtk_scene.h"
#include "tests/support/scenes.h"

namespace vestige::test {
namespace {

namespace fs = std::filesystem;

constexpr int kSamples = 96;         ///< of the field, a side
constexpr int kPixels = 512;         ///< of the picture, a side: 5.3 a cell
constexpr double kTolerance = 1e-5;  ///< of the range, in storage
constexpr double kRadius = 0.73, kSkin = 0.06;

/// 1 within the ball, 0 outside, over a skin of about ten cells.
Scene ball() {
  return makeScene("ball", kSamples, {glm::dvec3(-1.0), glm::dvec3(1.0)}, [](glm::dvec3 at) {
    return 1.0 / (1.0 + std::exp((glm::length(at) - kRadius) / kSkin));
  });
}

/// White, and opaque within a few cells.
TransferFunction whiteSkin(const Scene& scene) {
  return TransferFunction({{0.3, 0.0}, {0.7, 0.9}}, scene.domain().diagonal() / 100,
                          Colormap::fromSrgb("white", {glm::dvec3(1.0)}), 0.0, 1.0);
}

/// Without gloss, which we and VTK define differently.
Look matt() {
  Look look;
  look.shading = Shading::Phong;
  look.lights = {{20.0, 20.0, 1.0}};
  look.material = {0.3, 0.7, 0.0, 1.0};
  return look;
}

ProxyImage stored(const Scene& scene) {
  FieldSamples samples;
  for (std::size_t a = 0; a < 3; ++a) {
    samples.axes[a] = {scene.size[a], scene.origin[int(a)], scene.spacing[int(a)], {}};
  }
  samples.low = 0.0;
  samples.high = 1.0;
  samples.values = scene.values;
  ProxyHeader header;
  header.field = "field";
  header.view = kFieldView;
  header.domain = scene.domain();
  header.camera = frameBox(header.domain, {0, 1, 0}, {0, 0, 1}, 1.0);
  header.statistics.low = samples.low;
  header.statistics.high = samples.high;
  return fieldImage(header, std::move(samples), {1, kTolerance});
}

void writeFloats(const fs::path& path, const std::vector<float>& values) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(values.data()),
             std::streamsize(values.size() * sizeof(float)));
  if (!file) throw std::runtime_error("cannot write " + path.string());
}

/// The same for vtk_side.py, with what lit.py measures by.
void writeScene(const Scene& scene, const TransferFunction& function, const LightSetup& light,
                const Camera& camera, const fs::path& folder) {
  const double pixel = camera.viewHeight / kPixels;
  const glm::dvec3 toward = light.directions.front();
  nlohmann::json json = vtkScene(scene, folder / "ball.raw", camera, kPixels,
                                 function.opacityPoints(), function.referenceLength());
  json["light"] = {{"ambient", light.material.ambient},
                   {"diffuse", light.material.diffuse},
                   {"toward", {toward.x, toward.y, toward.z}}};
  json["pixelsPerCell"] = scene.spacing.x / pixel;
  json["ballRadiusPixels"] = kRadius / pixel;
  for (const double value : {0.0, 1.0}) {
    const glm::dvec3 c = function.color(value);
    json["colors"].push_back({value, c.r, c.g, c.b});
  }
  std::ofstream(folder / "scene.json") << json;
}

void draw(const fs::path& folder, double azimuth, double elevation) {
  const Scene scene = ball();
  writeFloats(folder / "ball.raw", scene.values);
  const TransferFunction function = whiteSkin(scene);
  const Look look = matt();
  const Camera camera =
      frameBox(scene.domain(), {0, 1, 0}, {0, 0, 1}, 1.0)
          .orbited(scene.domain().center(), glm::radians(azimuth), glm::radians(elevation));
  writeScene(scene, function, lightSetup(look, camera, camera, scene.domain()), camera, folder);
  const ProxyImage image = stored(scene);
  std::vector<float> luminance;
  gl::Device::create("auto")->run([&] {
    FieldSource source(image);
    const Picture picture = source.draw(look, function, camera, {kPixels, kPixels}).picture;
    for (std::size_t i = 0; i < picture.rgba.size(); i += 4) luminance.push_back(picture.rgba[i]);
  });
  writeFloats(folder / "ours.f32", luminance);
}

}  // namespace
}  // namespace vestige::test

int main(int argc, char** argv) {
  try {
    if (argc != 4) throw std::runtime_error("usage: bench_lit FOLDER AZIMUTH ELEVATION");
    vestige::test::draw(argv[1], std::stod(argv[2]), std::stod(argv[3]));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_lit: %s\n", error.what());
    return 1;
  }
  return 0;
}
