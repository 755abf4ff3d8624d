// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "proxy/proxy_image.h"

namespace vestige {

/// Serialises a proxy image as a multi-part EXR (docs/archive-format.md). Deterministic: equal
/// images give equal bytes. Throws InvalidArgument when a channel's size is not the picture's.
std::vector<std::byte> encodeExr(const ProxyImage& image);

/// One EXR of an archive, opened lazily: the constructor reads headers only, `part` decodes one
/// part. Throws Io when it cannot be read, Format with file and reason when it is not a proxy or
/// is hostile: sizes are checked against the file before anything is allocated.
class ExrFile {
 public:
  explicit ExrFile(std::filesystem::path path);
  ~ExrFile();
  ExrFile(ExrFile&&) noexcept;
  ExrFile& operator=(ExrFile&&) noexcept;

  const std::filesystem::path& path() const;
  const ProxyHeader& header() const;
  std::vector<std::string> partNames() const;
  bool has(const std::string& part) const;
  /// Decodes a part in world units; throws NotFound naming part and file.
  ProxyPart part(const std::string& name) const;
  /// All parts.
  ProxyImage image() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vestige
