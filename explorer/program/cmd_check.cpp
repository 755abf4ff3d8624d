// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <filesystem>

#include "explorer/picture/printable.h"
#include "explorer/program/cli.h"
#include "proxy/archive/archive.h"
#include "proxy/base/error.h"
#include "proxy/base/launch.h"
#include "proxy/format/exr/exr_file.h"

namespace vestige::cli {
namespace {

struct Options {
  std::string archive;
  bool repair = false;
};

/// An archive is sound and yet a part: of one process that wrote without the others.
void sayWhetherAlone(const Archive& archive) {
  if (archive.rows().empty()) return;
  const auto launch = launchIn(archive.open(archive.rows().back()).header().provenance);
  if (!launch) return;
  fmt::print(
      "{}: written by process {} of {} without a communicator: what other processes held of "
      "the domain is not in it\n",
      archive.directory().string(), launch->rank < 0 ? "?" : std::to_string(launch->rank),
      launch->processes > 0 ? std::to_string(launch->processes) : "several");
}

int run(const Options& options) {
  setExrThreads(0);  // a thread a file: those that OpenEXR would wake for each stand in their way
  if (options.repair) {
    std::vector<Finding> leftOut;
    {
      ProgressBar bar("repair");
      leftOut = repairArchive(options.archive, [&](int done, int total) { bar.show(done, total); });
    }
    for (const Finding& finding : leftOut) {
      fmt::print("left out: {}\n", printable(finding.file + ": " + finding.problem));
    }
  }
  if (!std::filesystem::is_directory(options.archive)) {
    throw Error(ErrorCode::NotFound, "'" + options.archive + "' is no folder");
  }
  std::vector<Finding> findings;
  {
    ProgressBar bar("check");
    findings = checkArchive(options.archive, [&](int done, int total) { bar.show(done, total); });
  }
  std::size_t damage = 0;
  for (const Finding& finding : findings) {
    fmt::print("{}{}\n", finding.leftover ? "leftover: " : "",
               printable(finding.file + ": " + finding.problem));
    if (!finding.leftover) ++damage;
  }
  if (damage > 0) {
    fmt::print("{}: {} problem{}{}\n", options.archive, damage, damage == 1 ? "" : "s",
               options.repair ? "" : "; --repair rebuilds the table from the sound files");
    return 1;
  }
  // Leftovers of an interrupted run are no damage: every reader ignores them.
  const Archive archive(options.archive);
  fmt::print("{}: {} rows, all sound{}\n", options.archive, archive.rows().size(),
             findings.empty() ? "" : "; leftovers of interrupted runs are read by nobody");
  sayWhetherAlone(archive);
  return 0;
}

}  // namespace

void addCheck(CLI::App& app, int& exitCode) {
  CLI::App* command = app.add_subcommand("check", "Verifies every file of an archive");
  auto options = std::make_shared<Options>();
  command->add_option("archive", options->archive, "Archive (NAME.cdb)")->required();
  command->add_flag("--repair", options->repair, "Rebuild the table from the files that decode");
  command->callback([options, &exitCode] { exitCode = run(*options); });
}

}  // namespace vestige::cli
