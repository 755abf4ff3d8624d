// SPDX-License-Identifier: BSD-3-Clause
// Features of the developed plume (128^3, temperature x vorticity, four primitives) as the adaptor
// marches and stores them, decoded and recomposed as the explorer does, against the raw fields
// rendered on the CPU (method §10). The edits of a seed: every primitive is off (one in four) or
// has an opacity in 0..1 per reference length, and a colour.
//   feature_edit_psnr, feature_edit_psnr_min: of stacks of 20 slabs at their own view
//   feature_edit_psnr_S{8,12,32,64}[_min]: of other stacks
//   feature_edit_psnr_flat[_min]: of the flat proxy
//   feature_novel_psnr_{10,45,90}[_min]: three stacks of 20 slabs along the axes, fused, seen from
//   so
//     many degrees beside the first
//   feature_bytes_percent[_S{8,12,32,64}|_flat]: bytes of the file, of the two fields
// usage: bench_features --seeds A..B LINE...
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <glm/trigonometric.hpp>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>

#include "adaptor/march/feature_march.h"
#include "explorer/features/feature_grid.h"
#include "explorer/features/feature_recomposition.h"
#include "explorer/picture/metrics.h"
#include "explorer/volume/grid_painter.h"
#include "tests/bench/bench_run.h"
#include "tests/bench/sweep_scenes.h"
#include "tests/support/classified_renderer.h"

namespace vestige::test {
namespace {

constexpr int kCells = 128;
constexpr int kSamplesPerVoxel = 4;

/// Centres and widths are shares of the fields' ranges; one primitive is triangular.
constexpr const char* kPrimitives = R"({"kind": "gaussian", "fields": ["temperature", "vorticity"],
  "primitives": [{"name": "core", "center": [0.85, 0.15], "width": [0.25, 0.25]},
                 {"name": "shear", "center": [0.35, 0.45], "width": [0.2, 0.25]},
                 {"name": "halo", "center": [0.12, 0.08], "width": [0.06, 0.1]},
                 {"name": "rim", "center": [0.5, 0.2], "thickness": 0.03}]})";

/// The fields, and the classifier in their units.
struct Plume {
  FieldScenes scenes;
  double referenceLength;
  FeatureOrigin origin;

  Plume()
      : scenes({namedScene("plume", kCells, sceneCache()),
                namedScene("plume-vorticity", kCells, sceneCache())}),
        referenceLength(scenes.fields[0].domain().diagonal() / 100.0) {
    nlohmann::json json = nlohmann::json::parse(kPrimitives);
    for (auto& primitive : json["primitives"]) {
      for (std::size_t f = 0; f < 2; ++f) {
        const FieldDomain& domain = scenes.domains[f];
        primitive["center"][f] = domain.low + primitive["center"][f].get<double>() * domain.range();
        if (primitive.contains("width"))
          primitive["width"][f] = primitive["width"][f].get<double>() * domain.range();
      }
    }
    origin = {classifierFromJson(json, "")->resolved(scenes.domains, referenceLength),
              scenes.domains, referenceLength};
  }
  double bytes() const { return 2.0 * double(scenes.fields[0].values.size()) * sizeof(float); }
};

std::vector<ChannelOptics> editOf(const Plume& plume, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  auto edited = plume.origin.classifier->resolved(plume.origin.domains, plume.referenceLength);
  for (Feature& feature : edited->features()) {
    feature.enabled = unit(random) >= 0.25;
    feature.opacity = unit(random);
    feature.color = {unit(random), unit(random), unit(random)};
  }
  return edited->optics(plume.referenceLength);
}

void upload(FeatureMarcher& marcher, const Plume& plume) {
  const Scene& first = plume.scenes.fields[0];
  const auto [nx, ny, nz] = first.size;
  const auto plane = std::size_t(nx) * std::size_t(ny);
  std::vector<FillSlab> fills;
  for (std::size_t f = 0; f < 2; ++f) {
    fills.push_back([&, f](int z0, int z1, float* out) {
      const FieldDomain& domain = plume.scenes.domains[f];
      for (std::size_t i = std::size_t(z0) * plane; i < std::size_t(z1) * plane; ++i)
        *out++ = float((double(plume.scenes.fields[f].values[i]) - domain.low) / domain.range());
    });
  }
  fills.push_back([&, nx = nx, ny = ny](int z0, int z1, float* out) {
    for (int z = z0; z < z1; ++z)
      for (int y = 0; y < ny; ++y)
        for (int x = 0; x < nx; ++x)
          *out++ =
              float(plume.scenes.sample(first.origin + first.spacing * glm::dvec3(x, y, z), true)
                        .gradient);
  });
  marcher.upload(first.block(), fills, 2);
}

std::uintmax_t throughFile(const std::vector<std::byte>& bytes, const auto& use) {
  const auto path = std::filesystem::temp_directory_path() / "vestige-bench-features.exr";
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  use(ExrFile(path));
  std::filesystem::remove(path);
  return bytes.size();
}

/// Mean and least over the edits.
class Judge {
 public:
  Judge(const std::vector<RgbPicture>& truth, PixelRect rect) : truth_(truth), rect_(rect) {}

  void add(std::size_t edit, const Picture& picture) {
    const RgbPicture& truth = truth_[edit];
    const double db = std::min(psnr(RgbView::interleaved(picture.size, picture.rgba, 4),
                                    RgbView::interleaved(truth.size, truth.rgb), rect_),
                               100.0);
    sum_ += db;
    least_ = std::min(least_, db);
    ++count_;
  }
  void print(const std::string& name) const {
    std::printf("feature_%s\t%.2f\n", name.c_str(), sum_ / count_);
    std::printf("feature_%s_min\t%.2f\n", name.c_str(), least_);
    std::fflush(stdout);
  }
  void print(const std::string& name, double bytesPercent) const {
    print("edit_psnr" + name);
    std::printf("feature_bytes_percent%s\t%.2f\n", name.c_str(), bytesPercent);
    std::fflush(stdout);
  }

 private:
  const std::vector<RgbPicture>& truth_;
  PixelRect rect_;
  double sum_ = 0.0, least_ = 1e300;
  int count_ = 0;
};

constexpr int kNovelDegrees[] = {10, 45, 90};

/// Three stacks along the axes, as the explorer fuses and casts them.
void runNovel(const BenchOptions& options, const std::shared_ptr<gl::Device>& device,
              const Plume& plume, FeatureMarcher& marcher, const ProxyHeader& front,
              const std::vector<std::vector<ChannelOptics>>& edits) {
  constexpr int kSlabs = 20;
  const auto wanted = [&](int degrees) {
    return options.wantsAny("feature_novel_psnr_" + std::to_string(degrees));
  };
  if (std::none_of(std::begin(kNovelDegrees), std::end(kNovelDegrees), wanted)) return;
  const Box domain = front.domain;
  const auto normalised = plume.origin.classifier->normalised(plume.origin.domains);
  std::vector<FeatureStack> stacks;
  for (const auto& [forward, up] : {std::pair{glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1)},
                                    {glm::dvec3(1, 0, 0), glm::dvec3(0, 0, 1)},
                                    {glm::dvec3(0, 0, -1), glm::dvec3(0, 1, 0)}}) {
    const VoxelView view = sweepView(plume.scenes.fields[0], forward, up);
    FeatureStack stack{front, {}};
    stack.header.camera = view.camera;
    stack.header.size = view.size;
    stack.header.slabDepths = evenSlabs(view.camera, domain, kSlabs);
    stack.slabs =
        marcher.marchSlabs({view.camera, view.size, domain, 0.0, normalised.get(), edits.front()},
                           stack.header.slabDepths);
    throughFile(encodeFeatureStack(stack),
                [&](const ExrFile& file) { stacks.push_back(readFeatureStack(file)); });
  }
  const FeatureGrid weights = fusedFeatures(stacks);
  for (const int degrees : kNovelDegrees) {
    if (!wanted(degrees)) continue;
    const Camera camera =
        front.camera.orbited(domain.center(), glm::radians(double(degrees)), 0.0, 0.0);
    const auto truth = renderClassified(plume.scenes, *plume.origin.classifier, edits,
                                        {camera, front.size, kSamplesPerVoxel});
    Judge judge(truth, *projectedRect(camera, domain, front.size));
    Look look;
    look.clip = domain;
    const TransferFunction function = TransferFunction::ramp(0.0, 1.0, plume.referenceLength);
    for (std::size_t i = 0; i < edits.size(); ++i) {
      Picture picture;
      device->run([&] {
        LookGrid grid = weights.optics(edits[i]);
        GridPainter painter;
        picture = painter.draw(grid, look, function, nullptr, domain, camera, front.size).picture;
      });
      judge.add(i, picture);
    }
    judge.print("novel_psnr_" + std::to_string(degrees));
  }
}

void run(const BenchOptions& options, const std::shared_ptr<gl::Device>& device) {
  const Plume plume;
  const VoxelView view = sweepView(plume.scenes.fields[0], {0, 1, 0}, {0, 0, 1});
  const Box domain = plume.scenes.fields[0].domain();
  std::vector<std::vector<ChannelOptics>> edits;
  for (std::uint64_t seed = options.firstSeed; seed <= options.lastSeed; ++seed)
    edits.push_back(editOf(plume, seed));
  const auto truth = renderClassified(plume.scenes, *plume.origin.classifier, edits,
                                      {view.camera, view.size, kSamplesPerVoxel});
  const Judge empty(truth, *projectedRect(view.camera, domain, view.size));

  ProxyHeader header;
  header.field = "features";
  header.view = "stack";
  header.camera = view.camera;
  header.size = view.size;
  header.domain = domain;
  header.features = plume.origin;
  const auto normalised = plume.origin.classifier->normalised(plume.origin.domains);
  const FeatureRequest request{
      view.camera, view.size,        domain,
      0.0,         normalised.get(), plume.origin.classifier->optics(plume.referenceLength)};
  FeatureMarcher marcher(device);
  upload(marcher, plume);

  runNovel(options, device, plume, marcher, header, edits);
  for (const int slabs : {20, 8, 12, 32, 64}) {
    const std::string name = slabs == 20 ? "" : "_S" + std::to_string(slabs);
    if (!options.wants("feature_edit_psnr" + name) &&
        !options.wants("feature_edit_psnr" + name + "_min") &&
        !options.wants("feature_bytes_percent" + name))
      continue;
    FeatureStack stack{header, {}};
    stack.header.slabDepths = evenSlabs(view.camera, domain, slabs);
    stack.slabs = marcher.marchSlabs(request, stack.header.slabDepths);
    Judge judge = empty;
    const auto bytes = throughFile(encodeFeatureStack(stack), [&](const ExrFile& file) {
      const FeatureStack stored = readFeatureStack(file);
      for (std::size_t i = 0; i < edits.size(); ++i)
        judge.add(i, recomposed(stored, edits[i]).picture);
    });
    judge.print(name, 100.0 * double(bytes) / plume.bytes());
  }
  if (options.wantsAny("feature_edit_psnr_flat") || options.wants("feature_bytes_percent_flat")) {
    const RayImage rays = marcher.march(request);
    Judge judge = empty;
    const ProxyImage proxy =
        featureProxy(header, rays.attenuation, rays.transmittance, rays.length, rays.moment);
    const auto bytes = throughFile(encodeExr(proxy), [&](const ExrFile& file) {
      const FeatureImage stored = featureImage(file.image());
      for (std::size_t i = 0; i < edits.size(); ++i)
        judge.add(i, recomposed(stored, edits[i]).picture);
    });
    judge.print("_flat", 100.0 * double(bytes) / plume.bytes());
  }
}

}  // namespace
}  // namespace vestige::test

int main(int argc, char** argv) {
  return vestige::test::runBench("bench_features", argc, argv, vestige::test::run);
}
