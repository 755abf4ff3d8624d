// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

namespace vestige {

/// The lock of an archive's one writer: an exclusive flock on its folder, for as long as this
/// lives. File systems without locks are written without one.
class ArchiveLock {
 public:
  /// Throws Exists when another run writes or repairs the archive, Io when the folder cannot be
  /// opened.
  explicit ArchiveLock(const std::filesystem::path& directory);
  ~ArchiveLock();
  ArchiveLock(const ArchiveLock&) = delete;
  ArchiveLock& operator=(const ArchiveLock&) = delete;

  /// Whether the folder at this path still is the one that was locked.
  bool isAt(const std::filesystem::path& directory) const;

 private:
  int folder_;
};

}  // namespace vestige
