// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "proxy/archive.h"
#include "proxy/archive_paths.h"
#include "proxy/durable_file.h"
#include "proxy/error.h"
#include "proxy/png_file.h"
#include "proxy/proxy_check.h"

namespace vestige {
namespace {

namespace fs = std::filesystem;

using Key = std::tuple<long, std::string, std::string, std::string>;
Key keyOf(const ArchiveRow& row) { return {row.cycle, row.view, row.field, row.proxy}; }

/// The rows of the table, or none and findings.
std::vector<ArchiveRow> readTable(const fs::path& directory, std::vector<Finding>& findings) {
  try {
    std::vector<std::byte> bytes = readBytes(directory / kTableName);
    bool torn = false;
    std::vector<ArchiveRow> rows =
        rowsFromTable({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, torn);
    if (torn) findings.push_back({kTableName, "its last line is torn", true});
    return rows;
  } catch (const Error& e) {
    findings.push_back({kTableName, e.what()});
    return {};
  }
}

std::string differenceFrom(const ArchiveRow& row, const ProxyHeader& header) {
  if (header.time != row.time)
    return fmt::format("its time is {}, the table says {}", header.time, row.time);
  if (header.cycle != row.cycle)
    return fmt::format("its cycle is {}, the table says {}", header.cycle, row.cycle);
  const std::tuple<const char*, const std::string*, const std::string*> names[] = {
      {"view", &header.view, &row.view},
      {"field", &header.field, &row.field},
      {"kind", &header.kind, &row.proxy}};
  for (auto [what, mine, theirs] : names)
    if (*mine != *theirs)
      return fmt::format("its {} is '{}', the table says '{}'", what, *mine, *theirs);
  return {};
}

void checkRow(const fs::path& directory, const ArchiveRow& row, std::vector<Finding>& findings) {
  for (const std::string& file : {row.exr, row.png}) {
    try {
      std::error_code failed;
      if (!fs::exists(directory / file, failed)) {
        findings.push_back({file, "the table names it, but it does not exist"});
        continue;
      }
      if (!liesInside(directory, file)) {
        findings.push_back({file, "it is a link that leaves the archive"});
        continue;
      }
      if (file == row.png) {
        readPng(directory / file);
        continue;
      }
      ProxyImage image = ExrFile(directory / file).image();
      if (std::string difference = differenceFrom(row, image.header); !difference.empty())
        findings.push_back({file, difference});
      for (std::string& problem : problemsOf(image)) findings.push_back({file, std::move(problem)});
    } catch (const Error& e) {
      findings.push_back({file, e.what()});
    } catch (const std::bad_alloc&) {
      findings.push_back({file, "it needs more memory than there is"});
    }
  }
}

/// Duplicates, and a cycle with two times.
void checkRows(const std::vector<ArchiveRow>& rows, std::vector<Finding>& findings) {
  std::set<Key> seen;
  std::map<std::string, int> files;
  std::map<long, double> times;
  for (const ArchiveRow& row : rows) {
    auto report = [&](const std::string& problem) {
      findings.push_back(
          {kTableName, fmt::format("cycle {}, view '{}', field '{}', proxy '{}': {}", row.cycle,
                                   row.view, row.field, row.proxy, problem)});
    };
    if (!seen.insert(keyOf(row)).second) report("this row comes twice");
    for (const std::string& file : {row.exr, row.png})
      if (++files[file] == 2) report(fmt::format("file '{}' belongs to another row too", file));
    auto [it, isNew] = times.emplace(row.cycle, row.time);
    if (!isNew && it->second != row.time)
      report(fmt::format("its time is {}, another row of the cycle has {}", row.time, it->second));
  }
}

void checkUnnamedFiles(const fs::path& directory, const std::vector<ArchiveRow>& rows,
                       std::vector<Finding>& findings) {
  std::set<std::string> named;
  for (const ArchiveRow& row : rows) named.insert({row.exr, row.png});
  for (const std::string& file : filesInCycles(directory)) {
    if (named.count(file)) continue;
    findings.push_back({file,
                        file.ends_with(".tmp") ? "a write that was cut off left it"
                                               : "no row of the table names it",
                        true});
  }
  std::error_code ignored;
  if (fs::exists(directory / (std::string(kTableName) + ".tmp"), ignored))
    findings.push_back(
        {std::string(kTableName) + ".tmp", "a write that was cut off left it", true});
}

}  // namespace

std::vector<Finding> checkArchive(const fs::path& directory,
                                  const std::function<void(int, int)>& progress) {
  std::vector<Finding> findings;
  std::vector<ArchiveRow> rows = readTable(directory, findings);
  checkRows(rows, findings);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    checkRow(directory, rows[i], findings);
    if (progress) progress(int(i) + 1, int(rows.size()));
  }
  checkUnnamedFiles(directory, rows, findings);
  return findings;
}

std::vector<Finding> repairArchive(const fs::path& directory) {
  std::error_code failed;
  if (!fs::is_directory(directory, failed))
    throw Error(ErrorCode::NotFound, "'" + directory.string() + "' is no folder");
  std::vector<Finding> leftOut, unread;
  std::set<std::string> inTable;
  for (const ArchiveRow& row : readTable(directory, unread)) inTable.insert(row.exr);

  std::map<Key, ArchiveRow> rows;  // sorted by cycle, view, field, proxy
  std::vector<std::string> temporaries;
  for (const std::string& file : filesInCycles(directory)) {
    if (file.ends_with(".tmp")) temporaries.push_back(file);
    if (!file.ends_with(".exr")) continue;
    try {
      ProxyImage image = ExrFile(directory / file).image();
      std::vector<std::string> problems = problemsOf(image);
      if (!problems.empty()) throw Error(ErrorCode::Format, problems.front());
      const ProxyHeader& h = image.header;
      ArchiveRow row{
          h.time, h.cycle, h.view, h.field, h.kind, file, file.substr(0, file.size() - 3) + "png"};
      validateName("view", row.view);
      validateName("field", row.field);
      validateName("proxy", row.proxy);
      readPng(directory / row.png);
      auto [it, isNew] = rows.emplace(keyOf(row), row);
      if (isNew) continue;
      // Of two files of one row, the old table's; else the later one.
      auto rank = [&](const ArchiveRow& r) {
        return std::pair(inTable.count(r.exr), generationOf(r.exr));
      };
      if (rank(row) > rank(it->second)) std::swap(it->second, row);
      leftOut.push_back(
          {row.exr, "'" + it->second.exr + "' is the same step, view, field and proxy"});
    } catch (const Error& e) {
      leftOut.push_back({file, e.what()});
    } catch (const std::bad_alloc&) {
      leftOut.push_back({file, "it needs more memory than there is"});
    }
  }
  std::vector<ArchiveRow> table;
  for (auto& [key, row] : rows) table.push_back(std::move(row));
  std::string text = tableText(table);
  writeDurably(directory / kTableName, std::as_bytes(std::span(text.data(), text.size())));
  removeInside(directory, temporaries);
  return leftOut;
}

}  // namespace vestige
