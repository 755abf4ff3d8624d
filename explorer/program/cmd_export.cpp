// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "explorer/export/export.h"
#include "explorer/program/cli.h"
#include "proxy/base/durable_file.h"
#include "proxy/base/error.h"

namespace vestige::cli {
namespace {

struct Options {
  std::string archive, output, format = "npy";
  ExportFilter filter;
  bool channels = false, statistics = false, histograms = false;
};

std::uintmax_t bytesOf(const std::filesystem::path& folder, const nlohmann::json& files) {
  std::uintmax_t bytes = 0;
  for (const auto& entry : files) {
    std::error_code ignored;
    bytes += std::filesystem::file_size(folder / entry["file"].get<std::string>(), ignored);
  }
  return bytes;
}

void run(const Options& options) {
  const Archive archive(options.archive);
  const std::vector<ArchiveRow> rows = rowsPassing(archive, options.filter);
  const ExportFolder folder(options.output);
  nlohmann::json files = nlohmann::json::array();
  const auto table = [&](const char* name, const std::string& text, const char* meaning) {
    writeDurably(folder.file(name), std::as_bytes(std::span(text)));
    files.push_back(tableEntry(name, text, meaning));
  };
  const bool all = !options.channels && !options.statistics && !options.histograms;
  if (all || options.statistics) {
    table("statistics.csv", statisticsCsv(archive, rows), "statistics of each field and step");
  }
  if (all || options.histograms) {
    table("histograms.csv", histogramsCsv(archive, rows), "samples in equal bins of values");
  }
  if (all || options.channels) {
    ProgressBar bar("export");
    const ChannelFormat format = options.format == "csv" ? ChannelFormat::Csv : ChannelFormat::Npy;
    for (auto& entry : exportChannels(archive, rows, folder, format,
                                      [&](int done, int total) { bar.show(done, total); }))
      files.push_back(std::move(entry));
  }
  const std::string manifest = manifestText(archive, files);
  writeDurably(folder.file("manifest.json"), std::as_bytes(std::span(manifest)));
  fmt::print("{}: {} file{} of numbers, {:.3g} MB; what they hold: {}\n", options.output,
             files.size(), files.size() == 1 ? "" : "s",
             1e-6 * double(bytesOf(folder.path(), files)),
             (folder.path() / "manifest.json").string());
}

}  // namespace

void addExport(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand(
      "export",
      "Writes numbers in field and world units: fields, lengths, depths ... (NumPy or CSV), "
      "statistics and histograms (CSV), and a manifest.json that says what they are");
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
