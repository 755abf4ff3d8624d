// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/inspect/header_reader.h"

#include "proxy/base/error.h"

namespace vestige {

std::optional<ProxyHeader> HeaderReader::header(const ArchiveRow& row) {
  if (damaged_.contains(row.exr)) return std::nullopt;
  try {
    return archive_.open(row).header();
  } catch (const Error& error) {
    damaged_.emplace(row.exr, error.what());
    return std::nullopt;
  }
}

std::optional<ProxyHeader> HeaderReader::firstOf(const std::vector<const ArchiveRow*>& rows) {
  for (const ArchiveRow* row : rows)
    if (auto found = header(*row)) return found;
  return std::nullopt;
}

}  // namespace vestige
