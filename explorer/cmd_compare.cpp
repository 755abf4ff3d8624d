// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "explorer/cli.h"
#include "explorer/metrics.h"
#include "explorer/picture.h"
#include "explorer/renderer.h"
#include "proxy/error.h"

namespace vestige::cli {
namespace {

struct Options {
  std::string a, b;
  bool json = false;
  std::unique_ptr<LookOptions> look;
};

struct Measures {
  double psnr, ssim, dssim;
};

Measures measure(const Picture& a, const Picture& b) {
  if (a.size != b.size) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("the pictures have {} x {} and {} x {} pixels", a.size.width,
                            a.size.height, b.size.width, b.size.height));
  }
  // Over black, as method §7 wants it: premultiplied colours are just that.
  const RgbView left = RgbView::interleaved(a.size, a.rgba, 4);
  const RgbView right = RgbView::interleaved(b.size, b.rgba, 4);
  const double similarity = ssim(left, right);
  return {psnr(left, right), similarity, 0.5 * (1.0 - similarity)};
}

nlohmann::json jsonOf(const Measures& m) {
  return {{"psnr", std::isinf(m.psnr) ? nlohmann::json("inf") : nlohmann::json(m.psnr)},
          {"ssim", m.ssim},
          {"dssim", m.dssim}};
}

std::string textOf(const Measures& m) {
  return fmt::format("PSNR {:.2f} dB  SSIM {:.5f}  DSSIM {:.5f}", m.psnr, m.ssim, m.dssim);
}

void compareArchives(const Options& options) {
  const auto first = std::make_shared<const Archive>(options.a);
  const auto second = std::make_shared<const Archive>(options.b);
  const auto device = gl::Device::create(options.look->backend());
  Renderer left(device, first), right(device, second);
  const Look start = options.look->look();
  std::vector<long> cycles = first->cycles();
  if (start.cycle || start.time) cycles = {cycleOf(start, *first)};
  const std::vector<std::string> fields =
      start.field.empty() ? first->fields() : std::vector{start.field};
  const std::vector<std::string> views =
      start.view.empty() ? first->views() : std::vector{start.view};
  nlohmann::json lines = nlohmann::json::array();
  for (long cycle : cycles) {
    for (const std::string& field : fields) {
      for (const std::string& view : views) {
        Look look = start;
        look.time.reset();
        look.cycle = cycle;
        look.field = field;
        look.view = view;
        const Measures m = measure(left.render(look).picture, right.render(look).picture);
        if (options.json) {
          nlohmann::json line = jsonOf(m);
          line["cycle"] = cycle;
          line["field"] = field;
          line["view"] = view;
          lines.push_back(std::move(line));
        } else {
          fmt::print("cycle {}  {}  {}  {}\n", cycle, field, view, textOf(m));
        }
      }
    }
  }
  if (options.json) fmt::print("{}\n", lines.dump(2));
}

void run(const Options& options) {
  if (std::filesystem::is_directory(options.a) && std::filesystem::is_directory(options.b)) {
    compareArchives(options);
    return;
  }
  const Picture a = readPicture(options.a), b = readPicture(options.b);
  const Measures m = measure(a, b);
  fmt::print("{}\n", options.json ? jsonOf(m).dump(2) : textOf(m));
}

}  // namespace

void addCompare(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand(
      "compare", "Compares two pictures, or the same look of two archives (PSNR, SSIM, DSSIM)");
  auto options = std::make_shared<Options>();
  command->add_option("a", options->a, "Picture (.png, .exr) or archive")->required();
  command->add_option("b", options->b, "The other one")->required();
  command->add_flag("--json", options->json, "As JSON");
  options->look = std::make_unique<LookOptions>(*command);
  command->callback([options] { run(*options); });
}

}  // namespace vestige::cli
