// SPDX-License-Identifier: BSD-3-Clause
// Our side of the speed figures, driven by speed.py. Reads commands from standard input and answers
// each with one line of figures separated by tabs; times are wall seconds.
// usage: bench_speed SCENE SIZE FOLDER      writes FOLDER/{scene.raw,512.json,1024.json}
//   execute      one step through the C API at 512^2: seconds before encoding, seconds of encoding
//                and writing
//   memory       greatest growth of this process's memory in a step, bytes of the field
//   bytes        bytes on disk of one step at 512^2 by proxy: attenuation, length, depth, mip,
//                reference
//   edit         an opacity edit at 1024^2 with proxies decoded
//   open         the same from a closed archive: opening, decoding, editing
//   edit-runs, open-runs
//                likewise in the reconstructed order of runs, as edit_psnr is measured
//   novel TIER PIXELS same|changed
//                a view turned by ten degrees from a tier, each time a little more, its data
//                decoded; with the look of the time before, or another
//   step TIER    a whole step of a tier at 512^2, written: seconds
//   grown TIER   greatest growth of this process's memory in steps of a tier (of a fresh process),
//                bytes of the field
// TIER is flat, sliced (one stack), sliced3 (three), layered (k = 4) or field.
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <glm/trigonometric.hpp>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "adaptor/include/vestige.h"
#include "explorer/renderer/renderer.h"
#include "tests/bench/vtk_scene.h"
#include "tests/support/random_transfer_function.h"
#include "tests/support/scenes.h"

namespace vestige::test {
namespace {

namespace fs = std::filesystem;

constexpr double kTurnDegrees = 10.0;  ///< of novel views

double secondsOf(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// A value in kB from /proc/self/status.
std::uint64_t statusBytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(key)) return std::stoull(line.substr(key.size() + 1)) * 1024;
  }
  return 0;
}

/// The points of the base transfer function; opacity per reference length, in the field's units.
std::vector<OpacityPoint> basePoints(const Scene& scene) {
  const double range = scene.high - scene.low;
  return {{scene.low + 0.25 * range, 0.0}, {scene.high, 0.3}};
}

constexpr const char* kEdited = "'attenuation', 'length', 'depth'";
constexpr const char* kFlat = "'attenuation', 'length', 'depth', 'mip', 'reference'";

struct Tier {
  const char* proxies;
  const char* tables = "";  ///< of the configuration
  Source source = Source::Auto;
};

Tier tierOf(const std::string& name) {
  if (name == "flat") return {kFlat};
  if (name == "sliced") return {"'sliced'", "[sliced]\nstacks = 'front'\n", Source::Sliced};
  if (name == "sliced3") return {"'sliced'", "", Source::Sliced};
  if (name == "layered") return {"'layered'", "", Source::Layered};
  if (name == "field") return {"'field'", "", Source::Field};
  throw std::runtime_error("unknown tier '" + name + "'");
}

/// A run through the C API that keeps one view of the scene.
class Run {
 public:
  Run(const Scene& scene, int pixels, const fs::path& archive, const Tier& tier)
      : scene_(scene), archive_(archive) {
    fs::remove_all(archive);
    std::string points;
    for (const OpacityPoint& point : basePoints(scene)) {
      points += fmt::format("[{}, {}], ", point.value, point.opacity);
    }
    const double step = (scene.high - scene.low) / 5;
    config_ = fmt::format(
        "[output]\npath = '{}'\nexisting = 'overwrite'\n[trigger]\nevery_cycles = 1\n"
        "[image]\nwidth = {}\nheight = {}\nproxies = [{}]\n[[view]]\nset = 'front'\n"
        "[[field]]\nsource = 'field'\nrange = [{}, {}]\nintervals = 16\nopacity = [{}]\n"
        "isovalues = [{}, {}, {}, {}]\n{}",
        archive.string(), pixels, pixels, tier.proxies, scene.low, scene.high, points,
        scene.low + step, scene.low + 2 * step, scene.low + 3 * step, scene.low + 4 * step,
        tier.tables);
    vestige_options options = VESTIGE_OPTIONS_INIT;
    options.config_text = config_.c_str();
    check(vestige_open(&options, &session_));
  }
  ~Run() { vestige_close(session_); }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  void execute() {
    vestige_grid grid = VESTIGE_GRID_INIT;
    for (int a = 0; a < 3; ++a) {
      grid.points[a] = scene_.size[std::size_t(a)];
      grid.origin[a] = scene_.origin[a];
      grid.spacing[a] = scene_.spacing[a];
    }
    check(vestige_block(session_, 0, &grid));
    check(vestige_share_field(session_, 0, "field", VESTIGE_FLOAT32, VESTIGE_POINT, 1,
                              scene_.values.data(), nullptr));
    ++cycle_;
    check(vestige_execute(session_, cycle_, double(cycle_)));
  }

  /// The last line of timings.csv.
  std::vector<double> timings() const {
    std::ifstream file(archive_ / "timings.csv");
    std::string line, last;
    while (std::getline(file, line)) last = line;
    std::vector<double> values;
    std::istringstream cells(last);
    for (std::string cell; std::getline(cells, cell, ',');) values.push_back(std::stod(cell));
    if (values.size() != 10) throw std::runtime_error("timings.csv has another form: " + last);
    return values;
  }

 private:
  void check(int code) const {
    if (code != VESTIGE_OK) throw std::runtime_error(vestige_last_error(session_));
  }
  const Scene& scene_;
  fs::path archive_;
  std::string config_;
  vestige_session* session_ = nullptr;
  std::int64_t cycle_ = 0;
};

/// What vtk_side.py is to draw, seen by the camera that the archive has.
void writeScene(const Scene& scene, const Camera& camera, int pixels, const fs::path& path) {
  const Colormap map = Colormap::named("viridis");
  nlohmann::json json = vtkScene(scene, path.parent_path() / "scene.raw", camera, pixels,
                                 basePoints(scene), scene.domain().diagonal() / 100);
  for (int i = 0; i <= 16; ++i) {
    const glm::dvec3 c = map.at(i / 16.0);
    json["colors"].push_back({scene.low + (scene.high - scene.low) * i / 16.0, c.r, c.g, c.b});
  }
  std::ofstream(path) << json;
}

std::uint64_t bytesOf(const Archive& archive, std::string_view proxy) {
  const long cycle = archive.cycles().back();
  std::uint64_t bytes = 0;
  for (const ArchiveRow& row : archive.rows()) {
    if (row.cycle != cycle || row.proxy != proxy) continue;
    bytes += fs::file_size(archive.directory() / row.exr);
    if (!row.png.empty()) bytes += fs::file_size(archive.directory() / row.png);
  }
  return bytes;
}

Look editedLook(int number, const Scene& scene, bool runs) {
  Look look;
  if (runs) look.order = Order::Runs;
  std::vector<OpacityPoint> points = basePoints(scene);
  points.back().opacity = 0.1 + 0.01 * (number % 10);
  look.opacity = points;
  return look;
}

void serve(const Scene& scene, const fs::path& folder) {
  std::ofstream raw(folder / "scene.raw", std::ios::binary);
  raw.write(reinterpret_cast<const char*>(scene.values.data()),
            std::streamsize(scene.values.size() * sizeof(float)));
  raw.close();
  const Camera camera = frameBox(scene.domain(), {0, 1, 0}, {0, 0, 1}, 1.0);
  const Camera turned = camera.orbited(scene.domain().center(), glm::radians(kTurnDegrees), 0.0);
  for (int pixels : {512, 1024}) {
    const std::string name = std::to_string(pixels);
    writeScene(scene, camera, pixels, folder / (name + ".json"));
    writeScene(scene, turned, pixels, folder / (name + "-turned.json"));
  }

  std::unique_ptr<Run> small;
  std::shared_ptr<gl::Device> device;
  std::unique_ptr<Renderer> renderer;
  std::uint64_t before = 0;
  const auto step = [&]() -> Run& {
    if (!small) {
      before = statusBytes("VmRSS:");
      small = std::make_unique<Run>(scene, 512, folder / "512.cdb", Tier{kEdited});
      small->execute();  // compiles programs; no figure includes it
    }
    small->execute();
    return *small;
  };
  const auto large = [&] {
    if (device) return;
    Run(scene, 1024, folder / "1024.cdb", Tier{kEdited}).execute();
    device = gl::Device::create("auto");
  };
  const auto open = [&] {
    renderer =
        std::make_unique<Renderer>(device, std::make_shared<const Archive>(folder / "1024.cdb"));
  };
  std::unique_ptr<Renderer> novel;  ///< of novelTier at novelPixels squared
  std::string novelTier;
  int novelPixels = 0;
  std::map<std::string, std::unique_ptr<Run>> tiers;
  int edits = 0;
  bool inRuns = false;  ///< what the renderer was last asked for
  std::puts("ready");
  std::fflush(stdout);
  for (std::string command; std::getline(std::cin, command);) {
    if (command == "execute") {
      const auto t = step().timings();
      fmt::print("{}\t{}\n", t[2] + t[3] + t[4] + t[5], t[6] + t[7]);
    } else if (command == "memory") {
      step();
      fmt::print("{}\t{}\n", statusBytes("VmHWM:") - before, scene.values.size() * 4);
    } else if (command == "bytes") {
      { Run(scene, 512, folder / "bytes.cdb", Tier{kFlat}).execute(); }
      const Archive archive(folder / "bytes.cdb");
      std::string line;
      for (auto proxy :
           {kind::kAttenuation, kind::kLength, kind::kDepth, kind::kMip, kind::kReference}) {
        line += fmt::format("{}\t", bytesOf(archive, proxy));
      }
      fmt::print("{}{}\n", line, scene.values.size() * 4);
    } else if (command == "edit" || command == "edit-runs") {
      large();
      const bool runs = command == "edit-runs";
      if (!renderer || runs != inRuns) {
        open();
        renderer->render(editedLook(0, scene, runs));
      }
      inRuns = runs;
      const Look look = editedLook(++edits, scene, runs);
      fmt::print("{}\n", secondsOf([&] { renderer->render(look); }));
    } else if (command.starts_with("novel ")) {
      // A little more of a turn each time, so that nothing could be kept.
      std::istringstream words(command.substr(6));
      std::string name, how;
      int pixels = 0;
      words >> name >> pixels >> how;
      const Tier tier = tierOf(name);
      Look look = how == "changed" ? editedLook(++edits, scene, false) : Look();
      look.source = tier.source;
      look.rotate.azimuth = kTurnDegrees + 0.01 * ++edits;
      if (!novel || novelTier != name || novelPixels != pixels) {
        const fs::path archive = folder / "turned.cdb";
        novel.reset();
        Run(scene, pixels, archive, tier).execute();
        if (!device) device = gl::Device::create("auto");
        novel = std::make_unique<Renderer>(device, std::make_shared<const Archive>(archive));
        novelTier = name;
        novelPixels = pixels;
      }
      look.size = ImageSize{pixels, pixels};
      fmt::print("{}\n", secondsOf([&] { novel->render(look); }));
    } else if (command.starts_with("step ") || command.starts_with("grown ")) {
      const bool memory = command.starts_with("grown ");
      const std::string name = command.substr(command.find(' ') + 1);
      if (memory) before = statusBytes("VmRSS:");
      auto& run = tiers[name];
      if (!run) {
        run = std::make_unique<Run>(scene, 512, folder / (name + "-step.cdb"), tierOf(name));
        run->execute();  // compiles programs; no figure includes it
      }
      const double seconds = secondsOf([&] { run->execute(); });
      if (memory) {
        fmt::print("{}\t{}\n", statusBytes("VmHWM:") - before, scene.values.size() * 4);
      } else {
        fmt::print("{}\n", seconds);
      }
    } else if (command == "open" || command == "open-runs") {
      large();
      renderer.reset();
      inRuns = command == "open-runs";
      const Look look = editedLook(++edits, scene, inRuns);
      fmt::print("{}\n", secondsOf([&] {
                   open();
                   renderer->render(look);
                 }));
    } else {
      throw std::runtime_error("unknown command '" + command + "'");
    }
    std::fflush(stdout);
  }
}

/// The plume of 128^3 at 256^3: a run of that size long enough to develop takes an hour.
Scene doubled(const Scene& coarse) {
  Scene fine = coarse;
  for (int a = 0; a < 3; ++a) {
    fine.size[std::size_t(a)] = 2 * coarse.size[std::size_t(a)];
    fine.spacing[a] = 0.5 * coarse.spacing[a];
    fine.origin[a] = coarse.origin[a] - 0.25 * coarse.spacing[a];
  }
  fine.values.clear();
  for (int z = 0; z < fine.size[2]; ++z) {
    for (int y = 0; y < fine.size[1]; ++y) {
      for (int x = 0; x < fine.size[0]; ++x) {
        fine.values.push_back(
            float(coarse.sample(fine.origin + fine.spacing * glm::dvec3(x, y, z))));
      }
    }
  }
  return fine;
}

}  // namespace
}  // namespace vestige::test

int main(int argc, char** argv) {
  using namespace vestige::test;
  try {
    if (argc != 4) throw std::runtime_error("usage: bench_speed SCENE SIZE FOLDER");
    const std::string name = argv[1];
    const int size = std::stoi(argv[2]);
    std::filesystem::create_directories(argv[3]);
    const Scene scene = name == "plume" ? doubled(namedScene("plume", size / 2, sceneCache()))
                                        : namedScene(name, size, sceneCache());
    serve(scene, argv[3]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_speed: %s\n", error.what());
    return 1;
  }
  return 0;
}
