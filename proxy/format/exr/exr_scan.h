// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

namespace vestige {

/// Limits of what a reader accepts (docs/archive-format.md, "Limits").
struct ExrLimits {
  static constexpr int kSide = 32768;
  static constexpr int kChannels = 4096;
  static constexpr int kParts = 80;
  static constexpr int kAttributes = 1024;                  ///< a part
  static constexpr std::uint64_t kChunkBytes = 128u << 20;  ///< of up to 16 lines, decoded
  static constexpr std::uint64_t kHeaderBytes = 16u << 20;
  /// Deflate shrinks 1032 : 1 at best, so a file's bytes bound the pixels that it stores.
  static constexpr std::uint64_t kDeflateRatio = 1032;
  /// Pictures are mostly empty and what is empty is not stored: up to this many bytes (in memory
  /// at most twice as many) a picture may hold whatever the size of its file.
  static constexpr std::uint64_t kFreePictureBytes = std::uint64_t(512) << 20;
};

/// Walks through the structure of an EXR file without trusting any of it and throws Format, with
/// the file's name and the reason, unless the file is a scan-line EXR (one or more parts; none,
/// RLE, ZIPS or ZIP compression) whose claims fit its size and the limits above. Nothing larger
/// than the header is read. `read(offset, n, out)` yields bytes that exist or throws.
using ReadAt = std::function<void(std::uint64_t offset, std::size_t n, char* out)>;
void scanExr(const std::filesystem::path& name, std::uint64_t fileBytes, const ReadAt& read);

/// Whether a picture of this many bytes in memory (stored depth, all channels, constant ones too)
/// is acceptable in a file of this size.
inline bool pictureFitsFile(std::uint64_t pictureBytes, std::uint64_t fileBytes) {
  return pictureBytes <= ExrLimits::kFreePictureBytes ||
         pictureBytes / ExrLimits::kDeflateRatio <= fileBytes;
}

}  // namespace vestige
