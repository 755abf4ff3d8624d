// SPDX-License-Identifier: BSD-3-Clause
// Gaussian transfer functions [Kniss 2003]:
//   gtf_integral_max_error{,_glsl}: of 10^5 segments that meet primitives of 1 to 4 fields, full K,
//     plain and triangular, 0.1 to 1000 of a field's range narrow; against quadrature, and of the
//     shader against the double-precision form (axes of K up to 30 times as long as one another:
//     beyond, the rounding of float values grows with that ratio);
//   gtf_psnr_{analytic_128,riemann_128,riemann_368}_WIDTH: Fig. 1 and 6: the CT head's skin and
//   bone
//     by triangular primitives a quarter, a half and one voxel thick, against 2048 slices by
//     Riemann sums; gtf_psnr_reference_WIDTH: the two forms against each other there;
//   gtf_slices_as_analytic_128_WIDTH: of the Riemann sum that is as good as analytic_128;
//   gtf_seconds_{analytic_128,riemann_368}_WIDTH: of a picture, over riemann_128;
//   gtf_cost_WAY_N: Table 5: of a frame with N primitives, over separable tables;
//   gtf_cost_per_primitive: of each further analytic one, over a frame with one separable one.
// With VESTIGE_PICTURES=FOLDER the pictures of heads are written there.
// usage: bench_classify --seeds A..B LINE...   (the first seed makes the segments)
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "explorer/picture/metrics.h"
#include "tests/bench/bench_run.h"
#include "tests/bench/classify_cost.h"
#include "tests/bench/classify_slices.h"
#include "tests/support/random_segments.h"

namespace vestige::test {
namespace {

void print(const std::string& line, double value) {
  std::printf("%s\t%.6g\n", line.c_str(), value);
  std::fflush(stdout);
}

// --- integrals -----------------------------------------------------------------------------------

void measureIntegral(unsigned seed) {
  RandomSegments random(seed);
  double worst = 0.0;
  for (int i = 0; i < 100000; ++i) {
    const GaussianPrimitive primitive = random.primitive(1 + i % 4, i % 8 >= 4);
    const Segment segment = random.near(primitive);
    worst = std::max(worst, std::abs(primitive.mean(segment.a, segment.b) -
                                     meanByQuadrature(primitive, segment)));
  }
  print("gtf_integral_max_error", worst);
}

void measureIntegralGlsl(gl::Device& device, unsigned seed) {
  RandomSegments random(seed);
  const std::vector<std::string> names{"a", "b", "c", "d"};
  double worst = 0.0;
  for (int round = 0; round < 100; ++round) {
    const int fields = 1 + round % 4;
    nlohmann::json object = {
        {"kind", "gaussian"},
        {"fields", std::vector<std::string>(names.begin(), names.begin() + fields)}};
    std::vector<GaussianPrimitive> primitives;
    for (int i = 0; i < 16; ++i) {
      primitives.push_back(random.primitive(fields, i % 2 == 1, 30.0));
      object["primitives"].push_back(primitiveJson(primitives.back()));
    }
    std::vector<Segment> segments;
    for (std::size_t i = 0; i < 1000; ++i) segments.push_back(random.near(primitives[i % 16]));
    const auto classifier = classifierFromJson(object, "", "bench");
    const std::vector<float> weights = classifyOnGpu(device, *classifier, segments);
    for (std::size_t i = 0; i < 1000; ++i) {
      const double exact = meanByQuadrature(primitives[i % 16], segments[i]);
      worst = std::max(worst, std::abs(exact - double(weights[i * 16 + i % 16])));
    }
  }
  print("gtf_integral_max_error_glsl", worst);
}

// --- slices --------------------------------------------------------------------------------------

constexpr ImageSize kSize{512, 512};
struct Width {
  const char* name;
  double voxels;
};
constexpr Width kWidths[] = {{"narrow", 0.25}, {"medium", 0.5}, {"wide", 1.0}};

/// Skin and bone, so opaque that a ray along the gradient loses 1 - exp(-0.4) and 1 - exp(-2.5).
std::unique_ptr<Classifier> surfaces(const Scene& scene, double thickness) {
  const double range = scene.high - scene.low;
  const auto surface = [&](const char* name, double value, double depth, const char* color) {
    return nlohmann::json{{"name", name},
                          {"center", {value}},
                          {"width", {range}},
                          {"thickness", thickness},
                          {"opacity", 1.0 - std::exp(-depth / std::sqrt(M_PI))},
                          {"color", color}};
  };
  return classifierFromJson(
      {{"kind", "gaussian"},
       {"fields", {"ct"}},
       {"primitives",
        {surface("skin", -400.0, 0.4, "#e0a080"), surface("bone", 400.0, 2.5, "#ffffff")}}},
      "", "bench");
}

void keep(const std::string& name, const Picture& picture) {
  if (const char* folder = std::getenv("VESTIGE_PICTURES"))
    writePicture(std::string(folder) + "/" + name + ".png", picture);
}

double psnrOf(const Picture& a, const Picture& b, const std::optional<PixelRect>& rect) {
  return psnr(RgbView::interleaved(a.size, a.rgba, 4), RgbView::interleaved(b.size, b.rgba, 4),
              rect);
}

void measureSlices(gl::Device& device, const Width& width) {
  const Scene scene = namedScene("ct", 256, sceneCache());
  const Camera camera = frameBox(scene.domain(), {-0.4, -1.0, -0.2}, {0, 0, 1}, 1.0);
  const auto rect = projectedRect(camera, scene.domain(), kSize);
  SliceRenderer renderer(device, {&scene, camera, kSize});
  const double thickness = width.voxels * scene.minimumSpacing();
  const auto classifier = surfaces(scene, thickness);
  const std::string suffix = std::string("_") + width.name;
  const auto draw = [&](Slab slab, int slices, int repeats) {
    return renderer.draw(*classifier, thickness, slab, slices, repeats);
  };
  const Picture truth = draw(Slab::Riemann, 2048, 1).picture;
  keep("gtf_reference" + suffix, truth);
  print("gtf_psnr_reference" + suffix, psnrOf(draw(Slab::Analytic, 2048, 1).picture, truth, rect));
  double analytic = 0.0, unit = 0.0;
  struct Row {
    const char* name;
    Slab slab;
    int slices;
  };
  for (const Row& row :
       {Row{"riemann_128", Slab::Riemann, 128}, Row{"analytic_128", Slab::Analytic, 128},
        Row{"riemann_368", Slab::Riemann, 368}}) {
    const SlicedPicture made = draw(row.slab, row.slices, 3);
    const double quality = psnrOf(made.picture, truth, rect);
    if (row.slab == Slab::Analytic) analytic = quality;
    if (unit == 0.0) unit = made.seconds;
    keep(std::string("gtf_") + row.name + suffix, made.picture);
    print(std::string("gtf_psnr_") + row.name + suffix, quality);
    if (made.seconds != unit)
      print(std::string("gtf_seconds_") + row.name + suffix, made.seconds / unit);
  }
  int slices = 96;
  for (double quality = 0.0; quality < analytic && slices < 2048; slices += 32)
    quality = psnrOf(draw(Slab::Riemann, slices + 32, 1).picture, truth, rect);
  print("gtf_slices_as_analytic_128" + suffix, slices);
}

// --- cost ----------------------------------------------------------------------------------------

void measureCost(gl::Device& device) {
  const std::vector<ClassifyWay> ways = tableOfWays();
  std::vector<double> analytic;
  double unit = 0.0;
  for (int primitives = 1; primitives <= 4; ++primitives) {
    const std::vector<double> seconds = secondsToClassify(device, ways, primitives);
    for (std::size_t i = 0; i < ways.size(); ++i) {
      if (ways[i].name == "analytic") analytic.push_back(seconds[i]);
      if (i == 0) continue;
      print("gtf_cost_" + ways[i].name + "_" + std::to_string(primitives), seconds[i] / seconds[0]);
    }
    if (primitives == 1) unit = seconds[0];
  }
  print("gtf_cost_per_primitive", (analytic.back() - analytic.front()) / 3.0 / unit);
}

}  // namespace
}  // namespace vestige::test

int main(int argc, char** argv) {
  using namespace vestige::test;
  return runBench("bench_classify", argc, argv, [](const auto& options, const auto& device) {
    const auto seed = unsigned(options.firstSeed);
    if (options.wants("gtf_integral_max_error")) measureIntegral(seed);
    if (options.wants("gtf_integral_max_error_glsl")) measureIntegralGlsl(*device, seed);
    for (const Width& width : kWidths) {
      const auto asked = [&](const std::string& line) { return line.ends_with(width.name); };
      if (std::any_of(options.lines.begin(), options.lines.end(), asked))
        measureSlices(*device, width);
    }
    if (options.wantsAny("gtf_cost_")) measureCost(*device);
  });
}
