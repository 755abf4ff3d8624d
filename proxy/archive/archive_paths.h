// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "proxy/archive/archive.h"

namespace vestige {

inline constexpr const char* kTableName = "data.csv";
inline constexpr const char* kTimingsName = "timings.csv";

/// What a table has once: cycle, view, field, proxy.
using RowKey = std::tuple<long, std::string, std::string, std::string>;
inline RowKey keyOf(const ArchiveRow& row) { return {row.cycle, row.view, row.field, row.proxy}; }

/// The files of a row without their extension, "c00000010/front/temperature.length"; a folder
/// suffix "-2", "-3" .. keeps them apart from files that are still in the table.
std::string stemFor(long cycle, const std::string& view, const std::string& field,
                    const std::string& proxy, int generation);

/// The cycle folder of a path, "c00000010-2". One write of a step puts its files into a folder of
/// their own, so a folder stands for a step.
inline std::string cycleFolderOf(const std::string& path) { return path.substr(0, path.find('/')); }
/// The generation in a path made by stemFor(), 1 when there is none.
int generationOf(const std::string& path);

/// Whether a path of a table stays inside its archive: relative, no "..", no control character, at
/// most 1024 bytes.
bool staysInside(const std::string& path);
/// Whether a file reached through the archive really lies in it, symbolic links resolved.
bool liesInside(const std::filesystem::path& directory, const std::string& path);

/// Paths, relative to the archive, of all files in its cycle folders; sorted.
std::vector<std::string> filesInCycles(const std::filesystem::path& directory);

/// The cycle folders of a step that was cut off while its files were written or renamed: they hold
/// a temporary file, and no row names them.
std::set<std::string> unfinishedFolders(const std::vector<std::string>& files,
                                        const std::vector<ArchiveRow>& rows);

/// Deletes files of an archive, relative paths, and the folders that this empties. What cannot be
/// deleted stays.
void removeInside(const std::filesystem::path& directory, const std::vector<std::string>& files);

}  // namespace vestige
