// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/archive/archive_paths.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdint>

namespace vestige {
namespace {

namespace fs = std::filesystem;

std::uint32_t fnv1a(const std::string& text) {
  std::uint32_t hash = 2166136261u;
  for (unsigned char c : text) hash = (hash ^ c) * 16777619u;
  return hash;
}

/// A name that every file system can hold. Names that had to be changed carry a hash of what they
/// were, so that two of them do not meet; so do names with capitals, for file systems that ignore
/// case.
std::string fileNameFor(const std::string& name) {
  constexpr std::size_t kLongest = 80;
  std::string out;
  bool changed = name.size() > kLongest;
  for (char c : name.substr(0, kLongest)) {
    bool plain =
        (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '+';
    bool capital = c >= 'A' && c <= 'Z';
    changed |= !plain;
    out += plain || capital ? c : '_';
  }
  return changed ? fmt::format("{}-{:08x}", out, fnv1a(name)) : out;
}

bool isCycleFolder(const std::string& name) {
  if (name.size() < 9 || name[0] != 'c') return false;
  std::size_t digits = name.find_first_not_of("0123456789", 1);
  if (digits == std::string::npos) return true;
  return digits >= 9 && name[digits] == '-' &&
         name.find_first_not_of("0123456789", digits + 1) == std::string::npos;
}

}  // namespace

std::string stemFor(long cycle, const std::string& view, const std::string& field,
                    const std::string& proxy, int generation) {
  std::string folder = fmt::format("c{:08d}", cycle);
  if (generation > 1) folder += fmt::format("-{}", generation);
  return fmt::format("{}/{}/{}.{}", folder, fileNameFor(view), fileNameFor(field),
                     fileNameFor(proxy));
}

int generationOf(const std::string& path) {
  const std::string folder = cycleFolderOf(path);
  const std::size_t dash = folder.find('-');
  int generation = 1;
  if (dash != std::string::npos)
    std::from_chars(folder.data() + dash + 1, folder.data() + folder.size(), generation);
  return generation;
}

bool staysInside(const std::string& path) {
  constexpr std::size_t kLongest = 1024;
  if (path.empty() || path.size() > kLongest) return false;
  for (unsigned char c : path)
    if (c < 0x20 || c == 0x7f) return false;
  fs::path p(path);
  if (p.is_absolute()) return false;
  return std::none_of(p.begin(), p.end(), [](const fs::path& piece) { return piece == ".."; });
}

bool liesInside(const fs::path& directory, const std::string& path) {
  if (!staysInside(path)) return false;
  std::error_code failed;
  fs::path root = fs::canonical(directory, failed);
  if (failed) return false;
  fs::path parent = fs::canonical((directory / path).parent_path(), failed);
  if (failed || fs::is_symlink(fs::symlink_status(directory / path, failed))) return false;
  return std::mismatch(root.begin(), root.end(), parent.begin(), parent.end()).first == root.end();
}

std::vector<std::string> filesInCycles(const fs::path& directory) {
  std::vector<std::string> files;
  std::error_code failed;
  for (fs::directory_iterator it(directory, failed), end; !failed && it != end;
       it.increment(failed)) {
    std::error_code ignored;
    if (!it->is_directory(ignored) || it->is_symlink(ignored) ||
        !isCycleFolder(it->path().filename().string()))
      continue;
    // Does not follow symbolic links.
    for (fs::recursive_directory_iterator inner(it->path(), ignored), none;
         !ignored && inner != none; inner.increment(ignored)) {
      std::error_code unknown;
      if (!inner->is_directory(unknown))
        files.push_back(inner->path().lexically_relative(directory).generic_string());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::set<std::string> unfinishedFolders(const std::vector<std::string>& files,
                                        const std::vector<ArchiveRow>& rows) {
  std::set<std::string> folders;
  for (const std::string& file : files)
    if (file.ends_with(".tmp")) folders.insert(cycleFolderOf(file));
  for (const ArchiveRow& row : rows) folders.erase(cycleFolderOf(row.exr));
  return folders;
}

void removeInside(const fs::path& directory, const std::vector<std::string>& files) {
  std::error_code ignored;
  for (const std::string& file : files) {
    if (!liesInside(directory, file)) continue;
    fs::remove(directory / file, ignored);
    for (fs::path folder = fs::path(file).parent_path(); !folder.empty();
         folder = folder.parent_path())
      if (!fs::is_empty(directory / folder, ignored) || ignored ||
          !fs::remove(directory / folder, ignored))
        break;
  }
}

}  // namespace vestige
