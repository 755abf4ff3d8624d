// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "explorer/export/export_folder.h"
#include "proxy/archive/archive.h"

namespace vestige {

/// Rows of an archive that pass a filter; empty = all.
struct ExportFilter {
  std::vector<long> cycles;
  std::string field, view, proxy;
};
/// Throws NotFound when nothing passes.
std::vector<ArchiveRow> rowsPassing(const Archive& archive, const ExportFilter& filter);

enum class ChannelFormat { Npy, Csv };

/// Writes all that the rows' proxies hold (ExportArray) into `folder` (created): one file an array,
/// Npy: float32, fields float64; Csv: one line a pixel, sample or cluster. Returns the manifest's
/// entries: file, shape, dimensions, axes, units and channels of each (docs/exploring.md). Throws
/// as ExportFolder::file.
nlohmann::json exportChannels(const Archive& archive, const std::vector<ArchiveRow>& rows,
                              const ExportFolder& folder, ChannelFormat format,
                              const std::function<void(int, int)>& progress);
/// The entry of a table that is in `csv`.
nlohmann::json tableEntry(const std::string& file, const std::string& csv,
                          const std::string& meaning);
/// manifest.json: {"archive", "files": entries}, a line each.
std::string manifestText(const Archive& archive, const nlohmann::json& files);

/// CSV of each field's statistics, one line a step; and of its histogram, one line a bin.
std::string statisticsCsv(const Archive& archive, const std::vector<ArchiveRow>& rows);
std::string histogramsCsv(const Archive& archive, const std::vector<ArchiveRow>& rows);

/// A number that reads back as the same one, whatever the locale.
std::string csvNumber(double value);
std::string csvNumber(float value);
/// Quoted where it must be (RFC 4180).
std::string csvText(const std::string& text);

}  // namespace vestige
