// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/run/record.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <span>

#include "adaptor/run/vtk_xml_writer.h"
#include "proxy/base/durable_file.h"
#include "proxy/base/error.h"
#include "proxy/version.h"

namespace vestige {
namespace {

nlohmann::json describe(int index, const Block& block, const std::string& file) {
  const auto& grid = block.grid;
  nlohmann::json fields = nlohmann::json::array(), masks = nlohmann::json::array();
  for (const auto& field : block.fields) {
    fields.push_back({{"name", field.name},
                      {"location", nameOf(field.location)},
                      {"type", nameOf(field.type)},
                      {"components", field.components.size()}});
  }
  for (const auto location : {Location::Point, Location::Cell}) {
    if (block.masks[std::size_t(location)]) masks.push_back(nameOf(location));
  }
  return {{"index", index},
          {"file", file},
          {"points", grid.points},
          {"first", grid.first},
          {"origin", grid.origin},
          {"spacing", grid.spacing},
          {"axes", {grid.axes[0].has_value(), grid.axes[1].has_value(), grid.axes[2].has_value()}},
          {"ghosts", grid.ghosts},
          {"fields", fields},
          {"masks", masks}};
}

/// `directory`, or the first of directory.1, directory.2 ... that holds no recording. Its
/// calls.jsonl is there then, empty: processes that start together take different ones.
std::filesystem::path freshFolder(const std::filesystem::path& directory) {
  for (int i = 0;; ++i) {
    auto folder = directory;
    if (i > 0) folder += fmt::format(".{}", i);
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error) {
      throw Error(ErrorCode::Io, fmt::format("cannot make the recording's folder '{}': {}",
                                             folder.string(), error.message()));
    }
    const auto calls = folder / "calls.jsonl";
    if (std::FILE* file = std::fopen(calls.c_str(), "wxe")) {
      std::fclose(file);
      return folder;
    }
    if (errno != EEXIST) {
      throw Error(ErrorCode::Io,
                  fmt::format("cannot make '{}': {}", calls.string(), std::strerror(errno)));
    }
  }
}

}  // namespace

Recorder::Recorder(const std::filesystem::path& directory, const std::string& configText,
                   const std::string& output)
    : directory_(freshFolder(directory)) {
  writeDurably(directory_ / "config.toml", std::as_bytes(std::span(configText)));
  append({{"call", "open"}, {"version", kVersion}, {"output", output}});
}

Recorder::~Recorder() {
  try {
    append({{"call", "close"}});
  } catch (const std::exception&) {
    // "close" is missing where the host died, too: readers do without it.
  }
}

void Recorder::append(const nlohmann::json& call) {
  const auto line = call.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  appendDurably(directory_ / "calls.jsonl", line);
}

void Recorder::execute(std::int64_t cycle, double time, const BlockSet& blocks,
                       const std::map<std::string, std::string>& units) {
  nlohmann::json call{{"call", "execute"}, {"cycle", cycle}, {"time", time}, {"units", units}};
  if (const auto& domain = blocks.statedDomain()) {
    const auto &low = domain->low, &high = domain->high;
    call["domain"] = {low.x, low.y, low.z, high.x, high.y, high.z};
  }
  call["blocks"] = nlohmann::json::array();
  for (const auto& [index, block] : blocks.blocks()) {
    std::string file;
    if (!block.grid.empty()) {
      const bool rectilinear = block.grid.axes[0] || block.grid.axes[1] || block.grid.axes[2];
      file = fmt::format("step{:06}_block{:04}.{}", steps_, index, rectilinear ? "vtr" : "vti");
      writeVtkXml(directory_ / file, block);
    }
    call["blocks"].push_back(describe(index, block, file));
  }
  // The files first, then the line that names them: any prefix of the calls can be replayed.
  append(call);
  ++steps_;
}

}  // namespace vestige
