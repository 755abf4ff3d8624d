// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/export/output_file.h"

#include <cerrno>
#include <system_error>
#include <utility>

#include "proxy/base/error.h"

namespace vestige {

OutputFile::OutputFile(std::filesystem::path path)
    : path_(std::move(path)), temporary_(path_.string() + ".tmp") {
  file_ = std::fopen(temporary_.c_str(), "wb");
  if (!file_) fail(errno);
}

OutputFile::~OutputFile() {
  if (!file_) return;
  std::fclose(file_);
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void OutputFile::fail(int reason) {
  const bool full = reason == ENOSPC || reason == EDQUOT || reason == EFBIG;
  throw Error(
      full ? ErrorCode::NoSpace : ErrorCode::Io,
      "'" + path_.string() + "' cannot be written: " + std::generic_category().message(reason));
}

void OutputFile::write(std::span<const std::byte> bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail(errno);
}

void OutputFile::finish() {
  if (std::fflush(file_) != 0) fail(errno);
  std::error_code error;
  std::filesystem::rename(temporary_, path_, error);
  if (error) fail(error.value());
  std::fclose(std::exchange(file_, nullptr));
}

}  // namespace vestige
