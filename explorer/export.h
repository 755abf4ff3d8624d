// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "proxy/archive.h"

namespace vestige {

/// Rows of an archive that pass a filter; empty = all.
struct ExportFilter {
  std::vector<long> cycles;
  std::string field, view, proxy;
};
/// Throws NotFound when nothing passes.
std::vector<ArchiveRow> rowsPassing(const Archive& archive, const ExportFilter& filter);

enum class ChannelFormat { Npy, Csv };

/// Writes each part of the rows' files into `folder` (created), in world units. Npy:
/// CYCLE_VIEW_FIELD_PROXY_PART.npy of shape (channels, height, width) beside a .channels.csv that
/// names them; Csv: one line a pixel: x, y and the channels. Returns the files.
std::vector<std::filesystem::path> exportChannels(const Archive& archive,
                                                  const std::vector<ArchiveRow>& rows,
                                                  const std::filesystem::path& folder,
                                                  ChannelFormat format,
                                                  const std::function<void(int, int)>& progress);

/// CSV of each field's statistics, one line a step; and of its histogram, one line a bin.
std::string statisticsCsv(const Archive& archive, const std::vector<ArchiveRow>& rows);
std::string histogramsCsv(const Archive& archive, const std::vector<ArchiveRow>& rows);

/// A number that reads back as the same double, whatever the locale.
std::string csvNumber(double value);
/// Quoted where it must be (RFC 4180).
std::string csvText(const std::string& text);

}  // namespace vestige
