// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "proxy/camera/raster.h"
#include "proxy/format/exr/exr_file.h"
#include "proxy/format/image/proxy_image.h"
#include "proxy/format/layout/feature_layout.h"
#include "proxy/format/layout/sliced_stack.h"

namespace vestige {

class ArchiveLock;

/// One row of data.csv: the columns time, cycle, view, field, proxy, FILE_exr, FILE
/// (docs/archive-format.md, "The table"). Paths are relative to the archive and stay inside it.
/// Without a preview, FILE names the EXR once more: Cinema has no empty cells.
struct ArchiveRow {
  double time = 0.0;
  long cycle = 0;
  std::string view, field, proxy;
  std::string exr, png;
  bool hasPreview() const { return png != exr; }
  friend bool operator==(const ArchiveRow&, const ArchiveRow&) = default;
};

/// Throws InvalidArgument naming `what` and the name unless a table cell can hold it: not empty, no
/// comma, quote, line break or other control character, no space at either end, not a number, at
/// most 255 bytes.
void validateName(const char* what, const std::string& name);

enum class ExistingArchive { Refuse, Append, Overwrite };

/// A proxy as it lies in an archive.
struct EncodedProxy {
  double time;
  long cycle;
  std::string view, field, kind;
  std::vector<std::byte> exr;
  std::vector<std::byte> png;  ///< of the preview; empty = none
};
/// Throws InvalidArgument when no table can hold the proxy's names, time or cycle, and as encodeExr
/// and encodePng.
EncodedProxy encodeProxy(const ProxyImage& image, const Raster* preview = nullptr);
EncodedProxy encodeProxy(const SlicedStack& stack, const Raster* preview = nullptr);
EncodedProxy encodeProxy(const FeatureStack& stack, const Raster* preview = nullptr);

/// Writes an archive, step by step; a step is in the table whole or not at all, and any prefix of
/// the history of writes opens cleanly. One writer at a time: it holds an advisory lock on the
/// folder. Not thread-safe.
class ArchiveWriter {
 public:
  /// Creates `directory` (and parents). Refuse throws Exists when it already holds a table;
  /// Overwrite removes the files its table names, and timings.csv; Append keeps it, repairs a torn
  /// last line and removes what an interrupted step left behind. A directory that is no archive but
  /// not empty is refused whatever the policy (Exists), and so is one that another writer holds.
  ArchiveWriter(std::filesystem::path directory, ExistingArchive policy);
  /// Takes away a table that it began, and its folder, if no step was written.
  ~ArchiveWriter();
  ArchiveWriter(const ArchiveWriter&) = delete;
  ArchiveWriter& operator=(const ArchiveWriter&) = delete;

  /// Writes the files of one step, all of one cycle that is later than those written before, and
  /// then its rows in one append. Rows of the same or later cycles from before an Append are
  /// superseded: the table is replaced by one without them and with the new step, then their files
  /// are deleted. Throws Io or NoSpace with path and reason; then no row of this step is in the
  /// table, its files are removed, and the next step may be tried. When the directory or its table
  /// vanished, the step fails with Io and the next one starts the table anew, with the rows whose
  /// files are still there.
  void writeStep(const std::vector<EncodedProxy>& proxies);

  /// Adds a proxy without a preview to a step that is there, or puts it in the place of the one of
  /// the same view, field and kind. The file first, then the table; whoever reads meanwhile sees
  /// the archive as before or as afterwards. Throws NotFound when there is no such cycle,
  /// InvalidArgument when its time differs or there is a preview, Format when the step's folder is
  /// not in the archive, else as writeStep.
  void addToStep(const EncodedProxy& proxy);

  const std::filesystem::path& directory() const { return directory_; }

 private:
  void takeOver(ExistingArchive policy);
  void recover();
  bool intact() const;
  std::vector<ArchiveRow> newRows(const std::vector<EncodedProxy>& proxies) const;
  void publish(const std::vector<ArchiveRow>& rows);
  void writeTable(const std::vector<ArchiveRow>& rows) const;

  std::filesystem::path directory_;
  std::unique_ptr<ArchiveLock> lock_;
  bool madeFolder_ = false, began_ = false;  ///< the folder; a table where there was none
  std::vector<ArchiveRow> rows_;             ///< the table
  std::size_t earlier_ = 0;  ///< of these, the first are of the run that we append to
  bool lost_ = false;        ///< the directory or its table vanished
};

/// Reads an archive. The constructor parses the table only; files open when asked for.
class Archive {
 public:
  /// Throws NotFound when there is no table, Format naming line and reason when it is damaged
  /// beyond a torn last line (which is ignored).
  explicit Archive(std::filesystem::path directory);

  const std::filesystem::path& directory() const { return directory_; }
  const std::vector<ArchiveRow>& rows() const& { return rows_; }
  std::vector<ArchiveRow> rows() && { return std::move(rows_); }
  /// Distinct values in order of appearance; cycles sorted.
  const std::vector<long>& cycles() const& { return cycles_; }
  std::vector<long> cycles() && { return std::move(cycles_); }
  std::vector<std::string> views() const;
  std::vector<std::string> fields() const;
  std::vector<std::string> proxies() const;
  double timeOf(long cycle) const;

  /// The row, or nullptr.
  const ArchiveRow* find(long cycle, const std::string& view, const std::string& field,
                         std::string_view proxy) const;
  /// Opens the EXR of a row (headers only). Throws as ExrFile, and Format when the file is a
  /// symbolic link or is reached by one that leaves the archive.
  ExrFile open(const ArchiveRow& row) const;

  /// Of the files that are opened: ExrFile. 1 until it is set.
  double lengthUnit() const { return lengthUnit_; }
  void setLengthUnit(double unit) { lengthUnit_ = unit; }

 private:
  std::filesystem::path directory_;
  std::vector<ArchiveRow> rows_;
  std::vector<long> cycles_;
  std::unordered_map<long, std::vector<std::size_t>> rowsOf_;  ///< of a cycle, in order
  double lengthUnit_ = 1.0;
};

/// One finding of checkArchive: what is wrong with which file, or with the table. A leftover is
/// what an interrupted run may leave and every reader ignores (a torn last line, files that no row
/// names); everything else is damage.
struct Finding {
  std::string file;
  std::string problem;
  bool leftover = false;
};

/// Verifies that the table is a valid Cinema Spec D table, that every file it names exists, lies
/// inside, decodes, agrees with its row and holds values in their stated ranges, that previews are
/// as large as their proxies and that timings.csv names no step that the table lacks; and names
/// files that no row mentions. Files are decoded on as many threads as there are cores;
/// `progress(done, total)`, which may be empty, is called by any of them, one at a time.
std::vector<Finding> checkArchive(const std::filesystem::path& directory,
                                  const std::function<void(int, int)>& progress = {});
/// Rebuilds data.csv from the sound files among those that it should name; returns what it left out
/// and why. These are the files that it does name, the others of a step that it names in part,
/// those of a step that only timings.csv names and, when it is missing or has lines that cannot be
/// read, all but those of a step whose writing was cut off. Drops other lines of timings.csv and
/// leftover
/// *.tmp files. Threads and `progress` as in checkArchive. Throws NotFound when there is no such
/// folder, Exists while a run writes to it.
std::vector<Finding> repairArchive(const std::filesystem::path& directory,
                                   const std::function<void(int, int)>& progress = {});

/// The text of a table, header line included; and back. Exposed for tests and for other writers.
std::string tableText(const std::vector<ArchiveRow>& rows);
std::vector<ArchiveRow> rowsFromTable(std::string_view text, bool& tornLastLine);
/// Its first line, and one line; each with the line break.
std::string tableHeaderLine();
std::string tableLine(const ArchiveRow& row);

}  // namespace vestige
