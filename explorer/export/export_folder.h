// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <set>
#include <string>

namespace vestige {

/// A folder that exports write to, created where missing. Files that its manifest.json names are an
/// earlier export's and are written anew; all others stay as they are.
class ExportFolder {
 public:
  /// Throws Exists for an archive and any folder in one, Io where the folder cannot be created.
  explicit ExportFolder(std::filesystem::path folder);
  /// The path of a file to be written. Throws Exists where one is there that no export wrote.
  std::filesystem::path file(const std::string& name) const;
  const std::filesystem::path& path() const { return folder_; }

 private:
  std::filesystem::path folder_;
  std::set<std::string> ours_;
};

}  // namespace vestige
