// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "proxy/archive/archive.h"

namespace vestige {

/// Headers of an archive's files, whatever is damaged among them.
class HeaderReader {
 public:
  /// The archive outlives it.
  explicit HeaderReader(const Archive& archive) : archive_(archive) {}
  const Archive& archive() const { return archive_; }
  /// Nothing where the file cannot be read: it is remembered, with the reason.
  std::optional<ProxyHeader> header(const ArchiveRow& row);
  /// The same of the first of these rows whose file can be read.
  std::optional<ProxyHeader> firstOf(const std::vector<const ArchiveRow*>& rows);
  /// Reasons by file, as paths in the archive.
  const std::map<std::string, std::string>& damaged() const { return damaged_; }

 private:
  const Archive& archive_;
  std::map<std::string, std::string> damaged_;
};

}  // namespace vestige
