// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace vestige {

/// Writes `bytes` to path.tmp, fsyncs, renames to `path`. On failure the temporary file is gone,
/// `path` is as before, and Io or NoSpace (ENOSPC, EDQUOT, EFBIG) is thrown with path and reason.
/// SIGXFSZ and SIGPIPE never reach the process: they are blocked on the calling thread and a
/// pending one that this write raised is consumed.
void writeDurably(const std::filesystem::path& path, std::span<const std::byte> bytes);
/// Appends in one write and fsyncs; on a short write truncates back to the old size. As above.
/// Creates the file when it is missing, unless told that it `mustExist`.
void appendDurably(const std::filesystem::path& path, std::string_view text,
                   bool mustExist = false);
/// Cuts a file to its first `size` bytes and fsyncs.
void truncateDurably(const std::filesystem::path& path, std::size_t size);
/// Creates a folder and its missing parents, and fsyncs where they were entered.
void createFoldersDurably(const std::filesystem::path& folder);
/// The whole file. Throws Io with path and reason, Format when it is longer than `most` bytes.
std::vector<std::byte> readBytes(const std::filesystem::path& path,
                                 std::size_t most = std::size_t(256) << 20);

/// Several new files below a folder that become visible together, with one wait for the disk: all
/// are written under temporary names; place() fsyncs and renames them all and fsyncs their folders.
/// Missing sub-folders are created; `root` itself must exist. Unless keep() was called, the
/// destructor removes all that was made. Errors as writeDurably.
class DurableBatch {
 public:
  explicit DurableBatch(std::filesystem::path root);
  ~DurableBatch();
  DurableBatch(const DurableBatch&) = delete;
  DurableBatch& operator=(const DurableBatch&) = delete;

  /// `file` is relative to root and does not exist yet. Starts the transfer to disk.
  void add(const std::filesystem::path& file, std::span<const std::byte> bytes);
  void place();
  void keep() { kept_ = true; }

 private:
  void makeFolders(const std::filesystem::path& folder);

  struct File {
    std::filesystem::path path;
    int descriptor;
    bool renamed;
  };
  std::filesystem::path root_;
  std::vector<File> files_;
  std::vector<std::filesystem::path> newFolders_;  ///< outermost first
  std::vector<std::filesystem::path> touched_;     ///< folders with new entries
  bool kept_ = false;
};

}  // namespace vestige
