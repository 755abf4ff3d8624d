// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

namespace vestige {

/// Writes `bytes` to path.tmp, fsyncs, renames to `path`. On failure the temporary file is gone,
/// `path` is as before, and Io or NoSpace (ENOSPC, EDQUOT, EFBIG) is thrown with path and reason.
/// SIGXFSZ and SIGPIPE never reach the process: they are blocked on the calling thread and a
/// pending one that this write raised is consumed.
void writeDurably(const std::filesystem::path& path, std::span<const std::byte> bytes);
/// Appends in one write and fsyncs; on a short write truncates back to the old size. As above.
void appendDurably(const std::filesystem::path& path, std::string_view text);

}  // namespace vestige
