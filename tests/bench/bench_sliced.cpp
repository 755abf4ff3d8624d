// SPDX-License-Identifier: BSD-3-Clause
// Sliced stacks as the adaptor marches and stores them, decoded and drawn as the explorer does,
// against the raw field rendered on the CPU (method §10), random transfer functions:
//   edit_psnr_SCENE_sliced_{mean,min}[_continuous[_L{32,64}]]: edits at the stored view
//   edit_bytes_percent_SCENE_sliced[3][_L{32,64}]: of one stack, of three, of the native field
//   novel_view_dssim_SCENE_sliced[3]_DEG: turned about the up axis, mean over the functions
//   novel_view_dssim_SCENE_sliced3_sphere: the worst of directions all over the sphere
// Settings other than twenty slabs and 32 levels stand after the tier: sliced_S12_q16,
// sliced3_S12_q16. The scene smooth512 is the formula at 512^3 seen by 256^2 pixels.
// usage: bench_sliced --seeds A..B LINE...
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <glm/trigonometric.hpp>
#include <map>

#include "explorer/picture/metrics.h"
#include "explorer/recomposition/edit_pass.h"
#include "explorer/stacks/stack_grid.h"
#include "explorer/stacks/stack_segments.h"
#include "explorer/volume/volume_pass.h"
#include "tests/bench/bench_run.h"
#include "tests/bench/sweep_scenes.h"
#include "tests/support/cpu_renderer.h"
#include "tests/support/random_transfer_function.h"

namespace vestige::test {
namespace {

constexpr int kSamplesPerVoxel = 2;

/// How finely stacks are cut and counted.
struct Setting {
  int slabs = 20, levels = 32;

  bool isDefault() const { return slabs == 20 && levels == 32; }
  /// What lines have after the tier.
  std::string suffix() const {
    return isDefault() ? "" : "_S" + std::to_string(slabs) + "_q" + std::to_string(levels);
  }
};

std::vector<Setting> settings() {
  std::vector<Setting> all{{}};
  for (const int slabs : {8, 12, 20, 32}) {
    for (const int levels : {16, 32, 64}) {
      if (const Setting setting{slabs, levels}; !setting.isDefault()) all.push_back(setting);
    }
  }
  return all;
}

FieldStatistics statisticsOf(const Scene& scene) {
  FieldStatistics statistics;
  const auto [low, high] = std::minmax_element(scene.values.begin(), scene.values.end());
  statistics.low = double(*low);
  statistics.high = double(*high);
  statistics.histogram.assign(256, 0);
  for (const float value : scene.values) {
    const double share = (double(value) - statistics.low) / (statistics.high - statistics.low);
    ++statistics.histogram[std::size_t(std::min(255.0, share * 256.0))];
  }
  return statistics;
}

struct Stored {
  SlicedStack stack;
  std::uintmax_t bytes = 0;
};

/// Marches, stores and reads a stack along an axis whose pixels stand on the samples.
Stored storedStack(Marcher& marcher, const Scene& scene, glm::dvec3 forward, glm::dvec3 up,
                   int intervals, Setting setting) {
  const VoxelView view = sweepView(scene, forward, up);
  ProxyHeader header;
  header.field = "field";
  header.view = "stack";
  header.camera = view.camera;
  header.size = view.size;
  header.domain = scene.domain();
  header.partition = IntervalPartition::uniform(scene.low, scene.high, intervals);
  header.statistics = statisticsOf(scene);
  header.slabDepths = evenSlabs(view.camera, header.domain, setting.slabs);
  MarchRequest request{.camera = view.camera,
                       .size = view.size,
                       .partition = *header.partition,
                       .base = TransferFunction::ramp(scene.low, scene.high, 1.0),
                       .domain = header.domain,
                       .isovalues = {}};
  uploadScene(marcher, scene, request.partition);
  StackBuilder builder(header, setting.levels);
  marcher.marchSlabs(request, header.slabDepths,
                     [&](int, const SlabRays& rays) { builder.add(rays); });
  const auto bytes = encodeStack(builder.take());
  const auto path =
      std::filesystem::temp_directory_path() / ("vestige-bench-sliced-" + scene.name + ".exr");
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
  Stored stored{readStack(ExrFile(path)), bytes.size()};
  std::filesystem::remove(path);
  return stored;
}

struct Functions {
  std::vector<RandomTransferFunction> all;
  std::vector<IntervalLook> constant;
  std::vector<Medium> media;

  Functions(const BenchOptions& options, const Scene& scene, const IntervalPartition& partition) {
    for (std::uint64_t seed = options.firstSeed; seed <= options.lastSeed; ++seed) {
      all.emplace_back(seed, partition, boxLength(scene.domain()));
      constant.push_back(all.back().constant());
      media.push_back(tabulated(
          [function = all.back()](double f) {
            return Optics{function.extinction(f), function.color(f)};
          },
          scene.low, scene.high));
    }
  }
};

/// The means of a continuous function over fine channels.
ChannelTable fineMeans(const RandomTransferFunction& function, const FineChannels& channels) {
  constexpr int kSamples = 64;
  ChannelTable table{std::vector<double>(std::size_t(channels.count()), 0.0),
                     std::vector<glm::dvec3>(std::size_t(channels.count()), glm::dvec3(0.0))};
  const auto bounds = channels.partition().bounds();
  for (int k = 0; k < channels.partition().intervals(); ++k) {
    const double low = bounds[std::size_t(k)], width = bounds[std::size_t(k) + 1] - low;
    for (int part = 0; part < channels.parts(); ++part) {
      const auto at = [&](double share) { return low + width * (part + share) / channels.parts(); };
      double sum = 0.0;
      for (int i = 0; i < kSamples; ++i) sum += function.extinction(at((i + 0.5) / kSamples));
      const auto channel = std::size_t(channels.channel(k + 1, part));
      table.strength[channel] = sum / kSamples;
      table.color[channel] = function.color(at(0.5));
    }
  }
  return table;
}

void printEdits(gl::Device& device, const Scene& scene, const Stored& stored,
                const std::vector<ChannelTable>& tables, const std::vector<RgbPicture>& truth,
                const FineChannels& channels, const std::string& tier, const std::string& suffix) {
  const ProxyHeader& header = stored.stack.header;
  const SegmentLists lists = segmentsOfRuns(runsOfStack(stored.stack), channels, header.statistics,
                                            header.domain.diagonal());
  const auto rect = projectedRect(header.camera, header.domain, header.size);
  double mean = 0.0, least = 1e9;
  device.run([&] {
    EditPass pass;
    const SegmentTextures textures(lists);
    for (std::size_t i = 0; i < tables.size(); ++i) {
      const Picture edit = pass.render(textures, tables[i]);
      const double dB = psnr(RgbView::interleaved(header.size, truth[i].rgb),
                             RgbView::interleaved(header.size, edit.rgba, 4), rect);
      mean += dB / double(tables.size());
      least = std::min(least, dB);
    }
  });
  std::printf("edit_psnr_%s_%s_mean%s\t%.3f\n", scene.name.c_str(), tier.c_str(), suffix.c_str(),
              mean);
  std::printf("edit_psnr_%s_%s_min%s\t%.3f\n", scene.name.c_str(), tier.c_str(), suffix.c_str(),
              least);
  std::fflush(stdout);
}

double percentOf(const Scene& scene, std::uintmax_t bytes) {
  return 100.0 * double(bytes) / (double(scene.values.size()) * scene.nativeBytes);
}

/// Pictures of the raw field at the stored view, made when first asked for.
struct EditTruth {
  std::vector<RgbPicture> constant, continuous;
};

void measureEdits(const std::shared_ptr<gl::Device>& device, Marcher& marcher, const Scene& scene,
                  int intervals, Setting setting, EditTruth& truth, const BenchOptions& options) {
  const std::string size = intervals == 16 ? "" : "_L" + std::to_string(intervals);
  const std::string tier = "sliced" + setting.suffix();
  const std::string psnrs = "edit_psnr_" + scene.name + "_" + tier + "_";
  const std::string percent = "edit_bytes_percent_" + scene.name + "_" + tier + size;
  const bool constant =
      intervals == 16 && (options.wants(psnrs + "mean") || options.wants(psnrs + "min"));
  const std::string suffix = "_continuous" + size;
  const bool continuous =
      options.wants(psnrs + "mean" + suffix) || options.wants(psnrs + "min" + suffix);
  if (!constant && !continuous && !options.wants(percent)) return;
  const Stored stored = storedStack(marcher, scene, {0, 1, 0}, {0, 0, 1}, intervals, setting);
  const ProxyHeader& header = stored.stack.header;
  std::printf("%s\t%.3f\n", percent.c_str(), percentOf(scene, stored.bytes));
  // Functions are drawn for 16 intervals whatever the stack has.
  const auto partition = IntervalPartition::uniform(scene.low, scene.high, 16);
  const Functions functions(options, scene, partition);
  const FineChannels channels(*header.partition);
  if (constant) {
    std::vector<ChannelTable> tables;
    for (const IntervalLook& look : functions.constant) tables.push_back(channels.table(look));
    if (truth.constant.empty()) {
      truth.constant = renderIntervals(scene, header.camera, header.size, partition,
                                       functions.constant, kSamplesPerVoxel);
    }
    printEdits(*device, scene, stored, tables, truth.constant, channels, tier, "");
  }
  if (continuous) {
    std::vector<ChannelTable> tables;
    for (const auto& function : functions.all) tables.push_back(fineMeans(function, channels));
    if (truth.continuous.empty()) {
      truth.continuous =
          renderContinuous(scene, header.camera, header.size, functions.media, kSamplesPerVoxel);
    }
    printEdits(*device, scene, stored, tables, truth.continuous, channels, tier, suffix);
  }
}

void measureEdits(const std::shared_ptr<gl::Device>& device, Marcher& marcher, const Scene& scene,
                  const BenchOptions& options) {
  EditTruth truth;
  for (const Setting setting : settings()) {
    for (const int intervals : {16, 32, 64}) {
      measureEdits(device, marcher, scene, intervals, setting, truth, options);
    }
  }
}

constexpr ImageSize kNovelSize{256, 256};

/// Views of a scene's stacks, of which the explorer makes one grid.
class Turned {
 public:
  Turned(gl::Device& device, const Scene& scene, const std::vector<Stored>& stacks,
         const std::vector<IntervalLook>& looks)
      : device_(device),
        scene_(scene),
        partition_(*stacks.front().stack.header.partition),
        looks_(looks) {
    std::vector<StackSamples> samples;
    for (const Stored& stored : stacks) {
      samples.push_back(sampledStack(stored.stack.header, runsOfStack(stored.stack)));
    }
    const StackSamples fused = fusedStacks(std::move(samples));
    device_.run([&] {
      pass_ = std::make_unique<VolumePass>();
      grid_ = std::make_unique<LookGrid>(fused.upload());
    });
  }
  ~Turned() {
    device_.run([&] {
      grid_.reset();
      pass_.reset();
    });
  }

  /// Mean DSSIM over the functions.
  double dssimOf(const Camera& camera, const std::vector<RgbPicture>& truth) {
    const auto rect = projectedRect(camera, scene_.domain(), kNovelSize);
    double sum = 0.0;
    for (std::size_t i = 0; i < looks_.size(); ++i) {
      const Picture picture = draw(camera, looks_[i]);
      sum += dssim(RgbView::interleaved(kNovelSize, truth[i].rgb),
                   RgbView::interleaved(kNovelSize, picture.rgba, 4), rect);
    }
    return sum / double(looks_.size());
  }
  std::vector<RgbPicture> truth(const Camera& camera) const {
    return renderIntervals(scene_, camera, kNovelSize, partition_, looks_, kSamplesPerVoxel);
  }

 private:
  Picture draw(const Camera& camera, const IntervalLook& look) {
    Picture picture;
    device_.run([&] {
      const OpticsTable table(
          [&](double value) {
            const int k = partition_.channelOf(value);
            if (k >= partition_.intervals()) return glm::dvec4(0.0);
            const double extinction = look.extinction[std::size_t(k)];
            return glm::dvec4(extinction * look.color[std::size_t(k)], extinction);
          },
          partition_.low(), partition_.high());
      VolumePass::findBricks(*grid_, table);
      VolumeSetup setup;
      setup.camera = camera;
      setup.size = kNovelSize;
      setup.table = &table;
      setup.clip = scene_.domain();
      setup.step = pass_->longestStep(*grid_, table, scene_.domain());
      picture = pass_->render(*grid_, setup).picture;
    });
    return picture;
  }

  gl::Device& device_;
  const Scene& scene_;
  IntervalPartition partition_;
  const std::vector<IntervalLook>& looks_;
  std::unique_ptr<VolumePass> pass_;
  std::unique_ptr<LookGrid> grid_;
};

/// Twelve directions all over the sphere (a Fibonacci lattice).
std::vector<glm::dvec2> sphere() {
  std::vector<glm::dvec2> angles;
  constexpr int kCount = 12;
  for (int i = 0; i < kCount; ++i) {
    const double turn = i * glm::radians(180.0) * (3.0 - std::sqrt(5.0));
    angles.emplace_back(turn, std::asin(1.0 - (2.0 * i + 1.0) / kCount));
  }
  return angles;
}

/// Pictures of the raw field, by degrees.
using NovelTruth = std::map<int, std::vector<RgbPicture>>;

void measureNovel(const std::shared_ptr<gl::Device>& device, Marcher& marcher, const Scene& scene,
                  const Functions& functions, Setting setting, NovelTruth& truths,
                  const BenchOptions& options) {
  const std::string one = scene.name + "_sliced" + setting.suffix();
  const std::string three = scene.name + "_sliced3" + setting.suffix();
  const std::string dssim = "novel_view_dssim_", percent = "edit_bytes_percent_" + three;
  const auto wants = [&](const std::string& tier, int degrees) {
    return options.wants(dssim + tier + "_" + std::to_string(degrees));
  };
  constexpr int kAngles[] = {5, 10, 15, 30, 45, 60, 90};
  const bool sphereToo = options.wants(dssim + three + "_sphere");
  bool any1 = false, any3 = sphereToo || options.wants(percent);
  for (const int degrees : kAngles) {
    any1 |= wants(one, degrees);
    any3 |= wants(three, degrees);
  }
  if (!any1 && !any3) return;
  std::vector<Stored> stacks;
  const auto store = [&](glm::dvec3 forward, glm::dvec3 up) {
    stacks.push_back(storedStack(marcher, scene, forward, up, 16, setting));
  };
  store({0, 1, 0}, {0, 0, 1});
  std::unique_ptr<Turned> turned1, turned3;
  if (any1) turned1 = std::make_unique<Turned>(*device, scene, stacks, functions.constant);
  if (any3) {
    store({1, 0, 0}, {0, 0, 1});
    store({0, 0, -1}, {0, 1, 0});
    turned3 = std::make_unique<Turned>(*device, scene, stacks, functions.constant);
    std::uintmax_t bytes = 0;
    for (const Stored& stored : stacks) bytes += stored.bytes;
    std::printf("%s\t%.3f\n", percent.c_str(), percentOf(scene, bytes));
  }
  const Turned& any = turned1 ? *turned1 : *turned3;
  const Camera front = frameBox(scene.domain(), {0, 1, 0}, {0, 0, 1}, 1.0);
  for (const int degrees : kAngles) {
    if (!wants(one, degrees) && !wants(three, degrees)) continue;
    const Camera camera =
        front.orbited(scene.domain().center(), glm::radians(double(degrees)), 0.0);
    auto& truth = truths[degrees];
    if (truth.empty()) truth = any.truth(camera);
    const auto report = [&](const std::string& tier, Turned& turned) {
      if (!wants(tier, degrees)) return;
      std::printf("%s%s_%d\t%.5f\n", dssim.c_str(), tier.c_str(), degrees,
                  turned.dssimOf(camera, truth));
      std::fflush(stdout);
    };
    if (turned1) report(one, *turned1);
    if (turned3) report(three, *turned3);
  }
  if (!sphereToo) return;
  double worst = 0.0;
  for (const glm::dvec2 angles : sphere()) {
    const Camera camera = front.orbited(scene.domain().center(), angles.x, angles.y);
    worst = std::max(worst, turned3->dssimOf(camera, turned3->truth(camera)));
  }
  std::printf("%s%s_sphere\t%.5f\n", dssim.c_str(), three.c_str(), worst);
  std::fflush(stdout);
}

void measureNovel(const std::shared_ptr<gl::Device>& device, Marcher& marcher, const Scene& scene,
                  const BenchOptions& options) {
  const Functions functions(options, scene, IntervalPartition::uniform(scene.low, scene.high, 16));
  NovelTruth truths;
  for (const Setting setting : settings()) {
    measureNovel(device, marcher, scene, functions, setting, truths, options);
  }
}

}  // namespace
}  // namespace vestige::test

int main(int argc, char** argv) {
  using namespace vestige::test;
  return runBench("bench_sliced", argc, argv, [](const auto& options, const auto& device) {
    vestige::Marcher marcher(device);
    for (const char* name : kSweepScenes) {
      const std::string scene = std::string(name) + "_sliced";
      if (!options.wantsAny("edit_psnr_" + scene) &&
          !options.wantsAny("edit_bytes_percent_" + scene) &&
          !options.wantsAny("novel_view_dssim_" + scene)) {
        continue;
      }
      std::fprintf(stderr, "bench_sliced: %s\n", name);
      const Scene field = sweepScene(name);
      measureEdits(device, marcher, field, options);
      measureNovel(device, marcher, field, options);
    }
  });
}
