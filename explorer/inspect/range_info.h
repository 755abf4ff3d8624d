// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "explorer/inspect/header_reader.h"
#include "proxy/archive/archive.h"

namespace vestige {

/// How a run's intervals served its fields: [{"field", "changes": [{"cycle", "low", "high"}, ...],
/// and where more than 1 % of a step's samples were outside, "steps": how many of them, "worst":
/// {"cycle", "share", "below", "above", "low", "high"}: shares of samples, range of the data},
/// ...]. Fields of which neither is to be said are left out. Opens one file a step and field.
nlohmann::json rangeInfo(HeaderReader& files);
/// The same for people.
std::string rangeText(const nlohmann::json& info);

}  // namespace vestige
