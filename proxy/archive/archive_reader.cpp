// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "proxy/archive/archive.h"
#include "proxy/archive/archive_paths.h"
#include "proxy/base/durable_file.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

template <typename Member>
std::vector<std::string> distinct(const std::vector<ArchiveRow>& rows, Member member) {
  std::vector<std::string> values;
  for (const ArchiveRow& row : rows) {
    const std::string& value = row.*member;
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
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    std::vector<std::size_t>& those = rowsOf_[rows_[i].cycle];
    if (those.empty()) cycles_.push_back(rows_[i].cycle);
    those.push_back(i);
  }
  std::sort(cycles_.begin(), cycles_.end());
}

std::vector<std::string> Archive::views() const { return distinct(rows_, &ArchiveRow::view); }
std::vector<std::string> Archive::fields() const { return distinct(rows_, &ArchiveRow::field); }
std::vector<std::string> Archive::proxies() const { return distinct(rows_, &ArchiveRow::proxy); }

double Archive::timeOf(long cycle) const {
  const auto found = rowsOf_.find(cycle);
  if (found != rowsOf_.end()) return rows_[found->second.front()].time;
  throw Error(ErrorCode::NotFound,
              "archive '" + directory_.string() + "' has no cycle " + std::to_string(cycle));
}

const ArchiveRow* Archive::find(long cycle, const std::string& view, const std::string& field,
                                std::string_view proxy) const {
  const auto those = rowsOf_.find(cycle);
  if (those == rowsOf_.end()) return nullptr;
  for (const std::size_t i : those->second) {
    const ArchiveRow& row = rows_[i];
    if (row.proxy == proxy && row.field == field && row.view == view) return &row;
  }
  return nullptr;
}

ExrFile Archive::open(const ArchiveRow& row) const {
  std::error_code failed;
  if (std::filesystem::exists(directory_ / row.exr, failed) && !liesInside(directory_, row.exr))
    throw Error(ErrorCode::Format,
                "'" + (directory_ / row.exr).string() + "' is a link or leaves the archive");
  return ExrFile(directory_ / row.exr, lengthUnit_);
}

}  // namespace vestige
