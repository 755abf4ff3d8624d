// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "explorer/inspect/probe_pixel.h"
#include "explorer/picture/printable.h"
#include "explorer/program/cli.h"
#include "explorer/renderer/renderer.h"
#include "proxy/base/error.h"

namespace vestige::cli {
namespace {

struct Options {
  std::string archive, pixel;
  double depth = 0.0;
  bool hasDepth = false, json = false;
  std::unique_ptr<LookOptions> look;
};

void run(const Options& options) {
  const auto pixel = numbersFromText("--pixel", options.pixel, 2, 2);
  for (const double at : pixel) {
    if (at != std::floor(at) || std::abs(at) > 1e6) {
      throw Error(ErrorCode::Config,
                  fmt::format("--pixel '{}' does not name a pixel", options.pixel));
    }
  }
  const Look look = options.look->look();
  const auto archive = std::make_shared<const Archive>(options.archive);
  Renderer renderer(gl::Device::create(options.look->backend()), archive);
  const nlohmann::json probed =
      probePixel(*archive, look, renderer.render(look), int(pixel[0]), int(pixel[1]),
                 options.hasDepth ? std::optional(options.depth) : std::nullopt);
  fmt::print("{}", options.json ? probed.dump(2) + "\n" : printable(probeText(probed)));
}

}  // namespace

void addProbe(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand(
      "probe",
      "What a pixel of a picture shows: values along its ray, and what each proxy holds of it");
  auto options = std::make_shared<Options>();
  command->add_option("archive", options->archive, "Archive (NAME.cdb)")->required();
  command
      ->add_option(
          "--pixel", options->pixel,
          "X,Y from the top left of the picture that render makes of the same look options")
      ->required();
  CLI::Option* depth = command->add_option(
      "--depth", options->depth, "Planar depth in world units: only the value and the slab there");
  command->add_flag("--json", options->json, "As JSON");
  options->look = std::make_unique<LookOptions>(*command);
  command->callback([options, depth] {
    options->hasDepth = depth->count() > 0;
    run(*options);
  });
}

}  // namespace vestige::cli
