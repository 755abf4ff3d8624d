// SPDX-License-Identifier: BSD-3-Clause
// vestige-replay: a "simulation" whose time loop reads files.
#include <vtkDataSet.h>
#include <vtkImageData.h>
#include <vtkRectilinearGrid.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <optional>
#include <set>

#include "mini-sim/option_hints.h"
#include "mini-sim/options.h"
#include "mini-sim/replay/data_set_reader.h"
#include "mini-sim/replay/file_series.h"
#include "mini-sim/replay/recording.h"
#include "mini-sim/replay/session.h"
#include "mini-sim/terminal.h"
#include "proxy/version.h"

namespace {

using namespace minisim;

struct ReplayOptions {
  std::vector<std::filesystem::path> inputs;
  std::string config, output, array;
  std::optional<double> timeStep;
  std::optional<RawLayout> raw;
  int resample = 128;
  bool quiet = false;
};

constexpr char kFooter[] =
    "INPUT: files (.vti .vtr .vtk .mhd .mha .nrrd .nhdr .nii .nii.gz, or any with --shape), one\n"
    "time step each; a folder of them, taken in natural order; a folder of DICOM slices, one\n"
    "volume; or one folder that VESTIGE_RECORD made. Arrays of formats that do not name them are\n"
    "called \"scalars\".\n"
    "Exit codes: 0 every step was stored or not wanted, 1 some step was not, 2 bad usage,\n"
    "130 interrupted.";

std::optional<ReplayOptions> parse(int argc, char** argv, int& exitCode) {
  ReplayOptions o;
  RawLayout raw;
  std::vector<int> shape;
  std::vector<double> spacing;
  CLI::App app("Replays data sets, or a recorded run, through Vestige.", "vestige-replay");
  app.footer(kFooter);
  app.set_version_flag("--version", std::string("vestige-replay ") + vestige::kVersion);
  app.add_option("INPUT", o.inputs, "files or folders")->required();
  app.add_option("--config", o.config, "the adaptor's configuration (TOML)");
  app.add_option("--output", o.output, "the archive, instead of the configuration's");
  app.add_option("--array", o.array, "replay only this array");
  app.add_option("--time-step", o.timeStep,
                 "time between steps (default: the time a VTK file states, else 1)")
      ->check(CLI::PositiveNumber);
  app.add_option("--resample", o.resample,
                 "points along the longest side for data on other than image or rectilinear grids")
      ->check(CLI::Range(2, 2048))
      ->capture_default_str();
  auto* layout = app.add_option("--shape", shape, "NX,NY,NZ of raw files, x fastest")
                     ->delimiter(',')
                     ->expected(3)
                     ->check(CLI::PositiveNumber);
  app.add_option("--type", raw.type, "of raw files")
      ->check(CLI::IsMember(
          {"int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"}))
      ->capture_default_str()
      ->needs(layout);
  app.add_option("--spacing", spacing, "SX,SY,SZ of raw files (default 1,1,1)")
      ->delimiter(',')
      ->expected(3)
      ->check(CLI::PositiveNumber)
      ->needs(layout);
  app.add_option("--header", raw.header, "bytes to skip in raw files")->needs(layout);
  app.add_flag("--big-endian", raw.bigEndian, "raw files are big endian")->needs(layout);
  app.add_flag("--quiet", o.quiet, "no progress");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    exitCode = app.exit(error) == 0 ? kDone : kUsage;
    if (exitCode == kUsage) hintAtOptions(app, argc, argv);
    return std::nullopt;
  }
  for (std::size_t axis = 0; axis < shape.size(); ++axis) raw.shape[axis] = shape[axis];
  for (std::size_t axis = 0; axis < spacing.size(); ++axis) raw.spacing[axis] = spacing[axis];
  if (*layout) o.raw = raw;
  return o;
}

/// The time loop, whatever a step is: `replayStep(step)` returns the adaptor's code or throws.
template <typename ReplayStep>
int replaySteps(const ReplayOptions& options, Session& session, Progress& progress, long count,
                const ReplayStep& replayStep) {
  InterruptGuard guard;
  // What goes wrong in every step is said once.
  std::set<std::string> said;
  long silent = 0;
  const auto fail = [&](long step, const std::string& reason) {
    if (said.insert(reason).second)
      progress.say("step " + std::to_string(step) + ": " + reason);
    else
      ++silent;
  };
  for (long step = 0; step < count && !guard.interrupted(); ++step) {
    try {
      if (replayStep(step) != VESTIGE_OK) fail(step, session.lastError());
    } catch (const std::exception& error) {
      fail(step, error.what());
    }
    progress.show(step + 1, "");
  }
  if (silent > 0)
    progress.say(std::to_string(silent) + " more step" + (silent == 1 ? "" : "s") +
                 " failed likewise");
  if (!options.quiet)
    std::printf("%lld of %ld steps %s\n", static_cast<long long>(session.storedSteps()), count,
                session.dryRun() ? "would be stored (dry run)" : "stored");
  return guard.interrupted() ? kInterrupted : said.empty() ? kDone : kFailed;
}

int run(const ReplayOptions& options) {
  Session::Options open{options.config, "", options.output, {}};
  std::optional<Recording> recording;
  std::vector<std::filesystem::path> steps;
  if (options.inputs.size() == 1 && Recording::isOne(options.inputs[0])) {
    recording.emplace(options.inputs[0]);
    open.configText = recording->config();
    if (open.output.empty()) open.output = recording->output();
  } else {
    steps = stepsOf(options.inputs, options.raw.has_value());
  }
  const long count = recording ? recording->steps() : long(steps.size());
  Progress progress(count, "steps", options.quiet);
  open.warn = [&](const std::string& sentence) { progress.say("vestige: " + sentence); };

  Session session(open);
  if (session.code() != VESTIGE_OK) {
    progress.say("vestige: " + session.lastError());
    return kFailed;
  }
  if (recording)
    return replaySteps(options, session, progress, count,
                       [&](long step) { return recording->replay(step, session); });
  return replaySteps(options, session, progress, count, [&](long step) {
    const auto data = readDataSet(steps[std::size_t(step)], options.raw);
    const double time = options.timeStep ? double(step) * *options.timeStep
                                         : statedTime(data).value_or(double(step));
    if (!session.wants(step, time)) return session.code();
    try {
      if (!options.array.empty()) keepArray(data, options.array);
      if (!vtkImageData::SafeDownCast(data) && !vtkRectilinearGrid::SafeDownCast(data))
        progress.say("step " + std::to_string(step) + ": " + data->GetClassName() +
                     " is resampled, " + std::to_string(options.resample) +
                     " points along its longest side");
      session.dataSet(data, options.resample);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("'" + steps[std::size_t(step)].string() + "': " + error.what());
    }
    return session.execute(step, time);
  });
}

}  // namespace

int main(int argc, char** argv) {
  int exitCode = kDone;
  const auto options = parse(argc, argv, exitCode);
  if (!options) return exitCode;
  try {
    return run(*options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vestige-replay: %s\n", error.what());
    return kFailed;
  }
}
