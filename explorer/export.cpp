// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/export.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <utility>

#include "explorer/npy.h"
#include "proxy/durable_file.h"
#include "proxy/error.h"

namespace vestige {
namespace {

void writeText(const std::filesystem::path& path, const std::string& text) {
  writeDurably(path, std::as_bytes(std::span(text)));
}

std::vector<float> stacked(const ProxyPart& part) {
  std::vector<float> values;
  for (const Channel& channel : part.channels) {
    values.insert(values.end(), channel.values.begin(), channel.values.end());
  }
  return values;
}

std::string channelNames(const ProxyPart& part) {
  std::string text = "index,channel\n";
  for (std::size_t i = 0; i < part.channels.size(); ++i) {
    text += std::to_string(i) + "," + csvText(part.channels[i].name) + "\n";
  }
  return text;
}

std::string pixelLines(const ProxyPart& part, ImageSize size) {
  std::string text = "x,y";
  for (const Channel& channel : part.channels) text += "," + csvText(channel.name);
  text += "\n";
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      text += std::to_string(x) + "," + std::to_string(y);
      const std::size_t i = std::size_t(y) * std::size_t(size.width) + std::size_t(x);
      for (const Channel& channel : part.channels) {
        text += "," + csvNumber(double(channel.values[i]));
      }
      text += "\n";
    }
  }
  return text;
}

/// Planes of depths get one of their distortion Z/κ beside them in multi-perspective views
/// (visualization-by-proxy eq. 2), which is not stored because it follows.
void addDistortion(const ProxyHeader& header, ProxyPart& part) {
  if (header.camera.projection != Projection::MultiPerspective) return;
  const std::size_t stored = part.channels.size();
  for (std::size_t i = 0; i < stored; ++i) {
    if (part.channels[i].name != "Z" && part.name != "depth") continue;
    Channel distortion = part.channels[i];
    distortion.name = "distortion_" + distortion.name;
    for (float& v : distortion.values) v = float(double(v) / header.camera.convergence);
    part.channels.push_back(std::move(distortion));
  }
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

std::string csvNumber(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value > 0.0 ? "inf" : "-inf";
  char text[64];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  return {text, end};
}

std::string csvText(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::vector<ArchiveRow> rowsPassing(const Archive& archive, const ExportFilter& filter) {
  const auto require = [&](const char* what, const std::string& name, const auto& there,
                           const auto& value) {
    if (std::find(there.begin(), there.end(), value) != there.end()) return;
    throw Error(ErrorCode::NotFound, archive.directory().string() + " has no " + what + " '" +
                                         name + "'; `info` lists what there is");
  };
  const std::vector<long> cycles = archive.cycles();
  for (long cycle : filter.cycles) require("cycle", std::to_string(cycle), cycles, cycle);
  const auto named = [&](const char* what, const std::string& name,
                         const std::vector<std::string>& there) {
    if (!name.empty()) require(what, name, there, name);
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

std::vector<std::filesystem::path> exportChannels(const Archive& archive,
                                                  const std::vector<ArchiveRow>& rows,
                                                  const std::filesystem::path& folder,
                                                  ChannelFormat format,
                                                  const std::function<void(int, int)>& progress) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw Error(ErrorCode::Io, folder.string() + " cannot be created: " + error.message());
  }
  std::vector<std::filesystem::path> written;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const ArchiveRow& row = rows[i];
    const ExrFile file = archive.open(row);
    const ImageSize size = file.header().size;
    for (const std::string& name : file.partNames()) {
      ProxyPart part = file.part(name);
      addDistortion(file.header(), part);
      std::string stem = std::to_string(row.cycle) + "_" + row.view + "_" + row.field + "_" +
                         row.proxy + "_" + name;
      std::replace(stem.begin(), stem.end(), '/', '_');
      if (format == ChannelFormat::Npy) {
        const std::vector<std::size_t> shape{part.channels.size(), std::size_t(size.height),
                                             std::size_t(size.width)};
        written.push_back(folder / (stem + ".npy"));
        writeDurably(written.back(), encodeNpy(stacked(part), shape));
        written.push_back(folder / (stem + ".channels.csv"));
        writeText(written.back(), channelNames(part));
      } else {
        written.push_back(folder / (stem + ".csv"));
        writeText(written.back(), pixelLines(part, size));
      }
    }
    if (progress) progress(int(i) + 1, int(rows.size()));
  }
  return written;
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
