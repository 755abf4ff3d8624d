// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "explorer/inspect/header_reader.h"
#include "proxy/archive/archive.h"

namespace vestige {

/// What the run customised by position at the last step: [{"field", "proxies": names, "seeds": how
/// many are enabled, "customization": as looks have it}].
nlohmann::json customInfo(HeaderReader& files);
/// A line each for people.
std::string customText(const nlohmann::json& info);

}  // namespace vestige
