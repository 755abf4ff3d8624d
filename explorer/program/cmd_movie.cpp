// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <optional>

#include "explorer/export/movie.h"
#include "explorer/program/cli.h"
#include "proxy/base/error.h"

namespace vestige::cli {
namespace {

struct Options {
  std::string archive, output;
  double turn = 0.0;
  std::optional<double> framesPerSecond;
  int frames = 72;
  bool plain = false;
  std::unique_ptr<LookOptions> look;
  CLI::App* command = nullptr;
};

void run(const Options& options) {
  Look look = options.look->look();
  const bool turn = options.command->count("--turn") > 0;
  for (const char* option : {"--step", "--time"}) {
    if (!turn && options.command->count(option) > 0) {
      throw Error(
          ErrorCode::InvalidArgument,
          std::string(option) + " picks the step of a --turn; over time all steps are shown");
    }
  }
  if (!options.plain) look.annotations = {true, true, true, true};
  const auto archive = std::make_shared<const Archive>(options.archive);
  Renderer renderer(gl::Device::create(options.look->backend()), archive);
  const std::vector<Look> looks =
      turn ? looksOfTurn(look, options.turn, options.frames)
           : looksOverTime(lookForAllSteps(renderer, look, *archive), *archive);
  const double rate = options.framesPerSecond.value_or(turn ? 24.0 : 10.0);
  std::vector<Warning> warnings;
  {
    ProgressBar bar("movie");
    warnings = writeMovie(options.output, renderer, looks, rate,
                          [&](int done, int total) { bar.show(done, total); });
  }
  printWarnings(warnings);
  fmt::print("{}: {} frames at {:g} a second\n", options.output, looks.size(), rate);
}

}  // namespace

void addMovie(CLI::App& app, int&) {
  CLI::App* command =
      app.add_subcommand("movie", "Makes a movie over the stored steps or a turn of the camera");
  auto options = std::make_shared<Options>();
  options->command = command;
  command->add_option("archive", options->archive, "Archive (NAME.cdb)")->required();
  command->add_option("-o,--output", options->output, "Movie; .mp4 or what ffmpeg knows")
      ->required();
  auto* turn = command->add_option("--turn", options->turn,
                                   "Swing the camera over so many degrees; 360 = round");
  command->add_option("--frames", options->frames, "Frames of a turn")
      ->capture_default_str()
      ->needs(turn);
  command->add_option("--fps", options->framesPerSecond,
                      "Frames a second (default: 10 over time, 24 for a turn)");
  command->add_flag("--plain", options->plain,
                    "Only the annotations that the look asks for (default: all)");
  options->look = std::make_unique<LookOptions>(*command);
  command->callback([options] { run(*options); });
}

}  // namespace vestige::cli
