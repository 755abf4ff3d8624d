// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <span>
#include <string_view>

namespace vestige {

/// A file that is written segment by segment as path.tmp and gets its name when it is whole; else
/// nothing is left of it. Throws Io or NoSpace with path and reason.
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::span<const std::byte> bytes);
  void write(std::string_view text) { write(std::as_bytes(std::span(text))); }
  void finish();

 private:
  [[noreturn]] void fail(int reason);

  std::filesystem::path path_, temporary_;
  std::FILE* file_ = nullptr;
};

}  // namespace vestige
