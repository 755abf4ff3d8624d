// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/archive/archive_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "proxy/base/error.h"

namespace vestige {

ArchiveLock::ArchiveLock(const std::filesystem::path& directory)
    : folder_(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (folder_ < 0)
    throw Error(ErrorCode::Io, fmt::format("cannot open archive '{}': {}", directory.string(),
                                           std::generic_category().message(errno)));
  if (::flock(folder_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  ::close(folder_);
  throw Error(ErrorCode::Exists,
              "archive '" + directory.string() + "' is being written by another run");
}

ArchiveLock::~ArchiveLock() { ::close(folder_); }

bool ArchiveLock::isAt(const std::filesystem::path& directory) const {
  struct stat held, seen;
  return ::fstat(folder_, &held) == 0 && ::stat(directory.c_str(), &seen) == 0 &&
         held.st_ino == seen.st_ino && held.st_dev == seen.st_dev;
}

}  // namespace vestige
