// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/inspect/custom_info.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "proxy/base/error.h"

namespace vestige {

using nlohmann::json;

json customInfo(HeaderReader& files) {
  const Archive& archive = files.archive();
  const std::set<std::string_view> kinds{kind::kAttenuation, kind::kReference, kind::kLayered,
                                         kind::kMip};
  // One view tells: all are made alike.
  std::map<std::pair<std::string, std::string>, const ArchiveRow*> rows;
  for (const ArchiveRow& row : archive.rows()) {
    if (kinds.contains(row.proxy) && row.cycle == archive.cycles().back())
      rows.try_emplace({row.field, row.proxy}, &row);
  }
  json list = json::array();
  for (const auto& [key, row] : rows) {
    const auto header = files.header(*row);
    const auto customization = header ? header->customization : std::nullopt;
    if (!customization) continue;
    if (list.empty() || list.back()["field"] != row->field) {
      const auto& seeds = customization->seeds;
      list.push_back({{"field", row->field},
                      {"proxies", json::array()},
                      {"seeds", std::count_if(seeds.begin(), seeds.end(),
                                              [](const auto& seed) { return seed.enabled; })},
                      {"customization", toJson(*customization)}});
    }
    list.back()["proxies"].push_back(row->proxy);
  }
  return list;
}

std::string customText(const json& info) {
  std::string text;
  for (const json& each : info) {
    const auto proxies = each["proxies"].get<std::vector<std::string>>();
    text += fmt::format("  customised by position: {} of {}, {} seed{}\n", fmt::join(proxies, ", "),
                        each["field"].get<std::string>(), each["seeds"].dump(),
                        each["seeds"] == 1 ? "" : "s");
  }
  return text;
}

}  // namespace vestige
