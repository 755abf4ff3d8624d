// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <filesystem>

#include "explorer/cli.h"
#include "explorer/export.h"
#include "proxy/durable_file.h"
#include "proxy/error.h"

namespace vestige::cli {
namespace {

struct Options {
  std::string archive, output, format = "npy";
  ExportFilter filter;
  bool channels = false, statistics = false, histograms = false;
};

void writeText(const std::filesystem::path& path, const std::string& text) {
  writeDurably(path, std::as_bytes(std::span(text)));
  fmt::print("{}\n", path.string());
}

void run(const Options& options) {
  const Archive archive(options.archive);
  const std::vector<ArchiveRow> rows = rowsPassing(archive, options.filter);
  const std::filesystem::path folder(options.output);
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw Error(ErrorCode::Io, options.output + " cannot be created: " + error.message());
  }
  const bool all = !options.channels && !options.statistics && !options.histograms;
  if (all || options.statistics) {
    writeText(folder / "statistics.csv", statisticsCsv(archive, rows));
  }
  if (all || options.histograms) {
    writeText(folder / "histograms.csv", histogramsCsv(archive, rows));
  }
  if (!all && !options.channels) return;
  std::vector<std::filesystem::path> files;
  {
    ProgressBar bar("export");
    files = exportChannels(archive, rows, folder,
                           options.format == "csv" ? ChannelFormat::Csv : ChannelFormat::Npy,
                           [&](int done, int total) { bar.show(done, total); });
  }
  for (const std::filesystem::path& file : files) fmt::print("{}\n", file.string());
}

}  // namespace

void addExport(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand(
      "export", "Writes channels (NumPy or CSV), statistics and histograms (CSV)");
  auto options = std::make_shared<Options>();
  command->add_option("archive", options->archive, "Archive (NAME.cdb)")->required();
  command->add_option("-o,--output", options->output, "Folder, created where missing")->required();
  command->add_option("--format", options->format, "Of channels")
      ->check(CLI::IsMember({"npy", "csv"}))
      ->capture_default_str();
  command->add_option("--step", options->filter.cycles, "Only these cycles");
  command->add_option("--field", options->filter.field, "Only this field");
  command->add_option("--view", options->filter.view, "Only this view");
  command->add_option("--proxy", options->filter.proxy, "Only this proxy");
  command->add_flag("--channels", options->channels, "Channels (default: all three)");
  command->add_flag("--statistics", options->statistics, "Statistics of each field and step");
  command->add_flag("--histograms", options->histograms, "Histograms of each field and step");
  command->callback([options] { run(*options); });
}

}  // namespace vestige::cli
