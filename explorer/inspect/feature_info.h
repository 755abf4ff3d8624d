// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "explorer/inspect/header_reader.h"
#include "proxy/archive/archive.h"

namespace vestige {

/// The features of the last step: [{"name", "kind", "fields", "features": [{"name", "opacity",
/// "color", "enabled"}], "classifier": as looks have it, "views", "stacks": names}].
nlohmann::json featureInfo(HeaderReader& files);
/// A few lines for people.
std::string featureText(const nlohmann::json& info);

}  // namespace vestige
