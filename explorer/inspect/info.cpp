// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/inspect/info.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "explorer/export/camera_info.h"
#include "explorer/inspect/custom_info.h"
#include "explorer/inspect/feature_info.h"
#include "explorer/inspect/header_reader.h"
#include "explorer/inspect/range_info.h"
#include "explorer/layers/radiality.h"
#include "explorer/renderer/learned_pass.h"
#include "explorer/renderer/stated_error.h"
#include "explorer/stacks/stack_source.h"
#include "proxy/base/error.h"
#include "proxy/format/layout/field_layout.h"

namespace vestige {
namespace {

using nlohmann::json;

struct Totals {
  std::uint64_t files = 0, bytes = 0;
};

std::uint64_t sizeOf(const std::filesystem::path& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  return error ? 0 : std::uint64_t(size);
}

json fieldInfo(const ProxyHeader& header) {
  json info{{"name", header.field},
            {"units", header.units},
            {"low", header.statistics.low},
            {"high", header.statistics.high}};
  if (header.partition) info["bounds"] = header.partition->bounds();
  if (header.base) info["base"] = toJson(*header.base);
  return info;
}

/// Which tiers of the last step answer edited looks of a field, truest first, and what they state.
json answersOf(HeaderReader& files, const std::string& field, bool turned) {
  const Archive& archive = files.archive();
  std::vector<std::pair<std::string, StatedError>> tiers;
  // In the order in which renderer_choice.cpp takes what states the same.
  for (const std::string_view proxy :
       {kind::kSliced, kind::kField, kind::kLength, kind::kAttenuation, kind::kLayered}) {
    for (const ArchiveRow& row : archive.rows()) {
      if (row.cycle != archive.cycles().back() || row.field != field || row.proxy != proxy)
        continue;
      const auto header = files.header(row);
      if (!header) continue;
      const bool recomposed = proxy != kind::kAttenuation || !header->customization;
      if (recomposed) tiers.emplace_back(proxy, statedError(*header, {turned, true}));
      break;
    }
  }
  std::stable_sort(tiers.begin(), tiers.end(),
                   [](const auto& a, const auto& b) { return a.second.truerThan(b.second); });
  json list = json::array();
  for (const auto& [name, error] : tiers) {
    list.push_back({{"proxy", name},
                    {"bounded", error.bounded},
                    {"value", error.value},
                    {"place", error.place},
                    {"text", error.text()}});
  }
  return list;
}

/// What made which cycles: stretches of equal provenance, as a budget changes its mind.
json provenancesOf(const Archive& archive) {
  json stretches = json::array();
  std::map<long, const ArchiveRow*> first;
  for (const ArchiveRow& row : archive.rows()) first.try_emplace(row.cycle, &row);
  for (const auto& [cycle, row] : first) {
    std::string text;
    try {
      text = archive.open(*row).header().provenance;
    } catch (const Error& error) {
      text = fmt::format("what cannot be read: {}", error.what());  // the others still can
    }
    if (stretches.empty() || stretches.back()["text"] != text) {
      stretches.push_back({{"first", cycle}, {"text", text}});
    }
    stretches.back()["last"] = cycle;
  }
  return stretches;
}

std::string provenanceText(const json& stretches) {
  constexpr std::size_t kShown = 8;
  std::string text;
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const json& stretch = stretches[i];
    if (stretch["text"].get<std::string>().empty()) continue;
    if (i == kShown / 2 && stretches.size() > kShown) {
      const std::size_t left = stretches.size() - kShown;
      text += fmt::format("  ... {} more changes\n", left);
      i += left - 1;
      continue;
    }
    const std::string cycles =
        stretches.size() == 1 ? ""
        : stretch["first"] == stretch["last"]
            ? fmt::format("cycle {} ", stretch["first"].dump())
            : fmt::format("cycles {} to {} ", stretch["first"].dump(), stretch["last"].dump());
    text += fmt::format("  {}made by {}\n", cycles, stretch["text"].get<std::string>());
  }
  return text;
}

std::string shortList(const json& list, std::size_t most) {
  std::string text;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (i == most - 1 && list.size() > most) {
      text += ", ...";
      i = list.size() - 1;
    }
    text += (text.empty() ? "" : ", ") +
            (list[i].is_string() ? list[i].get<std::string>() : list[i].dump());
  }
  return text;
}

std::string bytesText(double bytes) {
  const char* units[] = {"B", "kB", "MB", "GB", "TB"};
  int unit = 0;
  for (; bytes >= 1000.0 && unit < 4; ++unit) bytes /= 1000.0;
  return fmt::format(fmt::runtime(unit == 0 ? "{:.0f} {}" : "{:.1f} {}"), bytes, units[unit]);
}

json cellOf(const std::string& text) {
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error == std::errc() && end == text.data() + text.size() && !text.empty()) return number;
  return text;
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::stringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
  if (!line.empty() && line.back() == ',') cells.emplace_back();
  return cells;
}

std::string cellText(const json& cell) {
  if (!cell.is_number()) return cell.get<std::string>();
  const double value = cell.get<double>();
  return value == double(std::int64_t(value)) ? fmt::format("{}", std::int64_t(value))
                                              : fmt::format("{:.4g}", value);
}

/// Of the depth layers of the last step; of the first so many files only, as whole files are
/// decoded.
json radialityInfo(const Archive& archive) {
  constexpr std::size_t kMostFiles = 12;
  json list = json::array();
  for (const ArchiveRow& row : archive.rows()) {
    if (row.proxy != kind::kDepth || row.cycle != archive.cycles().back()) continue;
    if (list.size() == kMostFiles) break;
    json entry{{"view", row.view}, {"field", row.field}};
    try {
      const Radiality radiality = radialityOf(depthLayers(readImage(archive.open(row))));
      entry["countsPerTenDegrees"] = radiality.counts;
      entry["shareBeyond60"] = radiality.shareBeyond60();
    } catch (const Error& error) {  // the rest of the archive can still be listed
      entry["problem"] = error.what();
    }
    list.push_back(std::move(entry));
  }
  return list;
}

/// The tables of learned colours.
json learnedInfo(const Archive& archive) {
  json list = json::array();
  for (const ArchiveRow& row : archive.rows()) {
    if (row.proxy != kind::kLearned) continue;
    json entry{{"cycle", row.cycle}, {"view", row.view}, {"field", row.field}};
    try {
      const ProxyHeader header = archive.open(row).header();
      if (!header.learned) throw Error(ErrorCode::Format, "it does not say how it was made");
      entry["clusters"] = header.size.height;
      entry["pictures"] = header.looks.size();
      entry["shading"] = header.shading;
      entry["from"] = header.learned->from;
      entry["error"] = header.learned->error;
      entry["table"] = learnedNote(header);
    } catch (const Error& error) {
      entry["problem"] = error.what();
    }
    list.push_back(std::move(entry));
  }
  return list;
}

/// "12 30 25 ... %": a histogram's shares.
std::string sharesText(const json& counts) {
  double sum = 0.0;
  for (const json& count : counts) sum += count.get<double>();
  std::string text;
  for (const json& count : counts)
    text += fmt::format("{:.0f} ", sum > 0.0 ? 100.0 * count.get<double>() / sum : 0.0);
  return text + "%";
}

}  // namespace

json archiveInfo(const Archive& archive) {
  HeaderReader files(archive);
  json info;
  info["archive"] = archive.directory().string();
  info["cycles"] = archive.cycles();
  info["times"] = json::array();
  for (long cycle : archive.cycles()) info["times"].push_back(archive.timeOf(cycle));
  info["rows"] = archive.rows().size();
  std::map<std::string, Totals> totals;
  std::map<std::string, std::vector<const ArchiveRow*>> viewRows,
      fieldRows;  // the most telling first
  for (const ArchiveRow& row : archive.rows()) {
    Totals& total = totals[row.proxy];
    ++total.files;
    total.bytes += sizeOf(archive.directory() / row.exr);
    viewRows[row.view].push_back(&row);
  }
  // The latest row with intervals says most of a field.
  const auto hasIntervals = [](const ArchiveRow& row) {
    return row.proxy == kind::kLength || row.proxy == kind::kAttenuation ||
           row.proxy == kind::kSliced;
  };
  for (auto row = archive.rows().rbegin(); row != archive.rows().rend(); ++row)
    if (hasIntervals(*row)) fieldRows[row->field].push_back(&*row);
  for (const ArchiveRow& row : archive.rows())
    if (!hasIntervals(row)) fieldRows[row.field].push_back(&row);
  info["views"] = json::array();
  info["storedFields"] = json::array();
  for (const std::string& view : archive.views()) {
    if (viewRows.at(view).front()->proxy == kind::kField) continue;
    const auto header = files.firstOf(viewRows.at(view));
    if (!header) continue;
    info["views"].push_back({{"name", view},
                             {"size", {header->size.width, header->size.height}},
                             {"camera", cameraInfo(header->camera)}});
  }
  info["fields"] = json::array();
  for (const std::string& field : archive.fields()) {
    const auto header = files.firstOf(fieldRows.at(field));
    if (header && !header->features) info["fields"].push_back(fieldInfo(*header));
  }
  info["ranges"] = rangeInfo(files);
  info["features"] = featureInfo(files);
  info["customizations"] = customInfo(files);
  for (const std::string& field : archive.fields()) {
    const ArchiveRow* row =
        archive.cycles().empty()
            ? nullptr
            : archive.find(archive.cycles().back(), kFieldView, field, kind::kField);
    if (!row) continue;
    const auto header = files.header(*row);
    if (!header || !header->grid) continue;
    const auto& axes = header->grid->axes;
    info["storedFields"].push_back({{"name", field},
                                    {"samples", {axes[0].count, axes[1].count, axes[2].count}},
                                    {"reduction", header->grid->reduction},
                                    {"tolerance", header->grid->tolerance}});
  }
  info["answers"] = json::array();
  for (const std::string& field :
       archive.cycles().empty() ? std::vector<std::string>{} : archive.fields()) {
    for (const bool turned : {false, true}) {
      const json tiers = answersOf(files, field, turned);
      if (tiers.empty()) continue;
      info["answers"].push_back({{"field", field}, {"turned", turned}, {"tiers", tiers}});
    }
  }
  info["radiality"] = radialityInfo(archive);
  info["stacks"] = json::array();
  for (const ArchiveRow& row : archive.rows()) {
    if (row.proxy != kind::kSliced || row.cycle != archive.cycles().back()) continue;
    if (!files.header(row)) continue;
    const ExrFile file = archive.open(row);
    const int levels = levelsOfStack(file);
    info["stacks"].push_back({{"view", row.view},
                              {"field", row.field},
                              {"slabs", file.header().slabDepths.size() - 1},
                              {"levels", levels},
                              {"error", errorOfStack(file.header(), levels)}});
  }
  info["learned"] = learnedInfo(archive);
  info["proxies"] = json::array();
  std::uint64_t bytes = 0;
  for (const std::string& proxy : archive.proxies()) {
    const Totals& total = totals.at(proxy);
    info["proxies"].push_back({{"name", proxy}, {"files", total.files}, {"bytes", total.bytes}});
    bytes += total.bytes;
  }
  info["bytes"] = bytes;
  if (!archive.rows().empty()) {
    // What a run wrote last: tables of learned colours come afterwards.
    std::vector<const ArchiveRow*> latest;
    for (const bool learned : {false, true})
      for (auto row = archive.rows().rbegin(); row != archive.rows().rend(); ++row)
        if ((row->proxy == kind::kLearned) == learned) latest.push_back(&*row);
    if (const auto header = files.firstOf(latest)) {
      const Box& box = header->domain;
      info["domain"] = {{"low", {box.low.x, box.low.y, box.low.z}},
                        {"high", {box.high.x, box.high.y, box.high.z}}};
      info["note"] = header->note;
    }
    info["provenances"] = provenancesOf(archive);
  }
  info["damaged"] = json::array();
  for (const auto& [file, problem] : files.damaged())
    info["damaged"].push_back({{"file", file}, {"problem", problem}});
  return info;
}

namespace {

std::string damagedText(const json& damaged) {
  constexpr std::size_t kShown = 5;
  std::string text;
  for (std::size_t i = 0; i < std::min(damaged.size(), kShown); ++i) {
    text += fmt::format("  damaged: {}: {}\n", damaged[i]["file"].get<std::string>(),
                        damaged[i]["problem"].get<std::string>());
  }
  if (damaged.size() > kShown) text += fmt::format("  ... {} more\n", damaged.size() - kShown);
  if (!damaged.empty()) text += "  `vestige-explorer check` reads all files and tells of each\n";
  return text;
}

}  // namespace

std::string infoText(const json& info) {
  std::string text = fmt::format("{}\n", info["archive"].get<std::string>());
  if (info["cycles"].empty()) return text + "  no step yet\n";
  text +=
      fmt::format("  {} steps: cycle {}\n", info["cycles"].size(), shortList(info["cycles"], 8));
  text += fmt::format("  time: {:.6g} to {:.6g}\n", info["times"].front().get<double>(),
                      info["times"].back().get<double>());
  if (info.contains("domain")) {
    const json& domain = info["domain"];
    text += fmt::format("  domain: {} to {}\n", domain["low"].dump(), domain["high"].dump());
  }
  for (const json& view : info["views"]) {
    text += fmt::format("  view {}: {} x {}, {}, looks along {}\n", view["name"].get<std::string>(),
                        view["size"][0].dump(), view["size"][1].dump(),
                        view["camera"]["projection"].get<std::string>(),
                        view["camera"]["forward"].dump());
  }
  for (const json& field : info["fields"]) {
    const std::string units = field["units"].get<std::string>();
    text += fmt::format("  field {}{}: {:.6g} to {:.6g}", field["name"].get<std::string>(),
                        units.empty() ? "" : " [" + units + "]", field["low"].get<double>(),
                        field["high"].get<double>());
    if (field.contains("bounds")) {
      const json& bounds = field["bounds"];
      text += fmt::format(", {} intervals over {:.6g} to {:.6g}", bounds.size() - 1,
                          bounds.front().get<double>(), bounds.back().get<double>());
    }
    text += "\n";
  }
  text += rangeText(info["ranges"]);
  for (const json& stored : info["storedFields"]) {
    text += fmt::format("  stored field {}: {} x {} x {} samples, reduced by {}, within {:.3g}\n",
                        stored["name"].get<std::string>(), stored["samples"][0].dump(),
                        stored["samples"][1].dump(), stored["samples"][2].dump(),
                        stored["reduction"].dump(), stored["tolerance"].get<double>());
  }
  for (const json& entry : info["radiality"]) {
    text += fmt::format("  radiality of {} in view {}: ", entry["field"].get<std::string>(),
                        entry["view"].get<std::string>());
    text += entry.contains("problem")
                ? entry["problem"].get<std::string>() + "\n"
                : fmt::format("{:.0f} % beyond 60 degrees; each 10 degrees {}\n",
                              100.0 * entry["shareBeyond60"].get<double>(),
                              sharesText(entry["countsPerTenDegrees"]));
  }
  text += featureText(info["features"]);
  text += customText(info["customizations"]);
  for (const json& stack : info["stacks"]) {
    text += fmt::format("  stack of {} in view {}: {}\n", stack["field"].get<std::string>(),
                        stack["view"].get<std::string>(), stack["error"].get<std::string>());
  }
  for (const json& table : info["learned"]) {
    text += fmt::format("  learned colours of {} in view {}, cycle {}: {}\n",
                        table["field"].get<std::string>(), table["view"].get<std::string>(),
                        table["cycle"].dump(), table.value("table", table.value("problem", "")));
  }
  for (const json& answer : info["answers"]) {
    std::string tiers;
    for (const json& tier : answer["tiers"]) {
      tiers += fmt::format("{}{} ({})", tiers.empty() ? "" : ", then ",
                           tier["proxy"].get<std::string>(), tier["text"].get<std::string>());
    }
    text += fmt::format("  truest for {} {}: {}\n", answer["field"].get<std::string>(),
                        answer["turned"] ? "from elsewhere" : "at a stored view", tiers);
  }
  for (const json& proxy : info["proxies"]) {
    text +=
        fmt::format("  proxy {}: {} files, {}\n", proxy["name"].get<std::string>(),
                    proxy["files"].get<std::uint64_t>(), bytesText(proxy["bytes"].get<double>()));
  }
  text += fmt::format("  {} in all\n", bytesText(info["bytes"].get<double>()));
  text += provenanceText(info["provenances"]);
  if (const std::string note = info.value("note", ""); !note.empty())
    text += fmt::format("  note: {}\n", note);
  text += damagedText(info["damaged"]);
  return text;
}

json timingsInfo(const std::filesystem::path& archive) {
  const std::filesystem::path path = archive / "timings.csv";
  std::ifstream file(path);
  if (!file) throw Error(ErrorCode::NotFound, path.string() + " is not there: no timings");
  json timings{{"columns", json::array()}, {"rows", json::array()}};
  std::string line;
  std::getline(file, line);
  timings["columns"] = split(line);
  for (int number = 2; std::getline(file, line); ++number) {
    const std::vector<std::string> cells = split(line);
    // A line that a crash cut short; a later run may have gone on behind it.
    if (cells.size() < timings["columns"].size()) continue;
    if (cells.size() > timings["columns"].size()) {
      throw Error(ErrorCode::Format, fmt::format("{} line {} has {} cells, not {}", path.string(),
                                                 number, cells.size(), timings["columns"].size()));
    }
    json row = json::array();
    for (const std::string& cell : cells) row.push_back(cellOf(cell));
    timings["rows"].push_back(std::move(row));
  }
  return timings;
}

std::string timingsText(const json& timings) {
  std::vector<std::vector<std::string>> table{timings["columns"].get<std::vector<std::string>>()};
  const std::size_t columns = table[0].size();
  std::vector<double> sums(columns, 0.0);
  std::vector<bool> numeric(columns, !timings["rows"].empty());
  for (const json& row : timings["rows"]) {
    std::vector<std::string> cells;
    for (std::size_t c = 0; c < columns; ++c) {
      cells.push_back(cellText(row[c]));
      numeric[c] = numeric[c] && row[c].is_number();
      if (row[c].is_number()) sums[c] += row[c].get<double>();
    }
    table.push_back(std::move(cells));
  }
  if (!timings["rows"].empty() && columns > 0) {
    std::vector<std::string> means(columns);
    for (std::size_t c = 0; c < columns; ++c) {
      if (numeric[c]) means[c] = fmt::format("{:.4g}", sums[c] / double(timings["rows"].size()));
    }
    means[0] = "mean";
    table.push_back(std::move(means));
  }
  std::vector<std::size_t> widths(columns, 0);
  for (const auto& row : table) {
    for (std::size_t c = 0; c < columns; ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  std::string text = "stages in seconds; peak_memory and bytes in bytes\n";
  for (const auto& row : table) {
    for (std::size_t c = 0; c < columns; ++c) {
      text += fmt::format("{}{:>{}}", c ? "  " : "", row[c], widths[c]);
    }
    text += "\n";
  }
  return text;
}

}  // namespace vestige
