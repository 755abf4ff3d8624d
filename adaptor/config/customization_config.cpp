// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/config/customization_config.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "proxy/base/json_object.h"

namespace vestige {
namespace {

constexpr const char* kCustomizationOwner = "customization";

void refuseBlending(const SeedParameters& parameters, const std::string& path) {
  if (!parameters.function) return;
  throw KeyError(kCustomizationOwner, path + "function",
                 "is for looks: a run marches its base function alone, so only opacity, gamma and "
                 "shift depend on the place");
}

}  // namespace

Customization readCustomization(const ConfigReader& reader) {
  Customization customization;
  reader.atKeyLines([&] {
    const nlohmann::json json = reader.json();
    customization = customizationFromJson(json, "", kCustomizationOwner);
    for (std::size_t i = 0; i < customization.seeds.size(); ++i)
      refuseBlending(customization.seeds[i].parameters, fmt::format("seeds[{}].", i));
    const bool each = json.contains("corners") && json["corners"].is_array();
    for (std::size_t i = 0; i < customization.corners.size(); ++i)
      refuseBlending(customization.corners[i], each ? fmt::format("corners[{}].", i) : "corners.");
  });
  return customization;
}

}  // namespace vestige
