// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "explorer/inspect/probe.h"
#include "explorer/inspect/probe_pixel.h"

namespace vestige {
namespace {

using nlohmann::json;

constexpr std::size_t kMostLines = 33;

std::string cellOf(const json& value, int digits = 6) {
  return value.is_number() ? fmt::format("{:.{}g}", value.get<double>(), digits) : "-";
}

/// Of values of a field.
int digitsOf(const json& of) {
  if (!of.contains("range")) return 6;
  return vestige::digitsOf(of["range"][0].get<double>(), of["range"][1].get<double>());
}

std::string sampleLine(const json& sample, int digits) {
  const json& at = sample["position"];
  return fmt::format("  {:>12} {:>12} {:>12} {:>12} {:>{}}\n", cellOf(sample["depth"]),
                     cellOf(at[0]), cellOf(at[1]), cellOf(at[2]),
                     sample["value"].is_null() ? "no data" : cellOf(sample["value"], digits),
                     std::max(12, digits + 6));
}

/// Some of the samples, the first and the last among them.
std::string valuesText(const json& values) {
  const json& samples = values["samples"];
  const std::string units = values["units"];
  const int digits = digitsOf(values);
  std::string text =
      fmt::format("{} along the ray{}: {}\n", values["field"].get<std::string>(),
                  units.empty() ? "" : " [" + units + "]", values["source"].get<std::string>());
  if (samples.empty()) return text + "  the ray misses the domain\n";
  text += fmt::format("  {:>12} {:>12} {:>12} {:>12} {:>{}}\n", "depth", "x", "y", "z", "value",
                      std::max(12, digits + 6));
  const std::size_t lines = std::min(kMostLines, samples.size());
  for (std::size_t i = 0; i < lines; ++i)
    text += sampleLine(samples[lines == 1 ? 0 : i * (samples.size() - 1) / (lines - 1)], digits);
  if (lines < samples.size())
    text += fmt::format("  {} of {} samples; --json has all\n", lines, samples.size());
  if (values.contains("firstVisible"))
    text += "first visible:\n" + sampleLine(values["firstVisible"], digits);
  return text;
}

bool saysNothing(const json& row) {
  for (const auto& [part, value] : row["parts"].items()) {
    if (part == "ends" || part == "state") return false;  // 0 is a word of theirs
    if (value.is_number() && value.get<double>() != 0.0) return false;
  }
  return true;
}

/// A line for each channel that the ray meets, a column for each part, and how true these are.
std::string channelsText(const json& proxy) {
  const json& rows = proxy["channels"];
  const int digits = digitsOf(proxy), wide = std::max(12, digits + 6);
  std::vector<std::string> parts;
  std::string body;
  for (const json& row : rows)
    for (const auto& [part, value] : row["parts"].items())
      if (std::find(parts.begin(), parts.end(), part) == parts.end()) parts.push_back(part);
  std::string text = fmt::format("  {:<16} {:>{}} {:>{}}", "channel", "from", wide, "to", wide);
  for (const std::string& part : parts)
    text += fmt::format(" {:>{}}", part, part == "mip" ? wide : 14);
  for (const json& row : rows) {
    if (saysNothing(row)) continue;
    const auto bound = [&](const char* key) {
      return row.contains(key) ? cellOf(row[key], digits) : "";
    };
    body += fmt::format("\n  {:<16} {:>{}} {:>{}}", row["name"].get<std::string>(), bound("low"),
                        wide, bound("high"), wide);
    for (const std::string& part : parts) {
      const bool value = part == "mip";
      body += fmt::format(
          " {:>{}}",
          row["parts"].contains(part) ? cellOf(row["parts"][part], value ? digits : 6) : "",
          value ? wide : 14);
    }
  }
  if (body.empty()) return "  the ray meets nothing there\n";
  if (proxy.contains("within")) {
    std::string within;
    for (const auto& [part, error] : proxy["within"].items())
      within += fmt::format("{}{} {:.3g}", within.empty() ? "" : ", ", part, error.get<double>());
    body += "\n  within: " + within;
  }
  return text + body + "\n";
}

/// The cells of a stack as probe() has them.
std::string cellsText(const json& cells) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<ProbeCell> found;
  for (const json& cell : cells) {
    ProbeCell& made =
        found.emplace_back(ProbeCell{cell["slab"], cell["near"], cell["far"], {}, cell["noData"]});
    for (const json& share : cell["shares"])
      made.shares.push_back(
          {share["channel"], share["low"].is_null() ? -kInfinity : share["low"].get<double>(),
           share["high"].is_null() ? kInfinity : share["high"].get<double>(), share["length"]});
  }
  return probeText(found);
}

}  // namespace

std::string probeText(const json& probed) {
  std::string text = fmt::format("pixel {},{} of {} x {}, cycle {}: {}\n",
                                 probed["pixel"][0].get<int>(), probed["pixel"][1].get<int>(),
                                 probed["size"][0].get<int>(), probed["size"][1].get<int>(),
                                 probed["cycle"].get<long>(), probed["color"].get<std::string>());
  for (const json& note : probed["notes"]) text += note.get<std::string>() + "\n";
  const json& ray = probed["ray"];
  text += ray["enters"].is_null()
              ? std::string("the ray misses the domain\n")
              : fmt::format("the ray is in the domain from planar depth {} to {}\n",
                            cellOf(ray["enters"]), cellOf(ray["leaves"]));
  for (const json& values : probed["values"]) text += "\n" + valuesText(values);
  for (const json& proxy : probed["proxies"]) {
    text +=
        fmt::format("\n{} of {} in view {}, its pixel {},{}:\n", proxy["proxy"].get<std::string>(),
                    proxy["field"].get<std::string>(), proxy["view"].get<std::string>(),
                    proxy["pixel"][0].get<int>(), proxy["pixel"][1].get<int>());
    if (proxy.contains("note")) text += "  " + proxy["note"].get<std::string>() + "\n";
    text += proxy.contains("cells") ? cellsText(proxy["cells"]) : channelsText(proxy);
  }
  if (!probed["otherRays"].empty()) {
    std::string list;
    for (const json& name : probed["otherRays"])
      list += (list.empty() ? "" : ", ") + name.get<std::string>();
    text += "\nstored along other rays than this picture's: " + list + "\n";
  }
  return text;
}

}  // namespace vestige
