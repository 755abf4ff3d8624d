// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "proxy/archive.h"
#include "proxy/archive_paths.h"
#include "proxy/durable_file.h"
#include "proxy/error.h"

namespace vestige {
namespace {

template <typename Value, typename Member>
std::vector<Value> distinct(const std::vector<ArchiveRow>& rows, Member member) {
  std::vector<Value> values;
  for (const ArchiveRow& row : rows) {
    const Value& value = row.*member;
    // Rows come in runs: the value is mostly the last one.
    if (!values.empty() && values.back() == value) continue;
    if (std::find(values.rbegin(), values.rend(), value) == values.rend()) values.push_back(value);
  }
  return values;
}

}  // namespace

Archive::Archive(std::filesystem::path directory) : directory_(std::move(directory)) {
  std::filesystem::path table = directory_ / kTableName;
  std::error_code failed;
  if (!std::filesystem::exists(directory_, failed))
    throw Error(ErrorCode::NotFound, "archive '" + directory_.string() + "' does not exist");
  if (!std::filesystem::exists(table, failed))
    throw Error(ErrorCode::NotFound,
                "'" + directory_.string() + "' is no archive: it has no " + kTableName);
  std::vector<std::byte> bytes = readBytes(table);
  bool torn = false;
  try {
    rows_ = rowsFromTable({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, torn);
  } catch (const Error& e) {
    throw Error(e.code(), "archive '" + directory_.string() + "': " + e.what());
  }
}

std::vector<long> Archive::cycles() const {
  std::vector<long> cycles = distinct<long>(rows_, &ArchiveRow::cycle);
  std::sort(cycles.begin(), cycles.end());
  return cycles;
}
std::vector<std::string> Archive::views() const {
  return distinct<std::string>(rows_, &ArchiveRow::view);
}
std::vector<std::string> Archive::fields() const {
  return distinct<std::string>(rows_, &ArchiveRow::field);
}
std::vector<std::string> Archive::proxies() const {
  return distinct<std::string>(rows_, &ArchiveRow::proxy);
}

double Archive::timeOf(long cycle) const {
  for (const ArchiveRow& row : rows_)
    if (row.cycle == cycle) return row.time;
  throw Error(ErrorCode::NotFound,
              "archive '" + directory_.string() + "' has no cycle " + std::to_string(cycle));
}

const ArchiveRow* Archive::find(long cycle, const std::string& view, const std::string& field,
                                std::string_view proxy) const {
  for (const ArchiveRow& row : rows_)
    if (row.cycle == cycle && row.proxy == proxy && row.field == field && row.view == view)
      return &row;
  return nullptr;
}

ExrFile Archive::open(const ArchiveRow& row) const {
  std::error_code failed;
  if (std::filesystem::exists(directory_ / row.exr, failed) && !liesInside(directory_, row.exr))
    throw Error(ErrorCode::Format,
                "'" + (directory_ / row.exr).string() + "' is a link or leaves the archive");
  return ExrFile(directory_ / row.exr);
}

}  // namespace vestige
