// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/inspect/feature_info.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "proxy/format/layout/feature_layout.h"

namespace vestige {

using nlohmann::json;

json featureInfo(HeaderReader& files) {
  const Archive& archive = files.archive();
  json list = json::array();
  if (archive.cycles().empty()) return list;
  for (const ArchiveRow& row : archive.rows()) {
    const bool sliced = row.proxy == kind::kSlicedFeatures;
    if (row.cycle != archive.cycles().back() || (!sliced && row.proxy != kind::kFeatures)) continue;
    auto found = std::find_if(list.begin(), list.end(),
                              [&](const json& each) { return each["name"] == row.field; });
    if (found == list.end()) {
      const auto header = files.header(row);
      if (!header) continue;
      const FeatureOrigin& origin = featuresOf(*header);
      const Classifier& classifier = *origin.classifier;
      json features = json::array();
      for (const Feature& feature : classifier.features()) features.push_back(featureJson(feature));
      list.push_back({{"name", row.field},
                      {"kind", classifier.kind()},
                      {"fields", classifier.fields()},
                      {"features", std::move(features)},
                      {"classifier", classifier.json()},
                      {"views", json::array()},
                      {"stacks", json::array()}});
      found = list.end() - 1;
    }
    (*found)[sliced ? "stacks" : "views"].push_back(row.view);
  }
  return list;
}

std::string featureText(const json& info) {
  std::string text;
  const auto names = [](const json& list) {
    std::string all;
    for (const json& name : list) all += (all.empty() ? "" : ", ") + name.get<std::string>();
    return all;
  };
  for (const json& each : info) {
    std::string features;
    for (const json& feature : each["features"]) {
      features +=
          fmt::format("{}{}", features.empty() ? "" : ", ", feature["name"].get<std::string>());
    }
    text += fmt::format("  features {}: {} of {}: {}\n", each["name"].get<std::string>(),
                        each["kind"].get<std::string>(), names(each["fields"]), features);
    if (!each["views"].empty()) text += fmt::format("    at views {}\n", names(each["views"]));
    if (!each["stacks"].empty()) {
      text += fmt::format("    from anywhere, by stacks {}\n", names(each["stacks"]));
    }
  }
  return text;
}

}  // namespace vestige
