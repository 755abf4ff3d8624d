// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/inspect/range_info.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>

#include "proxy/base/error.h"

namespace vestige {
namespace {

using nlohmann::json;

json endsAt(long cycle, const IntervalPartition& intervals) {
  return {{"cycle", cycle}, {"low", intervals.low()}, {"high", intervals.high()}};
}

void takeStep(json& entry, const ProxyHeader& header) {
  const FieldStatistics& statistics = header.statistics;
  json& changes = entry["changes"];
  json ends = endsAt(header.cycle, *header.partition);
  if (changes.empty() || changes.back()["low"] != ends["low"] ||
      changes.back()["high"] != ends["high"])
    changes.push_back(std::move(ends));
  const double share = statistics.shareOutside();
  if (share <= kOutside || !reachesBeyond(statistics, *header.partition)) return;
  entry["steps"] = entry.value("steps", 0) + 1;
  if (entry.contains("worst") && entry["worst"]["share"].get<double>() >= share) return;
  const double known = double(statistics.count - statistics.noData);
  entry["worst"] = {{"cycle", header.cycle},
                    {"share", share},
                    {"below", double(statistics.below) / known},
                    {"above", double(statistics.above) / known},
                    {"low", statistics.low},
                    {"high", statistics.high}};
}

}  // namespace

json rangeInfo(HeaderReader& files) {
  const Archive& archive = files.archive();
  json list = json::array();
  for (const std::string& field : archive.fields()) {
    json entry{{"field", field}, {"changes", json::array()}};
    std::set<long> seen;
    for (const ArchiveRow& row : archive.rows()) {
      if (row.field != field || !seen.insert(row.cycle).second) continue;
      const auto header = files.header(row);
      if (!header) continue;
      if (!header->partition) break;  // features
      takeStep(entry, *header);
    }
    if (entry["changes"].size() > 1 || entry.contains("worst")) list.push_back(std::move(entry));
  }
  return list;
}

std::string rangeText(const json& info) {
  std::string text;
  for (const json& entry : info) {
    const std::string field = entry["field"].get<std::string>();
    const json& changes = entry["changes"];
    if (changes.size() > 1) {
      const auto ends = [](const json& each) {
        return fmt::format("{:.6g} to {:.6g}", each["low"].get<double>(),
                           each["high"].get<double>());
      };
      text += fmt::format(
          "  intervals of {}: {} at cycle {}, changed {} time{}, {} from cycle {}\n", field,
          ends(changes.front()), changes.front()["cycle"].dump(), changes.size() - 1,
          changes.size() == 2 ? "" : "s", ends(changes.back()), changes.back()["cycle"].dump());
    }
    if (!entry.contains("worst")) continue;
    const json& worst = entry["worst"];
    text += fmt::format(
        "  outside of the intervals of {}: more than 1 % of the samples at {} step{}, most at "
        "cycle {}: {:.3g} % below, {:.3g} % above, data {:.6g} to {:.6g}\n",
        field, entry["steps"].dump(), entry["steps"] == 1 ? "" : "s", worst["cycle"].dump(),
        100.0 * worst["below"].get<double>(), 100.0 * worst["above"].get<double>(),
        worst["low"].get<double>(), worst["high"].get<double>());
  }
  return text;
}

}  // namespace vestige
