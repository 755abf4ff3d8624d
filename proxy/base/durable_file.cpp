// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/base/durable_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <ctime>
#include <system_error>
#include <utility>

#include "proxy/base/error.h"

namespace vestige {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const char* verb, const fs::path& path, int reason) {
  bool full = reason == ENOSPC || reason == EDQUOT || reason == EFBIG;
  throw Error(full ? ErrorCode::NoSpace : ErrorCode::Io,
              std::string("cannot ") + verb + " '" + path.string() +
                  "': " + std::generic_category().message(reason));
}

/// While it lives, SIGXFSZ and SIGPIPE wait at this thread's door; those that arrive meanwhile are
/// taken away at the end, so that a full disk is an error code and not the host's death.
class QuietSignals {
 public:
  QuietSignals() {
    sigset_t pending;
    sigpending(&pending);
    sigemptyset(&ours_);
    for (int s : {SIGXFSZ, SIGPIPE})
      if (!sigismember(&pending, s)) sigaddset(&ours_, s);
    sigset_t both;
    sigemptyset(&both);
    sigaddset(&both, SIGXFSZ);
    sigaddset(&both, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &both, &before_);
  }
  ~QuietSignals() {
    int error = errno;
    timespec none{};
    while (sigtimedwait(&ours_, nullptr, &none) > 0) {
    }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
    errno = error;
  }
  QuietSignals(const QuietSignals&) = delete;
  QuietSignals& operator=(const QuietSignals&) = delete;

 private:
  sigset_t ours_, before_;
};

class Descriptor {
 public:
  Descriptor(const fs::path& path, int flags) {
    do {
      fd_ = ::open(path.c_str(), flags | O_CLOEXEC, 0666);
    } while (fd_ < 0 && errno == EINTR);
  }
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  int get() const { return fd_; }
  bool ok() const { return fd_ >= 0; }
  int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

/// 0 or errno.
int writeAll(int fd, const std::byte* data, std::size_t size) {
  while (size > 0) {
    ssize_t n = ::write(fd, data, size);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno;
    if (n == 0) return ENOSPC;
    data += n;
    size -= std::size_t(n);
  }
  return 0;
}

/// 0 or errno. Some file systems cannot fsync a folder (EINVAL): nothing more can be done there.
int syncToDisk(int fd) {
  while (::fsync(fd) != 0) {
    if (errno == EINVAL || errno == EROFS || errno == ENOTSUP) return 0;
    if (errno != EINTR) return errno;
  }
  return 0;
}

void syncFolder(const fs::path& folder) {
  Descriptor fd(folder, O_RDONLY | O_DIRECTORY);
  if (!fd.ok()) fail("open folder", folder, errno);
  if (int e = syncToDisk(fd.get())) fail("sync folder", folder, e);
}

fs::path folderOf(const fs::path& path) {
  fs::path folder = path.parent_path();
  return folder.empty() ? fs::path(".") : folder;
}

fs::path temporaryFor(fs::path path) { return path += ".tmp"; }

/// Writes the temporary file beside `path`; returns its open descriptor.
int writeTemporary(const fs::path& path, std::span<const std::byte> bytes) {
  fs::path temporary = temporaryFor(path);
  Descriptor fd(temporary, O_WRONLY | O_CREAT | O_TRUNC);
  if (!fd.ok()) fail("create", temporary, errno);
  if (int e = writeAll(fd.get(), bytes.data(), bytes.size())) {
    ::unlink(temporary.c_str());
    fail("write", path, e);
  }
  return fd.release();
}

}  // namespace

void writeDurably(const fs::path& path, std::span<const std::byte> bytes) {
  QuietSignals quiet;
  fs::path temporary = temporaryFor(path);
  int fd = writeTemporary(path, bytes);
  int e = syncToDisk(fd);
  if (::close(fd) != 0 && e == 0 && errno != EINTR) e = errno;
  if (e == 0 && ::rename(temporary.c_str(), path.c_str()) != 0) e = errno;
  if (e != 0) {
    ::unlink(temporary.c_str());
    fail("write", path, e);
  }
  syncFolder(folderOf(path));
}

void appendDurably(const fs::path& path, std::string_view text, bool mustExist) {
  QuietSignals quiet;
  Descriptor fd(path, O_WRONLY | O_APPEND | (mustExist ? 0 : O_CREAT));
  if (!fd.ok()) fail("open", path, errno);
  struct stat before;
  if (::fstat(fd.get(), &before) != 0) fail("examine", path, errno);
  auto bytes = std::as_bytes(std::span(text.data(), text.size()));
  int e = writeAll(fd.get(), bytes.data(), bytes.size());
  if (e == 0) e = syncToDisk(fd.get());
  if (e != 0) {
    // Best effort: readers ignore a torn last line should even this fail.
    if (::ftruncate(fd.get(), before.st_size) == 0) syncToDisk(fd.get());
    fail("append to", path, e);
  }
  if (before.st_size == 0) syncFolder(folderOf(path));
}

void truncateDurably(const fs::path& path, std::size_t size) {
  QuietSignals quiet;
  Descriptor fd(path, O_WRONLY);
  if (!fd.ok()) fail("open", path, errno);
  if (::ftruncate(fd.get(), off_t(size)) != 0) fail("truncate", path, errno);
  if (int e = syncToDisk(fd.get())) fail("sync", path, e);
}

void createFoldersDurably(const fs::path& folder) {
  fs::path path;
  for (const fs::path& piece : folder) {
    path /= piece;
    if (path.empty() || fs::is_directory(path)) continue;
    if (::mkdir(path.c_str(), 0777) != 0 && errno != EEXIST) fail("create folder", path, errno);
    if (!fs::is_directory(path)) fail("create folder", path, ENOTDIR);
    syncFolder(folderOf(path));
  }
}

std::vector<std::byte> readBytes(const fs::path& path, std::size_t most) {
  Descriptor fd(path, O_RDONLY | O_NONBLOCK);  // a pipe without a writer must not hang
  if (!fd.ok()) fail("open", path, errno);
  struct stat status;
  if (::fstat(fd.get(), &status) != 0) fail("examine", path, errno);
  if (!S_ISREG(status.st_mode))
    throw Error(ErrorCode::Io, "'" + path.string() + "' cannot be read: it is no regular file");
  if (std::uint64_t(status.st_size) > most)
    throw Error(ErrorCode::Format, "'" + path.string() + "' has " + std::to_string(status.st_size) +
                                       " bytes, more than " + std::to_string(most));
  std::vector<std::byte> bytes(std::size_t(status.st_size));
  std::size_t got = 0;
  while (got < bytes.size()) {
    ssize_t n = ::read(fd.get(), bytes.data() + got, bytes.size() - got);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail("read", path, errno);
    if (n == 0) break;
    got += std::size_t(n);
  }
  bytes.resize(got);
  return bytes;
}

DurableBatch::DurableBatch(fs::path root) : root_(std::move(root)) {}

DurableBatch::~DurableBatch() {
  for (const File& file : files_) {
    if (file.descriptor >= 0) ::close(file.descriptor);
    if (kept_) continue;
    fs::path leftover = file.renamed ? file.path : temporaryFor(file.path);
    ::unlink(leftover.c_str());
  }
  if (kept_) return;
  for (auto folder = newFolders_.rbegin(); folder != newFolders_.rend(); ++folder)
    ::rmdir(folder->c_str());
}

void DurableBatch::makeFolders(const fs::path& folder) {
  fs::path path = root_;
  for (const fs::path& piece : folder) {
    fs::path parent = path;
    path /= piece;
    if (::mkdir(path.c_str(), 0777) == 0) {
      newFolders_.push_back(path);
      touched_.push_back(parent);
    } else if (errno != EEXIST) {
      fail("create folder", path, errno);
    }
  }
}

void DurableBatch::add(const fs::path& file, std::span<const std::byte> bytes) {
  QuietSignals quiet;
  makeFolders(file.parent_path());
  fs::path path = root_ / file;
  int fd = writeTemporary(path, bytes);
  files_.push_back({path, fd, false});
  touched_.push_back(folderOf(path));
#ifdef SYNC_FILE_RANGE_WRITE
  // The disk works while the next file is encoded; place() waits for what is left.
  ::sync_file_range(fd, 0, 0, SYNC_FILE_RANGE_WRITE);
#endif
}

void DurableBatch::place() {
  QuietSignals quiet;
  for (File& file : files_) {
    int e = syncToDisk(file.descriptor);
    if (::close(std::exchange(file.descriptor, -1)) != 0 && e == 0 && errno != EINTR) e = errno;
    if (e != 0) fail("write", file.path, e);
  }
  for (File& file : files_) {
    if (::rename(temporaryFor(file.path).c_str(), file.path.c_str()) != 0)
      fail("write", file.path, errno);
    file.renamed = true;
  }
  std::sort(touched_.begin(), touched_.end());
  touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
  for (const fs::path& folder : touched_) syncFolder(folder);
}

}  // namespace vestige
