// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <tuple>

#include "proxy/archive/archive.h"
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

/// The rows of the table, or none and findings.
std::vector<ArchiveRow> readTable(const fs::path& directory, std::vector<Finding>& findings) {
  try {
    std::vector<std::byte> bytes = readBytes(directory / kTableName);
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    // The first table is renamed into place whole: no interruption leaves less than its first line.
    if (text.find('\n') == text.npos)
      findings.push_back({kTableName, text.empty() ? "it is empty" : "its first line is cut off"});
    bool torn = false;
    std::vector<ArchiveRow> rows = rowsFromTable(text, torn);
    if (torn && findings.empty()) findings.push_back({kTableName, "its last line is torn", true});
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
  // Runs `check` on a file, what it throws is a finding; whether it threw nothing.
  const auto examine = [&](const std::string& file, const auto& check) {
    const auto report = [&](std::string problem) {
      findings.push_back({file, std::move(problem)});
      return false;
    };
    try {
      std::error_code failed;
      if (!fs::exists(directory / file, failed))
        return report("the table names it, but it does not exist");
      if (!liesInside(directory, file)) return report("it is a link that leaves the archive");
      check(report);
      return true;
    } catch (const Error& e) {
      return report(e.what());
    } catch (const std::bad_alloc&) {
      return report("it needs more memory than there is");
    }
  };
  ImageSize size;
  const bool opened = examine(row.exr, [&](const auto& report) {
    const ExrFile file(directory / row.exr);
    size = squarePixels(file.header().size, file.header().camera.pixelAspect);
    if (std::string difference = differenceFrom(row, file.header()); !difference.empty())
      report(difference);
    for (std::string& problem : problemsOf(file)) report(std::move(problem));
  });
  if (!row.hasPreview()) return;
  examine(row.png, [&](const auto& report) {
    const ImageSize preview = readPng(directory / row.png).size;
    if (opened && preview != size)
      report(fmt::format("it has {} x {} pixels, the proxy's picture {} x {}", preview.width,
                         preview.height, size.width, size.height));
  });
}

/// Duplicates, and a cycle with two times.
void checkRows(const std::vector<ArchiveRow>& rows, std::vector<Finding>& findings) {
  std::set<RowKey> seen;
  std::map<std::string, int> files;
  std::map<long, double> times;
  for (const ArchiveRow& row : rows) {
    auto report = [&](const std::string& problem) {
      findings.push_back(
          {kTableName, fmt::format("cycle {}, view '{}', field '{}', proxy '{}': {}", row.cycle,
                                   row.view, row.field, row.proxy, problem)});
    };
    if (!seen.insert(keyOf(row)).second) report("this row comes twice");
    for (const std::string& file : std::set<std::string>{row.exr, row.png})
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
  for (const char* name : {kTableName, kTimingsName}) {
    const std::string temporary = std::string(name) + ".tmp";
    std::error_code ignored;
    if (fs::exists(directory / temporary, ignored))
      findings.push_back({temporary, "a write that was cut off left it", true});
  }
}

/// A step's line of timings.csv comes after its rows: a step that has the one had the others.
void checkTimings(const fs::path& directory, const std::vector<ArchiveRow>& rows,
                  std::vector<Finding>& findings) {
  std::map<long, double> times;
  for (const ArchiveRow& row : rows) times.emplace(row.cycle, row.time);
  try {
    const TimingsFile timings = readTimings(directory);
    for (const auto& problem : timings.problems)
      findings.push_back({kTimingsName, problem.text, problem.leftover});
    for (const auto& step : timings.steps) {
      const auto known = times.find(step.cycle);
      if (known == times.end())
        findings.push_back(
            {kTableName, fmt::format("it has no row of cycle {}, which {} names in line {}",
                                     step.cycle, kTimingsName, step.line)});
      else if (step.time && *step.time != known->second)
        findings.push_back({kTimingsName, fmt::format("line {}: its time is {}, the table says {}",
                                                      step.line, *step.time, known->second)});
    }
  } catch (const Error& e) {
    findings.push_back({kTimingsName, e.what()});
  }
}

}  // namespace

std::vector<Finding> checkArchive(const fs::path& directory,
                                  const std::function<void(int, int)>& progress) {
  std::vector<Finding> findings;
  std::vector<ArchiveRow> rows = readTable(directory, findings);
  checkRows(rows, findings);
  std::vector<std::vector<Finding>> ofRow(rows.size());
  forEachFile(
      int(rows.size()),
      [&](int i) { checkRow(directory, rows[std::size_t(i)], ofRow[std::size_t(i)]); }, progress);
  for (std::vector<Finding>& found : ofRow)
    std::move(found.begin(), found.end(), std::back_inserter(findings));
  checkTimings(directory, rows, findings);
  checkUnnamedFiles(directory, rows, findings);
  return findings;
}

}  // namespace vestige
