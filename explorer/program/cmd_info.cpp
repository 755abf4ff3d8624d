// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "explorer/inspect/info.h"
#include "explorer/picture/printable.h"
#include "explorer/program/cli.h"

namespace vestige::cli {
namespace {

struct Options {
  std::string archive;
  bool json = false, timings = false;
};

void run(const Options& options) {
  if (options.timings) {
    const nlohmann::json timings = timingsInfo(options.archive);
    fmt::print("{}", options.json ? timings.dump(2) + "\n" : printable(timingsText(timings)));
    return;
  }
  const nlohmann::json info = archiveInfo(Archive(options.archive));
  fmt::print("{}", options.json ? info.dump(2) + "\n" : printable(infoText(info)));
}

}  // namespace

void addInfo(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand("info", "Lists what an archive holds");
  auto options = std::make_shared<Options>();
  command->add_option("archive", options->archive, "Archive (NAME.cdb)")->required();
  command->add_flag("--json", options->json, "As JSON");
  command->add_flag("--timings", options->timings, "Times and memory of each step");
  command->callback([options] { run(*options); });
}

}  // namespace vestige::cli
