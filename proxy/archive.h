// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "proxy/exr_file.h"
#include "proxy/proxy_image.h"
#include "proxy/raster.h"

namespace vestige {

/// One row of data.csv: the columns time, cycle, view, field, proxy, FILE_exr, FILE (design.md
/// "Archive"). Paths are relative to the archive and stay inside it.
struct ArchiveRow {
  double time = 0.0;
  long cycle = 0;
  std::string view, field, proxy;
  std::string exr, png;
  friend bool operator==(const ArchiveRow&, const ArchiveRow&) = default;
};

enum class ExistingArchive { Refuse, Append, Overwrite };

/// Writes an archive, step by step; a step is in the table whole or not at all, and any prefix of
/// the history of writes opens cleanly. Not thread-safe.
class ArchiveWriter {
 public:
  /// Creates `directory` (and parents). Refuse throws Exists when it already holds a table;
  /// Overwrite removes the files its table names, and only those; Append keeps it and repairs a
  /// torn last line. A directory that is no archive but not empty is refused whatever the policy.
  ArchiveWriter(std::filesystem::path directory, ExistingArchive policy);

  /// A proxy and its preview, to be written with the step.
  struct Entry {
    const ProxyImage* image;
    const Raster* preview;
  };
  struct Written {
    std::uint64_t bytes = 0;
    double encodeSeconds = 0.0;
    double writeSeconds = 0.0;
  };
  /// Writes the files of one step and then its rows in one append. Rows of the same or later
  /// cycles from before an Append are superseded: dropped from the table, then deleted. Throws Io
  /// or NoSpace with path and reason; then no row of this step is in the table, its files are
  /// removed, and the next step may be tried.
  Written writeStep(const std::vector<Entry>& entries);

  const std::filesystem::path& directory() const { return directory_; }

 private:
  std::filesystem::path directory_;
  std::vector<ArchiveRow> earlier_;  ///< rows of the run that we append to
};

/// Reads an archive. The constructor parses the table only; files open when asked for.
class Archive {
 public:
  /// Throws NotFound when there is no table, Format naming line and reason when it is damaged
  /// beyond a torn last line (which is ignored).
  explicit Archive(std::filesystem::path directory);

  const std::filesystem::path& directory() const { return directory_; }
  const std::vector<ArchiveRow>& rows() const { return rows_; }
  /// Distinct values in order of appearance; cycles sorted.
  std::vector<long> cycles() const;
  std::vector<std::string> views() const;
  std::vector<std::string> fields() const;
  std::vector<std::string> proxies() const;
  double timeOf(long cycle) const;

  /// The row, or nullptr.
  const ArchiveRow* find(long cycle, const std::string& view, const std::string& field,
                         std::string_view proxy) const;
  /// Opens the EXR of a row (headers only).
  ExrFile open(const ArchiveRow& row) const;

 private:
  std::filesystem::path directory_;
  std::vector<ArchiveRow> rows_;
};

/// One finding of checkArchive: what is wrong with which file, or with the table.
struct Finding {
  std::string file;
  std::string problem;
};

/// Verifies that the table is a valid Cinema Spec D table, that every file it names exists, lies
/// inside, decodes, agrees with its row and holds values in their stated ranges, and names files
/// that no row mentions. `progress(done, total)` may be empty.
std::vector<Finding> checkArchive(const std::filesystem::path& directory,
                                  const std::function<void(int, int)>& progress = {});
/// Rebuilds data.csv from the EXR files that decode; returns what it left out and why. Removes
/// leftover *.tmp files.
std::vector<Finding> repairArchive(const std::filesystem::path& directory);

/// The text of a table, header line included; and back. Exposed for tests and for other writers.
std::string tableText(const std::vector<ArchiveRow>& rows);
std::vector<ArchiveRow> rowsFromTable(std::string_view text, bool& tornLastLine);

}  // namespace vestige
