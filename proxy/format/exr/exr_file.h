// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "proxy/format/image/proxy_image.h"

namespace vestige {

/// What becomes of pixels and channels that hold nothing: Omit leaves out constant channels and
/// what surrounds the others; Store writes all of them, for tools that know OpenEXR but not our
/// attributes. Readers see no difference.
enum class EmptyPixels { Omit, Store };

/// Serialises a proxy image as a multi-part EXR (docs/archive-format.md). Deterministic: equal
/// images give equal bytes. Throws InvalidArgument when a channel's size is not the picture's, a
/// name is not [A-Za-z0-9_.+-]+, a value does not fit its storage, or the header makes no sense.
std::vector<std::byte> encodeExr(const ProxyImage& image, EmptyPixels empty = EmptyPixels::Omit);

/// The same of parts that are made one at a time, so that no more than one is held: `part(i)` is
/// called twice for each i in [0, parts), in order, and gives equal parts. `zipLevel` is deflate's,
/// 1 .. 9.
std::vector<std::byte> encodeExr(const ProxyHeader& header, int parts,
                                 const std::function<ProxyPart(int)>& part, int zipLevel);

/// One EXR of an archive, opened lazily: the constructor reads headers only, `part` decodes one
/// part. Throws Io when it cannot be read, Format with file and reason when it is not a proxy or
/// is hostile: sizes are checked against the file before anything is allocated. One thread at a
/// time may use an object.
/// `lengthUnit`: world length of one unit of every length and place that comes out, so that those
/// of domains of any size fit single precision (length_unit.h).
class ExrFile {
 public:
  explicit ExrFile(std::filesystem::path path, double lengthUnit = 1.0);
  ~ExrFile();
  ExrFile(ExrFile&&) noexcept;
  ExrFile& operator=(ExrFile&&) noexcept;

  const std::filesystem::path& path() const;
  double lengthUnit() const;
  const ProxyHeader& header() const;
  std::vector<std::string> partNames() const;
  bool has(const std::string& part) const;
  /// ProxyPart::unit, without decoding; throws NotFound naming part and file.
  double unitOf(const std::string& part) const;
  /// Decodes a part; throws NotFound naming part and file.
  ProxyPart part(const std::string& name) const;
  /// All parts.
  ProxyImage image() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Threads of OpenEXR's process-wide pool, which encoding and decoding share; 0 = the calling
/// thread does it all. Without a call the first encoding or decoding starts one thread a core, 8 at
/// most, unless the process has a pool already. They are made with every signal blocked and the
/// default floating-point environment. Not while anything is being encoded or decoded; a process
/// that forks and goes on encoding in the child must have set 0 before.
void setExrThreads(int count);

}  // namespace vestige
