// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/export/export.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <utility>

#include "explorer/export/camera_info.h"
#include "explorer/export/export_arrays.h"
#include "explorer/export/npy.h"
#include "explorer/export/output_file.h"
#include "proxy/base/error.h"
#include "proxy/base/nearest_word.h"

namespace vestige {
namespace {

using nlohmann::json;

/// The values of one array as an .npy file.
void writeNpy(const std::filesystem::path& path, const ExportArray& array) {
  OutputFile file(path);
  file.write(npyHeader(array.isDouble ? NpyType::Float64 : NpyType::Float32, array.shape()));
  for (std::size_t i = 0; i < array.blocks; ++i) {
    const std::vector<double> values = array.values(i);
    if (array.isDouble) {
      file.write(std::as_bytes(std::span(values)));
    } else {
      const std::vector<float> narrow(values.begin(), values.end());
      file.write(std::as_bytes(std::span(narrow)));
    }
  }
  file.finish();
}

/// One line for each pixel, sample or cluster: where it is, then its channels.
void writeCsv(const std::filesystem::path& path, const ExportArray& array) {
  OutputFile file(path);
  const bool samples = array.axes.size() == 3;
  std::string text = array.outer.empty() || samples ? "" : array.outer + ",";
  if (array.pictures) text += "x,y,";
  if (samples) text += "z,";
  for (std::size_t c = 0; c < array.channels.size(); ++c)
    text += (c ? "," : "") + csvText(array.channels[c].name);
  text += "\n";
  const std::size_t width = std::size_t(array.size.width);
  for (std::size_t block = 0; block < array.blocks; ++block) {
    const std::vector<double> values = array.values(block);
    const std::size_t places = array.size.pixels();
    for (std::size_t i = 0; i < places; ++i) {
      const std::size_t x = i % width, y = i / width;
      if (samples) {
        text += csvNumber(array.axes[0][x]) + "," + csvNumber(array.axes[1][y]) + "," +
                csvNumber(array.axes[2][block]) + ",";
      } else {
        if (!array.outer.empty()) text += std::to_string(block) + ",";
        if (array.pictures) text += std::to_string(x) + "," + std::to_string(y) + ",";
      }
      for (std::size_t c = 0; c < array.channels.size(); ++c) {
        const double value = values[c * places + i];
        text += c ? "," : "";
        text += array.isDouble ? csvNumber(value) : csvNumber(float(value));
      }
      text += "\n";
    }
    file.write(text);
    text.clear();
  }
  file.write(text);
  file.finish();
}

json channelsJson(const std::vector<ExportChannel>& channels) {
  json list = json::array();
  for (const ExportChannel& channel : channels) {
    json& entry = list.emplace_back(
        json{{"name", channel.name}, {"meaning", channel.meaning}, {"units", channel.units}});
    if (channel.low) entry["low"] = *channel.low;
    if (channel.high) entry["high"] = *channel.high;
  }
  return list;
}

/// What a file of an array is, for the manifest.
json entryOf(const ProxyHeader& header, const ExportArray& array) {
  json entry{{"proxy", header.kind},        {"field", header.field},
             {"view", header.view},         {"cycle", header.cycle},
             {"time", header.time},         {"shape", array.shape()},
             {"axes", array.axes},          {"dimensions", array.dimensions()},
             {"largestError", array.error}, {"channels", channelsJson(array.channels)}};
  if (!array.part.empty()) entry["part"] = array.part;
  if (!array.axesMeaning.empty()) entry["axesMeaning"] = array.axesMeaning;
  if (!array.slabDepths.empty()) entry["slabDepths"] = array.slabDepths;
  if (array.axes.size() == 2) entry["camera"] = cameraInfo(header.camera);
  const auto other = [&](const ExportChannel& channel) {
    return channel.units != array.channels.front().units;
  };
  entry["units"] = std::any_of(array.channels.begin(), array.channels.end(), other)
                       ? std::string("by channel")
                       : array.channels.front().units;
  return entry;
}

/// "CYCLE_VIEW_FIELD_PROXY_PART", or "CYCLE_VIEW_FIELD.PROXY" of a proxy that is one array; not
/// among those `taken`.
std::string stemOf(const ProxyHeader& header, const ExportArray& array,
                   std::set<std::string>& taken) {
  std::string stem =
      std::to_string(header.cycle) + "_" + header.view + "_" + header.field +
      (array.part.empty() ? "." + header.kind : "_" + header.kind + "_" + array.part);
  std::replace(stem.begin(), stem.end(), '/', '_');
  const std::string wanted = stem;
  for (int i = 2; !taken.insert(stem).second; ++i) stem = std::to_string(i) + "_" + wanted;
  return stem;
}

/// The headers of one file a (cycle, field): statistics are the same in all.
template <typename Use>
void forFieldSteps(const Archive& archive, const std::vector<ArchiveRow>& rows, const Use& use) {
  std::set<std::pair<long, std::string>> seen;
  for (const ArchiveRow& row : rows) {
    if (seen.emplace(row.cycle, row.field).second) use(archive.open(row).header());
  }
}

}  // namespace

namespace {

template <typename Number>
std::string shortest(Number value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  char text[64];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  return {text, end};
}

}  // namespace

std::string csvNumber(double value) { return shortest(value); }
std::string csvNumber(float value) { return shortest(value); }

std::string csvText(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::vector<ArchiveRow> rowsPassing(const Archive& archive, const ExportFilter& filter) {
  const auto require = [&](const char* what, const std::string& name,
                           const std::vector<std::string>& there) {
    if (std::find(there.begin(), there.end(), name) != there.end()) return;
    throw Error(ErrorCode::NotFound, archive.directory().string() + " has no " + what + " '" +
                                         name + "'" + didYouMean(name, there) +
                                         "; `info` lists what there is");
  };
  std::vector<std::string> cycles;
  for (const long cycle : archive.cycles()) cycles.push_back(std::to_string(cycle));
  for (const long cycle : filter.cycles) require("cycle", std::to_string(cycle), cycles);
  const auto named = [&](const char* what, const std::string& name,
                         const std::vector<std::string>& there) {
    if (!name.empty()) require(what, name, there);
  };
  named("field", filter.field, archive.fields());
  named("view", filter.view, archive.views());
  named("proxy", filter.proxy, archive.proxies());
  std::vector<ArchiveRow> rows;
  for (const ArchiveRow& row : archive.rows()) {
    const bool cycle =
        filter.cycles.empty() ||
        std::find(filter.cycles.begin(), filter.cycles.end(), row.cycle) != filter.cycles.end();
    const auto passes = [](const std::string& wanted, const std::string& value) {
      return wanted.empty() || wanted == value;
    };
    if (cycle && passes(filter.field, row.field) && passes(filter.view, row.view) &&
        passes(filter.proxy, row.proxy)) {
      rows.push_back(row);
    }
  }
  if (rows.empty()) {
    throw Error(ErrorCode::NotFound, "nothing in " + archive.directory().string() +
                                         " passes all filters at once; `info` lists what there is");
  }
  return rows;
}

json exportChannels(const Archive& archive, const std::vector<ArchiveRow>& rows,
                    const ExportFolder& folder, ChannelFormat format,
                    const std::function<void(int, int)>& progress) {
  json files = json::array();
  std::set<std::string> taken;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const ExrFile file = archive.open(rows[i]);
    for (const ExportArray& array : exportArrays(file)) {
      const bool npy = format == ChannelFormat::Npy;
      const std::string name = stemOf(file.header(), array, taken) + (npy ? ".npy" : ".csv");
      (npy ? writeNpy : writeCsv)(folder.file(name), array);
      files.push_back(entryOf(file.header(), array));
      files.back()["file"] = name;
    }
    if (progress) progress(int(i) + 1, int(rows.size()));
  }
  return files;
}

json tableEntry(const std::string& file, const std::string& csv, const std::string& meaning) {
  json columns = json::array();
  std::stringstream names(csv.substr(0, csv.find('\n')));
  for (std::string name; std::getline(names, name, ',');) columns.push_back({{"name", name}});
  const auto lines = std::count(csv.begin(), csv.end(), '\n') - 1;
  return {{"file", file},
          {"meaning", meaning},
          {"shape", {lines, columns.size()}},
          {"dimensions", {"line", "channel"}},
          {"axes", json::array()},
          {"units", "the field's"},
          {"channels", std::move(columns)}};
}

std::string manifestText(const Archive& archive, const json& files) {
  std::string text =
      "{\n\"archive\": " + json(archive.directory().string()).dump() + ",\n\"files\": [";
  for (std::size_t i = 0; i < files.size(); ++i) text += (i ? ",\n" : "\n") + files[i].dump();
  return text + "\n]\n}\n";
}

std::string statisticsCsv(const Archive& archive, const std::vector<ArchiveRow>& rows) {
  std::string text = "cycle,time,field,units,count,no_data,low,high,mean,deviation\n";
  forFieldSteps(archive, rows, [&](const ProxyHeader& header) {
    const FieldStatistics& s = header.statistics;
    text += std::to_string(header.cycle) + "," + csvNumber(header.time) + "," +
            csvText(header.field) + "," + csvText(header.units) + "," + std::to_string(s.count) +
            "," + std::to_string(s.noData) + "," + csvNumber(s.low) + "," + csvNumber(s.high) +
            "," + csvNumber(s.mean) + "," + csvNumber(s.deviation) + "\n";
  });
  return text;
}

std::string histogramsCsv(const Archive& archive, const std::vector<ArchiveRow>& rows) {
  std::string text = "cycle,time,field,bin_low,bin_high,count\n";
  forFieldSteps(archive, rows, [&](const ProxyHeader& header) {
    const FieldStatistics& s = header.statistics;
    const double bins = double(s.histogram.size());
    for (std::size_t i = 0; i < s.histogram.size(); ++i) {
      text += std::to_string(header.cycle) + "," + csvNumber(header.time) + "," +
              csvText(header.field) + "," + csvNumber(std::lerp(s.low, s.high, double(i) / bins)) +
              "," + csvNumber(std::lerp(s.low, s.high, double(i + 1) / bins)) + "," +
              std::to_string(s.histogram[i]) + "\n";
    }
  });
  return text;
}

}  // namespace vestige
