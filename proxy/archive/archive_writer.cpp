// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <span>
#include <system_error>
#include <utility>

#include "proxy/archive/archive.h"
#include "proxy/archive/archive_lock.h"
#include "proxy/archive/archive_paths.h"
#include "proxy/base/durable_file.h"
#include "proxy/base/error.h"
#include "proxy/format/exr/png_file.h"
#include "proxy/archive/timings_file.h"

namespace vestige {
namespace {

namespace fs = std::filesystem;

/// What may lie in a folder that a writer can take although it has no table: nothing, or the
/// first table's temporary file.
bool isFresh(const fs::path& directory) {
  std::error_code failed;
  for (fs::directory_iterator it(directory, failed), end; !failed && it != end;
       it.increment(failed))
    if (it->path().filename() != std::string(kTableName) + ".tmp") return false;
  if (failed)
    throw Error(ErrorCode::Io,
                fmt::format("cannot read folder '{}': {}", directory.string(), failed.message()));
  return true;
}

std::vector<std::string> filesOf(std::span<const ArchiveRow> rows) {
  std::vector<std::string> files;
  for (const ArchiveRow& row : rows) {
    files.push_back(row.exr);
    files.push_back(row.png);
  }
  return files;
}

/// Deletes what a write that was cut off left under temporary names, and the files of a step that
/// was being placed. Other whole files that no row names stay: they may be all that is left of a
/// damaged table.
void removeUnfinished(const fs::path& directory, const std::vector<ArchiveRow>& rows) {
  std::vector<std::string> files = filesInCycles(directory);
  const std::set<std::string> unfinished = unfinishedFolders(files, rows);
  std::erase_if(files, [&](const std::string& file) {
    return !file.ends_with(".tmp") && !unfinished.contains(cycleFolderOf(file));
  });
  removeInside(directory, files);
  std::error_code ignored;
  for (const char* name : {kTableName, kTimingsName})
    fs::remove(directory / (std::string(name) + ".tmp"), ignored);
}

}  // namespace

namespace {

/// All of it but the file.
EncodedProxy encodedProxy(const ProxyHeader& header, std::string kind, const Raster* preview) {
  validateName("view", header.view);
  validateName("field", header.field);
  validateName("proxy", kind);
  if (!std::isfinite(header.time) || header.cycle < 0)
    throw Error(
        ErrorCode::InvalidArgument,
        fmt::format("a step at time {} and cycle {} cannot be stored", header.time, header.cycle));
  return {header.time,
          header.cycle,
          header.view,
          header.field,
          std::move(kind),
          {},
          preview ? encodePng(*preview) : std::vector<std::byte>{}};
}

}  // namespace

EncodedProxy encodeProxy(const ProxyImage& image, const Raster* preview) {
  EncodedProxy proxy = encodedProxy(image.header, image.header.kind, preview);
  proxy.exr = encodeExr(image);
  return proxy;
}

EncodedProxy encodeProxy(const SlicedStack& stack, const Raster* preview) {
  EncodedProxy proxy = encodedProxy(stack.header, std::string(kind::kSliced), preview);
  proxy.exr = encodeStack(stack);
  return proxy;
}

EncodedProxy encodeProxy(const FeatureStack& stack, const Raster* preview) {
  EncodedProxy proxy = encodedProxy(stack.header, std::string(kind::kSlicedFeatures), preview);
  proxy.exr = encodeFeatureStack(stack);
  return proxy;
}

ArchiveWriter::ArchiveWriter(fs::path directory, ExistingArchive policy)
    : directory_(fs::absolute(directory)) {
  std::error_code failed;
  madeFolder_ = !fs::exists(directory_, failed);
  createFoldersDurably(directory_);
  lock_ = std::make_unique<ArchiveLock>(directory_);
  takeOver(policy);
}

ArchiveWriter::~ArchiveWriter() {
  std::error_code ignored;
  const fs::path table = directory_ / kTableName;
  if (!began_ || !rows_.empty() || !intact() ||
      fs::file_size(table, ignored) != tableHeaderLine().size())
    return;
  fs::remove(table, ignored);
  if (madeFolder_) fs::remove(directory_, ignored);  // unless something else lies there
}

void ArchiveWriter::takeOver(ExistingArchive policy) {
  const fs::path table = directory_ / kTableName;
  std::error_code failed;
  if (!fs::exists(fs::symlink_status(table, failed))) {
    if (!isFresh(directory_))
      throw Error(
          ErrorCode::Exists,
          "'" + directory_.string() + "' is neither empty nor an archive: it has no " + kTableName);
    writeTable({});
    began_ = true;
    return;
  }
  if (policy == ExistingArchive::Refuse)
    throw Error(ErrorCode::Exists, "archive '" + directory_.string() +
                                       "' exists already; append, overwrite or choose another");
  rows_ = Archive(directory_).rows();
  if (policy == ExistingArchive::Overwrite) {
    // First the times, then the rows, then the files: at no moment does one name what is gone.
    fs::remove(directory_ / kTimingsName, failed);
    std::vector<std::string> files = filesOf(rows_);
    rows_.clear();
    writeTable({});
    removeInside(directory_, files);
  } else {
    if (readBytes(table).size() != tableText(rows_).size()) writeTable(rows_);
    keepTimings(directory_, [](long) { return true; });  // without what was cut off
  }
  removeUnfinished(directory_, rows_);
  earlier_ = rows_.size();
}

bool ArchiveWriter::intact() const {
  std::error_code failed;
  return lock_ && lock_->isAt(directory_) && fs::exists(directory_ / kTableName, failed);
}

void ArchiveWriter::recover() {
  createFoldersDurably(directory_);
  lock_.reset();
  lock_ = std::make_unique<ArchiveLock>(directory_);
  std::vector<ArchiveRow> kept;
  std::size_t keptEarlier = 0;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    std::error_code failed;
    if (!fs::exists(directory_ / rows_[i].exr, failed) ||
        !fs::exists(directory_ / rows_[i].png, failed))
      continue;
    kept.push_back(rows_[i]);
    if (i < earlier_) ++keptEarlier;
  }
  std::set<long> cycles;
  for (const ArchiveRow& row : kept) cycles.insert(row.cycle);
  keepTimings(directory_, [&](long cycle) { return cycles.contains(cycle); });
  writeTable(kept);
  rows_ = std::move(kept);
  earlier_ = keptEarlier;
  lost_ = false;
}

void ArchiveWriter::writeTable(const std::vector<ArchiveRow>& rows) const {
  std::string text = tableText(rows);
  writeDurably(directory_ / kTableName, std::as_bytes(std::span(text.data(), text.size())));
}

std::vector<ArchiveRow> ArchiveWriter::newRows(const std::vector<EncodedProxy>& proxies) const {
  std::vector<ArchiveRow> rows;
  std::set<std::string> stems;
  const EncodedProxy& first = proxies.front();
  for (const EncodedProxy& p : proxies) {
    if (p.cycle != first.cycle || p.time != first.time)
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("one step has cycles {} and {} or times {} and {}", first.cycle,
                              p.cycle, first.time, p.time));
    rows.push_back({p.time, p.cycle, p.view, p.field, p.kind, {}, {}});
    if (!stems.insert(stemFor(p.cycle, p.view, p.field, p.kind, 1)).second)
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("one step has the {} proxy of field '{}' in view '{}' twice", p.kind,
                              p.field, p.view));
  }
  long cycle = rows.front().cycle;
  if (rows_.size() > earlier_ && cycle <= rows_.back().cycle)
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("cycle {} does not come after cycle {}", cycle, rows_.back().cycle));
  // Files of superseded rows stay until the new table is in place, and those of a step that was not
  // finished may be there too: ours get a folder of their own.
  int generation = 1;
  std::error_code ignored;
  const auto folder = [&] { return cycleFolderOf(stemFor(cycle, "v", "f", "p", generation)); };
  while (fs::exists(fs::symlink_status(directory_ / folder(), ignored))) ++generation;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    ArchiveRow& row = rows[i];
    std::string stem = stemFor(row.cycle, row.view, row.field, row.proxy, generation);
    row.exr = stem + ".exr";
    row.png = !proxies[i].png.empty() ? stem + ".png" : row.exr;
  }
  return rows;
}

void ArchiveWriter::publish(const std::vector<ArchiveRow>& rows) {
  const long cycle = rows.front().cycle;
  // The first step of a run supersedes what an earlier one wrote of later cycles.
  if (rows_.size() == earlier_) keepTimings(directory_, [&](long timed) { return timed < cycle; });
  auto superseded = [&](const ArchiveRow& row) { return row.cycle >= cycle; };
  auto firstNew = rows_.begin() + std::ptrdiff_t(earlier_);
  if (std::none_of(rows_.begin(), firstNew, superseded)) {
    std::string lines;
    for (const ArchiveRow& row : rows) lines += tableLine(row);
    appendDurably(directory_ / kTableName, lines, true);
    rows_.insert(rows_.end(), rows.begin(), rows.end());
    return;
  }
  std::vector<ArchiveRow> table, dropped;
  for (auto it = rows_.begin(); it != rows_.end(); ++it)
    (it < firstNew && superseded(*it) ? dropped : table).push_back(*it);
  const std::size_t keptEarlier = earlier_ - dropped.size();
  table.insert(table.end(), rows.begin(), rows.end());
  writeTable(table);
  rows_ = std::move(table);
  earlier_ = keptEarlier;
  removeInside(directory_, filesOf(dropped));
}

void ArchiveWriter::writeStep(const std::vector<EncodedProxy>& proxies) try {
  if (proxies.empty()) return;
  if (lost_) recover();
  if (!intact())
    throw Error(ErrorCode::Io, "archive '" + directory_.string() +
                                   "' or its table was removed while it was being written");
  const std::vector<ArchiveRow> rows = newRows(proxies);
  DurableBatch batch(directory_);
  for (std::size_t i = 0; i < proxies.size(); ++i) {
    batch.add(rows[i].exr, proxies[i].exr);
    if (rows[i].hasPreview()) batch.add(rows[i].png, proxies[i].png);
  }
  batch.place();
  publish(rows);
  batch.keep();
} catch (...) {
  lost_ = !intact();
  throw;
}

void ArchiveWriter::addToStep(const EncodedProxy& proxy) try {
  if (lost_) recover();
  if (!intact())
    throw Error(ErrorCode::Io, "archive '" + directory_.string() +
                                   "' or its table was removed while it was being written");
  if (!proxy.png.empty())
    throw Error(ErrorCode::InvalidArgument, "proxies are added to a step without a preview");
  const auto sameCycle = [&](const ArchiveRow& row) { return row.cycle == proxy.cycle; };
  const auto first = std::find_if(rows_.begin(), rows_.end(), sameCycle);
  if (first == rows_.end())
    throw Error(ErrorCode::NotFound,
                fmt::format("archive '{}' has no cycle {}", directory_.string(), proxy.cycle));
  if (first->time != proxy.time)
    throw Error(ErrorCode::InvalidArgument, fmt::format("cycle {} is at time {}, not {}",
                                                        proxy.cycle, first->time, proxy.time));
  const auto place = [&](const std::string& path) {
    if (!liesInside(directory_, path))
      throw Error(ErrorCode::Format,
                  "'" + (directory_ / path).string() + "' is a link or leaves the archive");
    writeDurably(directory_ / path, proxy.exr);
  };
  const auto end = std::find_if_not(first, rows_.end(), sameCycle);
  const auto same = std::find_if(first, end, [&](const ArchiveRow& row) {
    return row.view == proxy.view && row.field == proxy.field && row.proxy == proxy.kind;
  });
  if (same != end) return place(same->exr);

  // In a folder of the step's: there, check --repair finds it if the table is lost.
  const auto beside =
      std::find_if(first, end, [&](const ArchiveRow& row) { return row.view == proxy.view; });
  const fs::path folder = fs::path((beside != end ? beside : first)->exr).parent_path();
  const fs::path name =
      fs::path(stemFor(proxy.cycle, proxy.view, proxy.field, proxy.kind, 1) + ".exr").filename();
  const std::string path = (folder / name).generic_string();
  if (std::any_of(rows_.begin(), rows_.end(),
                  [&](const ArchiveRow& row) { return row.exr == path; }))
    throw Error(ErrorCode::Format, "'" + path + "' is the file of another proxy");
  place(path);
  const ArchiveRow row{proxy.time, proxy.cycle, proxy.view, proxy.field, proxy.kind, path, path};
  const auto position = std::size_t(end - rows_.begin());
  std::vector<ArchiveRow> table = rows_;
  table.insert(table.begin() + std::ptrdiff_t(position), row);
  try {
    if (position == rows_.size())
      appendDurably(directory_ / kTableName, tableLine(row), true);
    else
      writeTable(table);
  } catch (...) {
    removeInside(directory_, {path});
    throw;
  }
  rows_ = std::move(table);
  if (position <= earlier_) ++earlier_;
} catch (...) {
  lost_ = !intact();
  throw;
}

}  // namespace vestige
