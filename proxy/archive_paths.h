// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "proxy/archive.h"

namespace vestige {

inline constexpr const char* kTableName = "data.csv";
inline constexpr const char* kTimingsName = "timings.csv";

/// The files of a row without their extension, "c00000010/front/temperature.length"; a folder
/// suffix "-2", "-3" .. keeps them apart from files that are still in the table.
std::string stemFor(long cycle, const std::string& view, const std::string& field,
                    const std::string& proxy, int generation);

/// The generation in a path made by stemFor(), 1 when there is none.
int generationOf(const std::string& path);

/// Whether a path of a table stays inside its archive: relative, no "..", no control character, at
/// most 1024 bytes.
bool staysInside(const std::string& path);
/// Whether a file reached through the archive really lies in it, symbolic links resolved.
bool liesInside(const std::filesystem::path& directory, const std::string& path);

/// Paths, relative to the archive, of all files in its cycle folders; sorted.
std::vector<std::string> filesInCycles(const std::filesystem::path& directory);

/// Deletes files of an archive, relative paths, and the folders that this empties. What cannot be
/// deleted stays.
void removeInside(const std::filesystem::path& directory, const std::vector<std::string>& files);

}  // namespace vestige
