// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "proxy/archive/archive.h"

namespace vestige {

/// What an archive holds: steps, views, fields with units, range and intervals, proxies with their
/// bytes; and of the last step's depth layers how obliquely rays meet them (Radiality), for which
/// it decodes at most twelve files. Otherwise opens one file a (field, proxy).
nlohmann::json archiveInfo(const Archive& archive);
/// The same for people.
std::string infoText(const nlohmann::json& info);

/// timings.csv of an archive: {"columns": [...], "rows": [[...], ...]} as stored, texts as texts
/// and numbers as numbers. Throws NotFound when there is none, Format naming a bad line.
nlohmann::json timingsInfo(const std::filesystem::path& archive);
/// An aligned table, and below it the mean of each column of numbers.
std::string timingsText(const nlohmann::json& timings);

}  // namespace vestige
