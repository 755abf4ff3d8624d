// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <chrono>
#include <filesystem>

#include "explorer/picture/metrics.h"
#include "explorer/picture/picture.h"
#include "explorer/picture/printable.h"
#include "explorer/program/cli.h"
#include "explorer/renderer/renderer.h"
#include "explorer/renderer/view_effects.h"
#include "proxy/base/error.h"

namespace vestige::cli {
namespace {

struct Options {
  std::string archive, output;
  bool verbose = false;
  ViewEffects effects;
  std::string shutter;
  std::unique_ptr<LookOptions> look;
  CLI::App* command = nullptr;
};

void run(const Options& options) {
  const Look look = options.look->look();
  ViewEffects effects = options.effects;
  if (!options.shutter.empty()) {
    std::vector<double> angles = numbersFromText("--shutter", options.shutter, 2, 3);
    angles.resize(3, 0.0);
    effects.shutter = {angles[0], angles[1], angles[2]};
  }
  effects.validate();
  if (options.command->count("--samples") > 0 && options.effects.aperture == 0.0 &&
      options.shutter.empty()) {
    printWarnings({{"samples", "--samples has no effect without --aperture or --shutter"}});
  }
  const std::string extension = std::filesystem::path(options.output).extension().string();
  if (extension != ".png" && extension != ".exr") {
    throw Error(ErrorCode::InvalidArgument,
                "--output '" + options.output + "' must end in .png or .exr");
  }
  const auto start = std::chrono::steady_clock::now();
  const auto archive = std::make_shared<const Archive>(options.archive);
  Renderer renderer(gl::Device::create(options.look->backend()), archive);
  const Rendered rendered = renderWithEffects(renderer, look, effects);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  writePicture(options.output, rendered.picture);
  printWarnings(rendered.warnings);
  if (!options.verbose) return;
  for (const std::string& note : rendered.notes) fmt::print("{}\n", printable(note));
  if (const auto own = renderer.ownLook(look)) {
    const RgbView stored = RgbView::interleaved(own->stored.size, own->stored.rgba, 4);
    const RgbView made = RgbView::interleaved(own->made.size, own->made.rgba, 4);
    fmt::print(
        "the stack of view '{}' makes the run's own picture to PSNR {:.2f} dB, DSSIM {:.5f}\n",
        own->view, psnr(stored, made), dssim(stored, made));
  }
  if (look.trust) {
    fmt::print("trust: {:.1f} % data, {:.1f} % interpolation, {:.1f} % guess\n",
               100.0 * rendered.shares.data, 100.0 * rendered.shares.interpolation,
               100.0 * rendered.shares.guess);
  }
  fmt::print("{}: {} x {} in {:.2f} s\n", options.output, rendered.picture.size.width,
             rendered.picture.size.height, seconds.count());
}

}  // namespace

void addRender(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand("render", "Renders a picture of an archive");
  auto options = std::make_shared<Options>();
  command->add_option("archive", options->archive, "Archive (NAME.cdb)")->required();
  command->add_option("-o,--output", options->output, "Picture, .png or .exr")->required();
  command->add_flag("-v,--verbose", options->verbose, "Say which proxy answered and why");
  command->add_option("--stereo", options->effects.stereo,
                      "Two eyes side by side, so many degrees apart");
  command->add_option("--aperture", options->effects.aperture,
                      "Depth of field: a lens of so many degrees, focused on the centre");
  command->add_option("--shutter", options->shutter,
                      "Motion blur of a turn by AZ,EL[,ROLL] degrees");
  command->add_option("--samples", options->effects.samples, "Views of a lens or a shutter")
      ->capture_default_str();
  options->command = command;
  options->look = std::make_unique<LookOptions>(*command);
  command->callback([options] { run(*options); });
}

}  // namespace vestige::cli
