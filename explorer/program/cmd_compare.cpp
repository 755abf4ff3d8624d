// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "explorer/picture/metrics.h"
#include "explorer/picture/picture.h"
#include "explorer/program/cli.h"
#include "explorer/renderer/renderer.h"
#include "proxy/base/error.h"
#include "proxy/format/layout/field_layout.h"

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
  // Over black, as method §10 wants it: premultiplied colours are just that.
  const RgbView left = RgbView::interleaved(a.size, a.rgba, 4);
  const RgbView right = RgbView::interleaved(b.size, b.rgba, 4);
  const double similarity = ssim(left, right);
  return {psnr(left, right), similarity, 0.5 * (1.0 - similarity)};
}

nlohmann::json jsonOf(const Measures& m) {
  // JSON has no infinity: equal pictures have none.
  return {{"psnr", std::isfinite(m.psnr) ? nlohmann::json(m.psnr) : nlohmann::json()},
          {"ssim", m.ssim},
          {"dssim", m.dssim}};
}

std::string textOf(const Measures& m) {
  return fmt::format("PSNR {:.2f} dB  SSIM {:.5f}  DSSIM {:.5f}", m.psnr, m.ssim, m.dssim);
}

/// What is compared of two archives: the first's step, field and view.
struct Subject {
  long cycle;
  std::string field, view;
};

std::vector<std::string> together(std::vector<std::string> names,
                                  const std::vector<std::string>& others) {
  for (const std::string& name : others)
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  return names;
}

std::vector<Subject> subjectsOf(const Look& look, const Archive& first, const Archive& second) {
  std::vector<long> cycles = first.cycles();
  if (look.cycle || look.time) cycles = {cycleOf(look, first)};
  const std::vector<std::string> fields =
      look.field.empty() ? together(first.fields(), second.fields()) : std::vector{look.field};
  const std::vector<std::string> views =
      look.view.empty() ? together(first.views(), second.views()) : std::vector{look.view};
  std::vector<Subject> subjects;
  for (const long cycle : cycles) {
    for (const std::string& field : fields) {
      for (const std::string& view : views) {
        if (view == kFieldView) continue;  // grids: they have no picture of their own
        const auto stores = [&](const Archive& archive) {
          return std::any_of(archive.rows().begin(), archive.rows().end(), [&](const auto& row) {
            return row.view == view && row.field == field;
          });
        };
        // A field that no archive has in a view is missing in neither.
        if (stores(first) || stores(second)) subjects.push_back({cycle, field, view});
      }
    }
  }
  return subjects;
}

/// The step of another archive that a step is compared with: of the same cycle, else of the same
/// time.
long counterpartOf(long cycle, const Archive& first, const Archive& second) {
  const std::vector<long> cycles = second.cycles();
  if (std::find(cycles.begin(), cycles.end(), cycle) != cycles.end()) return cycle;
  const double time = first.timeOf(cycle);
  for (const long other : cycles) {
    if (std::abs(second.timeOf(other) - time) <= 1e-9 * std::abs(time)) return other;
  }
  throw Error(ErrorCode::NotFound, fmt::format("archive {} has neither cycle {} nor time {:g}",
                                               second.directory().string(), cycle, time));
}

/// Draws the first archive's look of a subject from both. Throws NotFound where one lacks it.
class Comparison {
 public:
  Comparison(const std::shared_ptr<gl::Device>& device, std::shared_ptr<const Archive> first,
             std::shared_ptr<const Archive> second)
      : first_(std::move(first)),
        second_(std::move(second)),
        left_(device, first_),
        right_(device, second_) {}

  Measures of(const Subject& subject, Look look) {
    look.time.reset();
    look.cycle = subject.cycle;
    look.field = subject.field;
    look.view = subject.view;
    const long other = counterpartOf(subject.cycle, *first_, *second_);
    requireView(*first_, subject, subject.cycle);
    requireView(*second_, subject, other);
    look = left_.resolved(look);
    const Rendered left = left_.render(look);
    look.size = left.picture.size;
    look.cycle = other;
    const Rendered right = right_.render(look);
    warn(left.warnings);
    warn(right.warnings);
    return measure(left.picture, right.picture);
  }

  /// Throws NotFound naming what the first archive has instead of what the look names.
  void refuse(const Look& look) { left_.resolved(look); }

 private:
  static void requireView(const Archive& archive, const Subject& subject, long cycle) {
    for (const ArchiveRow& row : archive.rows()) {
      if (row.cycle == cycle && row.view == subject.view && row.field == subject.field) return;
    }
    throw Error(ErrorCode::NotFound,
                fmt::format("archive {} has nothing of field '{}' in view '{}' at cycle {}",
                            archive.directory().string(), subject.field, subject.view, cycle));
  }

  /// Each warning once.
  void warn(const std::vector<Warning>& warnings) {
    for (const Warning& warning : warnings) {
      if (std::find(warned_.begin(), warned_.end(), warning) != warned_.end()) continue;
      warned_.push_back(warning);
      printWarnings({warning});
    }
  }

  std::shared_ptr<const Archive> first_, second_;
  Renderer left_, right_;
  std::vector<Warning> warned_;
};

void compareArchives(const Options& options) {
  const auto first = std::make_shared<const Archive>(options.a);
  const auto second = std::make_shared<const Archive>(options.b);
  Comparison comparison(gl::Device::create(options.look->backend()), first, second);
  const Look look = options.look->look();
  const std::vector<Subject> subjects = subjectsOf(look, *first, *second);
  if (subjects.empty()) comparison.refuse(look);
  nlohmann::json lines = nlohmann::json::array();
  std::size_t compared = 0;
  std::string missing;
  for (const Subject& subject : subjects) {
    nlohmann::json line{{"psnr", nullptr}, {"ssim", nullptr}, {"dssim", nullptr}};
    try {
      const Measures m = comparison.of(subject, look);
      ++compared;
      line = jsonOf(m);
      if (!options.json) {
        fmt::print("cycle {}  {}  {}  {}\n", subject.cycle, subject.field, subject.view, textOf(m));
      }
    } catch (const Error& error) {
      if (error.code() != ErrorCode::NotFound) throw;
      missing = error.what();
      line["missing"] = missing;
      fmt::print(stderr, "skipped: cycle {}, field '{}', view '{}': {}\n", subject.cycle,
                 subject.field, subject.view, missing);
    }
    line["cycle"] = subject.cycle;
    line["field"] = subject.field;
    line["view"] = subject.view;
    lines.push_back(std::move(line));
  }
  if (options.json) fmt::print("{}\n", lines.dump(2));
  if (compared > 0) return;
  throw Error(ErrorCode::NotFound, "nothing of both archives could be compared" +
                                       (missing.empty() ? "" : ": " + missing));
}

void run(const Options& options) {
  for (const std::string& name : {options.a, options.b})
    if (!std::filesystem::exists(name))
      throw Error(ErrorCode::NotFound, fmt::format("'{}' does not exist", name));
  const bool archives[] = {std::filesystem::is_directory(options.a),
                           std::filesystem::is_directory(options.b)};
  if (archives[0] && archives[1]) {
    compareArchives(options);
    return;
  }
  if (archives[0] != archives[1]) {
    throw Error(
        ErrorCode::InvalidArgument,
        fmt::format("'{}' is a folder, '{}' is not: compare two archives or two pictures",
                    archives[0] ? options.a : options.b, archives[0] ? options.b : options.a));
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
