// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <span>

#include "proxy/archive/archive.h"
#include "proxy/archive/archive_lock.h"
#include "proxy/archive/archive_paths.h"
#include "proxy/base/durable_file.h"
#include "proxy/archive/each_file.h"
#include "proxy/base/error.h"
#include "proxy/format/exr/png_file.h"
#include "proxy/format/layout/proxy_check.h"
#include "proxy/archive/timings_file.h"

namespace vestige {
namespace {

namespace fs = std::filesystem;

/// The lines of a table that can be read.
struct ReadableTable {
  std::vector<ArchiveRow> rows;
  bool whole = false;  ///< it is there and has no other lines, a torn last one aside
};

ReadableTable readableTable(const fs::path& directory) {
  ReadableTable table;
  std::error_code failed;
  if (!fs::exists(directory / kTableName, failed)) return table;
  const std::vector<std::byte> bytes = readBytes(directory / kTableName);
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::string header = tableHeaderLine();
  table.whole = text.starts_with(header);
  for (std::size_t end; (end = text.find('\n')) != text.npos; text.remove_prefix(end + 1)) {
    const std::string line(text.substr(0, end + 1));
    if (line == header) continue;
    try {
      bool torn = false;
      for (ArchiveRow& row : rowsFromTable(header + line, torn)) table.rows.push_back(row);
    } catch (const Error&) {
      table.whole = false;
    }
  }
  return table;
}

/// Which files the table should name. Files come first and rows last, and rows are superseded
/// before their files go, so a file that no row names is mostly one that none should name.
class Claims {
 public:
  Claims(const ReadableTable& table, const TimingsFile& timings,
         const std::vector<std::string>& files)
      : whole_(table.whole), unfinished_(unfinishedFolders(files, table.rows)) {
    std::set<long> cycles;
    for (const ArchiveRow& row : table.rows) {
      named_.insert(row.exr);
      steps_.insert({cycleFolderOf(row.exr), row.cycle, row.time});
      cycles.insert(row.cycle);
    }
    for (const auto& step : timings.steps)
      if (!cycles.contains(step.cycle)) lost_.insert(step.cycle);
  }

  bool names(const std::string& exr) const { return named_.contains(exr); }

  bool shouldName(const std::string& exr, const ProxyHeader& header) const {
    const std::string folder = cycleFolderOf(exr);
    if (names(exr) || steps_.contains({folder, header.cycle, header.time})) return true;
    return lost_.contains(header.cycle) || (!whole_ && !unfinished_.contains(folder));
  }

 private:
  bool whole_;
  std::set<std::string> unfinished_, named_;
  std::set<std::tuple<std::string, long, double>> steps_;
  std::set<long> lost_;  ///< cycles that only timings.csv names
};

/// The row of a sound proxy; throws what is wrong with it. A preview that is missing or damaged
/// costs no data: the row goes on without.
ArchiveRow rowOf(const fs::path& directory, const std::string& exr, const ExrFile& file,
                 std::vector<Finding>& leftOut) {
  const std::vector<std::string> problems = problemsOf(file);
  if (!problems.empty()) throw Error(ErrorCode::Format, problems.front());
  const ProxyHeader& h = file.header();
  ArchiveRow row{h.time, h.cycle, h.view, h.field, h.kind, exr, exr};
  validateName("view", row.view);
  validateName("field", row.field);
  validateName("proxy", row.proxy);
  const std::string png = exr.substr(0, exr.size() - 3) + "png";
  std::error_code failed;
  if (!fs::exists(directory / png, failed)) return row;
  try {
    if (readPng(directory / png).size != squarePixels(h.size, h.camera.pixelAspect))
      throw Error(ErrorCode::Format, "it is not as large as the proxy");
    row.png = png;
  } catch (const Error& e) {
    leftOut.push_back({png, e.what()});
  }
  return row;
}

/// What becomes of a file: a row, or findings, or both.
struct Examined {
  std::optional<ArchiveRow> row;
  std::vector<Finding> leftOut;
};

Examined examine(const fs::path& directory, const std::string& file, const Claims& claims) {
  Examined examined;
  try {
    const ExrFile exr(directory / file);
    if (!claims.shouldName(file, exr.header()))
      throw Error(ErrorCode::Format, "it is of a step that was not finished or is superseded");
    examined.row = rowOf(directory, file, exr, examined.leftOut);
  } catch (const Error& e) {
    examined.leftOut.push_back({file, e.what()});
  } catch (const std::bad_alloc&) {
    examined.leftOut.push_back({file, "it needs more memory than there is"});
  }
  return examined;
}

}  // namespace

std::vector<Finding> repairArchive(const fs::path& directory,
                                   const std::function<void(int, int)>& progress) {
  std::error_code failed;
  if (!fs::is_directory(directory, failed))
    throw Error(ErrorCode::NotFound, "'" + directory.string() + "' is no folder");
  if (!fs::exists(directory / kTableName, failed) && filesInCycles(directory).empty()) {
    throw Error(ErrorCode::NotFound, "'" + directory.string() + "' is no archive: it has neither " +
                                         std::string(kTableName) + " nor proxies");
  }
  const ArchiveLock lock(directory);
  const std::vector<std::string> files = filesInCycles(directory);
  const Claims claims(readableTable(directory), readTimings(directory), files);
  std::vector<std::string> exrs;
  std::copy_if(files.begin(), files.end(), std::back_inserter(exrs),
               [](const std::string& file) { return file.ends_with(".exr"); });
  std::vector<Examined> examined(exrs.size());
  forEachFile(
      int(exrs.size()),
      [&](int i) { examined[std::size_t(i)] = examine(directory, exrs[std::size_t(i)], claims); },
      progress);

  std::vector<Finding> leftOut;
  std::map<RowKey, ArchiveRow> rows;  // sorted by cycle, view, field, proxy
  for (Examined& each : examined) {
    std::move(each.leftOut.begin(), each.leftOut.end(), std::back_inserter(leftOut));
    if (!each.row) continue;
    ArchiveRow& row = *each.row;
    auto [it, isNew] = rows.emplace(keyOf(row), row);
    if (isNew) continue;
    // Of two files of one row, the old table's; else the later one.
    const auto rank = [&](const ArchiveRow& r) {
      return std::pair(claims.names(r.exr), generationOf(r.exr));
    };
    if (rank(row) > rank(it->second)) std::swap(it->second, row);
    leftOut.push_back(
        {row.exr, "'" + it->second.exr + "' is the same step, view, field and proxy"});
  }

  std::vector<ArchiveRow> table;
  std::set<long> cycles;
  for (auto& [key, row] : rows) {
    cycles.insert(row.cycle);
    table.push_back(std::move(row));
  }
  // In this order timings.csv names no step that the table lacks, whenever this is interrupted.
  keepTimings(directory, [&](long cycle) { return cycles.contains(cycle); });
  const std::string text = tableText(table);
  writeDurably(directory / kTableName, std::as_bytes(std::span(text.data(), text.size())));
  std::vector<std::string> temporaries = files;
  std::erase_if(temporaries, [](const std::string& file) { return !file.ends_with(".tmp"); });
  removeInside(directory, temporaries);
  fs::remove(directory / (std::string(kTimingsName) + ".tmp"), failed);
  return leftOut;
}

}  // namespace vestige
