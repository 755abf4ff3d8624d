// SPDX-License-Identifier: BSD-3-Clause
// edit_psnr_SCENE_TIER_{mean,min}[_continuous], edit_bytes_percent_SCENE_TIER and
// novel_view_dssim_SCENE_TIER_DEG of the reduced field, the yardstick of method §5: the field as it
// is stored and read, drawn by the explorer's ray caster, against the raw field rendered on the CPU
// (method §10), with the functions of bench_sliced and at its views, so that both tiers stand on
// one plot. One file serves all lines of a tier. Edits: pixels = voxels, seen along +y (smooth512:
// every other one); novel views: 256 x 256, mean over the functions. usage: bench_field --seeds
// A..B LINE...
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <glm/trigonometric.hpp>
#include <map>

#include "explorer/picture/metrics.h"
#include "explorer/volume/field_source.h"
#include "explorer/volume/grid_painter.h"
#include "proxy/format/exr/exr_file.h"
#include "tests/bench/bench_run.h"
#include "tests/bench/sweep_scenes.h"
#include "tests/support/cpu_renderer.h"
#include "tests/support/random_transfer_function.h"

namespace vestige::test {
namespace {

constexpr int kIntervals = 16;
constexpr int kSamplesPerVoxel = 2;
constexpr ImageSize kNovelSize{256, 256};
constexpr int kAngles[] = {5, 10, 15, 30, 45, 60, 90};

/// How a field is stored: the name of its lines, and by what it is reduced.
struct Tier {
  const char* name;
  int factor;
  double tolerance;  ///< of the range; errors are an order of magnitude below it as a rule
};
constexpr Tier kTiers[] = {{"field", 1, 0x1p-4},
                           {"field_loose", 1, 0x1p-3},
                           {"field_tight", 1, 0x1p-7},
                           {"field_half", 2, 0x1p-6},
                           {"field_quarter", 4, 0x1p-6}};

/// The field after storage.
struct Stored {
  ProxyImage image;
  std::size_t bytes;
};

Stored storedField(const Scene& scene, const Tier& tier) {
  FieldSamples samples;
  for (std::size_t a = 0; a < 3; ++a) {
    samples.axes[a] = {scene.size[a], scene.origin[int(a)], scene.spacing[int(a)], {}};
  }
  const auto [low, high] = std::minmax_element(scene.values.begin(), scene.values.end());
  samples.low = *low;
  samples.high = *high;
  const double range = samples.high - samples.low;
  for (const float value : scene.values) {
    samples.values.push_back(float((double(value) - samples.low) / range));
  }
  ProxyHeader header;
  header.field = "field";
  header.view = kFieldView;
  header.domain = scene.domain();
  header.camera = frameBox(header.domain, {0, 1, 0}, {0, 0, 1}, 1.0);
  header.statistics.low = samples.low;
  header.statistics.high = samples.high;
  const ProxyImage image =
      fieldImage(header, std::move(samples), {tier.factor, tier.tolerance * range});
  return {image, encodeExr(image).size()};
}

/// Pictures of one stored field.
class Drawing {
 public:
  explicit Drawing(const Stored& stored) : source_(stored.image) {}

  Picture draw(const OpticsTable::Optics& optics, const Scene& scene, const Camera& camera,
               ImageSize size) {
    const OpticsTable table(optics, scene.low, scene.high);
    VolumePass::findBricks(source_.grid(), table);
    VolumeSetup setup;
    setup.camera = camera;
    setup.size = size;
    setup.table = &table;
    return pass_.render(source_.grid(), setup).picture;
  }

 private:
  FieldSource source_;
  VolumePass pass_;
};

OpticsTable::Optics opticsOfIntervals(const IntervalPartition& partition,
                                      const IntervalLook& look) {
  return [partition, look](double value) {
    const auto k = std::size_t(partition.channelOf(value));
    return glm::dvec4(look.color[k] * look.extinction[k], look.extinction[k]);
  };
}

void print(const std::string& line, double value) {
  std::printf("%s\t%.5f\n", line.c_str(), value);
  std::fflush(stdout);
}

/// The truth of all seeds, made when a tier first asks for it.
struct Edits {
  Camera camera;
  ImageSize size;
  std::vector<OpticsTable::Optics> optics;
  std::vector<RgbPicture> truth;
};

void judge(const std::string& tier, const char* suffix, const Scene& scene, const Edits& edits,
           Drawing& drawing) {
  double sum = 0.0, least = 1e9;
  const auto rect = projectedRect(edits.camera, scene.domain(), edits.size);
  for (std::size_t i = 0; i < edits.optics.size(); ++i) {
    const Picture picture = drawing.draw(edits.optics[i], scene, edits.camera, edits.size);
    const double dB = psnr(RgbView::interleaved(edits.size, edits.truth[i].rgb),
                           RgbView::interleaved(edits.size, picture.rgba, 4), rect);
    sum += dB;
    least = std::min(least, dB);
  }
  print("edit_psnr_" + tier + "_mean" + suffix, sum / double(edits.optics.size()));
  print("edit_psnr_" + tier + "_min" + suffix, least);
}

class SceneBench {
 public:
  SceneBench(const char* name, const BenchOptions& options)
      : options_(options),
        scene_(sweepScene(name)),
        partition_(IntervalPartition::uniform(scene_.low, scene_.high, kIntervals)) {}

  void measure(gl::Device& device, const Tier& tier) {
    const std::string name = scene_.name + "_" + tier.name;
    const auto wants = [&](const std::string& line) { return options_.wants(line); };
    const bool constant =
        wants("edit_psnr_" + name + "_mean") || wants("edit_psnr_" + name + "_min");
    const bool continuous = wants("edit_psnr_" + name + "_mean_continuous") ||
                            wants("edit_psnr_" + name + "_min_continuous");
    std::vector<int> angles;
    for (const int degrees : kAngles) {
      if (wants("novel_view_dssim_" + name + "_" + std::to_string(degrees)))
        angles.push_back(degrees);
    }
    const std::string bytes = "edit_bytes_percent_" + name;
    if (!constant && !continuous && angles.empty() && !wants(bytes)) return;
    const Stored stored = storedField(scene_, tier);
    if (wants(bytes)) {
      print(bytes, 100.0 * double(stored.bytes) /
                       double(scene_.values.size() * std::size_t(scene_.nativeBytes)));
    }
    if (constant) constantEdits();
    if (continuous) continuousEdits();
    for (const int degrees : angles) novelTruth(degrees);
    device.run([&] {
      Drawing drawing(stored);
      if (constant) judge(name, "", scene_, constant_, drawing);
      if (continuous) judge(name, "_continuous", scene_, continuous_, drawing);
      for (const int degrees : angles) {
        print("novel_view_dssim_" + name + "_" + std::to_string(degrees),
              meanDssim(novel_[degrees], drawing));
      }
    });
  }

 private:
  double meanDssim(const Edits& views, Drawing& drawing) const {
    const auto rect = projectedRect(views.camera, scene_.domain(), views.size);
    double sum = 0.0;
    for (std::size_t i = 0; i < views.optics.size(); ++i) {
      const Picture picture = drawing.draw(views.optics[i], scene_, views.camera, views.size);
      sum += dssim(RgbView::interleaved(views.size, views.truth[i].rgb),
                   RgbView::interleaved(views.size, picture.rgba, 4), rect);
    }
    return sum / double(views.optics.size());
  }

  std::vector<RandomTransferFunction> functions() const {
    std::vector<RandomTransferFunction> all;
    for (std::uint64_t seed = options_.firstSeed; seed <= options_.lastSeed; ++seed) {
      all.emplace_back(seed, partition_, boxLength(scene_.domain()));
    }
    return all;
  }

  void constantEdits() {
    if (!constant_.truth.empty()) return;
    standOnSamples(constant_);
    addConstant(constant_);
  }

  void standOnSamples(Edits& edits) const {
    const VoxelView view = sweepView(scene_, {0, 1, 0}, {0, 0, 1});
    edits.camera = view.camera;
    edits.size = view.size;
  }

  /// Interval-wise functions and what they make of the raw field at a camera.
  void addConstant(Edits& edits) const {
    std::vector<IntervalLook> looks;
    for (const auto& function : functions()) {
      looks.push_back(function.constant());
      edits.optics.push_back(opticsOfIntervals(partition_, looks.back()));
    }
    edits.truth =
        renderIntervals(scene_, edits.camera, edits.size, partition_, looks, kSamplesPerVoxel);
  }

  void continuousEdits() {
    if (!continuous_.truth.empty()) return;
    standOnSamples(continuous_);
    std::vector<Medium> media;
    for (const auto& function : functions()) {
      continuous_.optics.push_back([function](double value) {
        const double extinction = function.extinction(value);
        return glm::dvec4(function.color(value) * extinction, extinction);
      });
      media.push_back(tabulated(
          [function](double value) {
            return Optics{function.extinction(value), function.color(value)};
          },
          scene_.low, scene_.high));
    }
    continuous_.truth =
        renderContinuous(scene_, continuous_.camera, continuous_.size, media, kSamplesPerVoxel);
  }

  void novelTruth(int degrees) {
    Edits& views = novel_[degrees];
    if (!views.truth.empty()) return;
    views.size = kNovelSize;
    views.camera = frameBox(scene_.domain(), {0, 1, 0}, {0, 0, 1}, 1.0)
                       .orbited(scene_.domain().center(), glm::radians(double(degrees)), 0.0);
    addConstant(views);
  }

  const BenchOptions& options_;
  Scene scene_;
  IntervalPartition partition_;
  Edits constant_, continuous_;
  std::map<int, Edits> novel_;
};

}  // namespace
}  // namespace vestige::test

int main(int argc, char** argv) {
  using namespace vestige::test;
  return runBench("bench_field", argc, argv, [](const auto& options, const auto& device) {
    for (const char* scene : kSweepScenes) {
      const std::string name = std::string(scene) + "_field";
      if (!options.wantsAny("edit_psnr_" + name) &&
          !options.wantsAny("edit_bytes_percent_" + name) &&
          !options.wantsAny("novel_view_dssim_" + name)) {
        continue;
      }
      std::fprintf(stderr, "bench_field: %s\n", scene);
      SceneBench bench(scene, options);
      for (const Tier& tier : kTiers) bench.measure(*device, tier);
    }
  });
}
