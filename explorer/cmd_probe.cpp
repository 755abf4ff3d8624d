// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "explorer/cli.h"
#include "explorer/probe.h"
#include "explorer/renderer.h"
#include "explorer/stack_source.h"
#include "proxy/error.h"

namespace vestige::cli {
namespace {

struct Options {
  std::string archive, view, field, pixel;
  long cycle = -1;
  double depth = 0.0;
  bool hasDepth = false, json = false;
};

void run(const Options& options) {
  const auto pixel = numbersFromText("--pixel", options.pixel, 2, 2);
  const Archive archive(options.archive);
  Look look;
  if (options.cycle >= 0) look.cycle = options.cycle;
  const long cycle = cycleOf(look, archive);
  const std::string field = options.field.empty() ? archive.fields().front() : options.field;
  const auto views = StackSource::viewsOf(archive, cycle, field);
  if (views.empty()) {
    throw Error(ErrorCode::NotFound, fmt::format("cycle {} has no sliced proxy of '{}'; probe "
                                                 "reads stacks",
                                                 cycle, field));
  }
  const std::string view = options.view.empty() ? views.front() : options.view;
  const ArchiveRow* row = archive.find(cycle, view, field, kind::kSliced);
  if (row == nullptr) {
    throw Error(ErrorCode::NotFound,
                fmt::format("view '{}' has no stack; there are: {}", view, fmt::join(views, ", ")));
  }
  for (const double at : pixel) {
    if (at != std::floor(at) || std::abs(at) > 1e6) {
      throw Error(ErrorCode::Config,
                  fmt::format("--pixel '{}' does not name a pixel", options.pixel));
    }
  }
  const SlicedStack stack = readStack(archive.open(*row));
  // Of the picture that `render` makes, whose pixels are square.
  const ImageSize stored = stack.header.size;
  const ImageSize shown = squarePixels(stored, stack.header.camera.pixelAspect);
  const auto cells = probe(stack, int(std::floor(pixel[0] * stored.width / shown.width)),
                           int(std::floor(pixel[1] * stored.height / shown.height)),
                           options.hasDepth ? std::optional(options.depth) : std::nullopt);
  fmt::print("{}", options.json ? toJson(cells).dump(2) + "\n" : probeText(cells));
}

}  // namespace

void addProbe(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand(
      "probe", "The distribution of values along a pixel's ray, slab by slab, from a stack");
  auto options = std::make_shared<Options>();
  command->add_option("archive", options->archive, "Archive (NAME.cdb)")->required();
  command
      ->add_option("--pixel", options->pixel,
                   "X,Y of the view's picture, as render makes it, from its top left")
      ->required();
  CLI::Option* depth = command->add_option(
      "--depth", options->depth, "Planar depth in world units: only the slab that holds it");
  command->add_option("--view", options->view, "A view with a stack; default: the first");
  command->add_option("--field", options->field, "Default: the first");
  command->add_option("--step", options->cycle, "Default: the last")->check(CLI::NonNegativeNumber);
  command->add_flag("--json", options->json, "As JSON");
  command->callback([options, depth] {
    options->hasDepth = depth->count() > 0;
    run(*options);
  });
}

}  // namespace vestige::cli
