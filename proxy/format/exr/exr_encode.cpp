// SPDX-License-Identifier: BSD-3-Clause
#include <Imath/half.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <set>

#include "proxy/base/error.h"
#include "proxy/format/exr/exr_file.h"
#include "proxy/format/exr/exr_header.h"
#include "proxy/format/exr/exr_scan.h"
#include "proxy/format/exr/exr_threads.h"
#include "proxy/format/image/storage_scale.h"

namespace vestige {
namespace {

/// Deflate's level: see docs/archive-format.md, "Compression".
constexpr int kZipLevel = 3;

class MemoryStream : public Imf::OStream {
 public:
  MemoryStream() : Imf::OStream("memory") {}
  void write(const char c[], int n) override {
    std::size_t end = at_ + std::size_t(n);
    if (end > bytes_.size()) bytes_.resize(end);
    std::memcpy(bytes_.data() + at_, c, std::size_t(n));
    at_ = end;
  }
  std::uint64_t tellp() override { return at_; }
  void seekp(std::uint64_t pos) override { at_ = std::size_t(pos); }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
  std::size_t at_ = 0;
};

/// Pixels that hold something, [x0, x1) x [y0, y1); empty when x0 >= x1.
struct Extent {
  int x0 = std::numeric_limits<int>::max(), y0 = x0, x1 = 0, y1 = 0;
  void add(const Extent& e) {
    x0 = std::min(x0, e.x0), y0 = std::min(y0, e.y0);
    x1 = std::max(x1, e.x1), y1 = std::max(y1, e.y1);
  }
};

/// One channel as it goes into the file.
struct StoredChannel {
  std::vector<std::uint16_t> halves;
  std::vector<float> floats;
  const float* plane = nullptr;  ///< of Float storage: `floats`, or the caller's values
  Extent extent;                 ///< where it differs from its fill
};

struct StoredPart {
  PartLayout layout;
  std::vector<StoredChannel> channels;
  Extent extent;
};

/// What a pixel that no ray met is (ProxyPart's table).
float missingValue(const std::string& channel) {
  if (channel == "Z") return std::numeric_limits<float>::infinity();
  if (channel == "T") return 1.0f;
  if (channel == "value") return std::numeric_limits<float>::quiet_NaN();
  return 0.0f;
}

template <typename Word>
bool sameBits(Word a, Word b) {
  if constexpr (sizeof(Word) == 4)
    return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
  else
    return a == b;
}

template <typename Word>
bool allTheSame(const Word* plane, std::size_t n) {
  return n < 2 || std::memcmp(plane, plane + 1, (n - 1) * sizeof(Word)) == 0;
}

template <typename Word>
Extent extentOf(const Word* plane, ImageSize size, Word fill) {
  Extent e;
  for (int y = 0; y < size.height; ++y, plane += size.width) {
    int x0 = 0, x1 = size.width;
    while (x0 < x1 && sameBits(plane[x0], fill)) ++x0;
    if (x0 == x1) continue;
    while (sameBits(plane[x1 - 1], fill)) --x1;
    e.add({x0, y, x1, y + 1});
  }
  return e;
}

std::uint16_t halfOf(float stored, bool present) {
  std::uint16_t bits = Imath::half(stored).bits();
  // A value that happens to be `zero` must not read as missing.
  return present && (bits & 0x7fff) == 0 ? std::uint16_t(1) : bits;
}

[[noreturn]] void tooLarge(const ProxyPart& part, const Channel& channel, float value) {
  throw Error(ErrorCode::InvalidArgument,
              fmt::format("channel '{}' of part '{}' holds {}, which its storage (zero {}, unit "
                          "{}) cannot",
                          channel.name, part.name, value, part.zero, part.unit));
}

void storeHalves(const ProxyPart& part, const Channel& channel, StoredChannel& out) {
  const StorageScale scale = scaleOfPart(part.name, part.unit, part.zero);
  out.halves.resize(channel.values.size());
  for (std::size_t i = 0; i < out.halves.size(); ++i) {
    const float value = channel.values[i];
    if (std::bit_cast<std::uint32_t>(value) == 0)
      continue;  // most pixels; 0 is stored as 0 with any scale
    const std::uint16_t bits = halfOf(scale.stored(value), scale.missingIsZero() && value != 0.0f);
    if ((bits & 0x7fff) == 0x7c00 && std::isfinite(value)) tooLarge(part, channel, value);
    out.halves[i] = bits;
  }
}

void storeFloats(const ProxyPart& part, const Channel& channel, StoredChannel& out) {
  const StorageScale scale = scaleOfPart(part.name, part.unit, part.zero);
  out.plane = channel.values.data();
  if (scale.identity()) return;
  out.floats.resize(channel.values.size());
  for (std::size_t i = 0; i < out.floats.size(); ++i) {
    float value = channel.values[i], stored = scale.stored(value);
    if (std::isinf(stored) && std::isfinite(value)) tooLarge(part, channel, value);
    if (scale.missingIsZero() && value != 0.0f && stored == 0.0f)
      stored = std::numeric_limits<float>::min();
    out.floats[i] = stored;
  }
  out.plane = out.floats.data();
}

void storeChannel(const ProxyPart& part, const Channel& channel, ImageSize size, bool sparse,
                  ChannelLayout& layout, StoredChannel& out) {
  const std::size_t n = size.pixels();
  const bool half = channel.storage == ChannelStorage::Half;
  // Constants and fill are in the value's unit, which floats need not hold: scaleOfPart.
  const bool heldAsStored = part.zero != 0.0 && scaleOfPart(part.name, 1.0, part.zero).identity();
  if (sparse && !heldAsStored && allTheSame(channel.values.data(), n)) {
    Channel single{channel.name, channel.storage, {channel.values[0]}};
    StoredChannel one;
    half ? storeHalves(part, single, one) : storeFloats(part, single, one);
    layout.constant = true;
    layout.fill =
        scaleOfPart(part.name, part.unit, part.zero)
            .memory(half ? float(Imath::half(Imath::half::FromBits, one.halves[0])) : *one.plane);
    return;
  }
  half ? storeHalves(part, channel, out) : storeFloats(part, channel, out);
  if (!sparse) {
    out.extent = {0, 0, size.width, size.height};
    return;
  }
  layout.fill = missingValue(channel.name);
  const float fill = scaleOfPart(part.name, part.unit, part.zero).stored(layout.fill);
  out.extent = half ? extentOf(out.halves.data(), size, Imath::half(fill).bits())
                    : extentOf(out.plane, size, fill);
}

bool plainName(const std::string& name) {
  auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::strchr("_.+-", c);
  };
  return !name.empty() && name.size() <= 64 && std::all_of(name.begin(), name.end(), plain);
}

[[noreturn]] void refuse(const ProxyHeader& header, const std::string& reason) {
  throw Error(ErrorCode::InvalidArgument,
              fmt::format("the {} proxy of field '{}' cannot be stored: {}", header.kind,
                          header.field, reason));
}

void validate(const ProxyHeader& header, std::size_t parts) {
  const ImageSize size = header.size;
  if (size.width < 1 || size.height < 1 || size.width > ExrLimits::kSide ||
      size.height > ExrLimits::kSide)
    refuse(header, fmt::format("its picture is {} x {}", size.width, size.height));
  for (const auto& [what, text] : {std::pair{"kind", &header.kind},
                                   {"field name", &header.field},
                                   {"view name", &header.view}})
    if (text->empty()) refuse(header, fmt::format("its {} is empty", what));
  if (parts < 1 || parts > std::size_t(ExrLimits::kParts))
    refuse(header, fmt::format("it has {} parts", parts));
}

/// Parts that were seen before, for what no two of them may share.
class PartValidator {
 public:
  explicit PartValidator(const ProxyHeader& header) : header_(header) {}
  void check(const ProxyPart& part) {
    const auto no = [&](const std::string& reason) { refuse(header_, reason); };
    if (!plainName(part.name) || !parts_.insert(part.name).second)
      no(fmt::format("the part name '{}' is not plain or comes twice", part.name));
    if (!(part.unit > 0.0) || !std::isfinite(part.unit) || !std::isfinite(part.zero) ||
        !std::isfinite(part.error))
      no(fmt::format("part '{}' has unit {}, zero {}, error {}", part.name, part.unit, part.zero,
                     part.error));
    std::set<std::string> names;
    for (const Channel& channel : part.channels) {
      if (!plainName(channel.name) || !names.insert(channel.name).second)
        no(fmt::format("the channel name '{}' is not plain or comes twice", channel.name));
      if (channel.values.size() != header_.size.pixels())
        no(fmt::format("channel '{}' has {} values, the picture {}", channel.name,
                       channel.values.size(), header_.size.pixels()));
    }
    if (part.channels.empty()) no(fmt::format("part '{}' has no channels", part.name));
    channels_ += part.channels.size();
    if (channels_ > std::size_t(ExrLimits::kChannels))
      no(fmt::format("it has {} channels", channels_));
  }

 private:
  const ProxyHeader& header_;
  std::set<std::string> parts_;
  std::size_t channels_ = 0;
};

StoredPart store(const ProxyPart& part, ImageSize size, bool sparse) {
  StoredPart stored{{part.name, part.unit, part.zero, part.error, {}},
                    std::vector<StoredChannel>(part.channels.size()),
                    {}};
  for (const Channel& c : part.channels) stored.layout.channels.push_back({c.name, c.storage});
  forEachOnExrThreads(int(part.channels.size()), [&](int i) {
    const std::size_t c = std::size_t(i);
    storeChannel(part, part.channels[c], size, sparse, stored.layout.channels[c],
                 stored.channels[c]);
  });
  for (const StoredChannel& channel : stored.channels) stored.extent.add(channel.extent);
  if (stored.extent.x0 < stored.extent.x1) return stored;
  // OpenEXR wants a channel and a pixel: a part that is constant throughout keeps one of each.
  stored.extent = {0, 0, 1, 1};
  if (std::all_of(stored.layout.channels.begin(), stored.layout.channels.end(),
                  [](const ChannelLayout& c) { return c.constant; })) {
    stored.layout.channels[0].constant = false;
    const Channel& first = part.channels[0];
    first.storage == ChannelStorage::Half ? storeHalves(part, first, stored.channels[0])
                                          : storeFloats(part, first, stored.channels[0]);
  }
  return stored;
}

Imf::Header headerOf(const ProxyHeader& proxy, const StoredPart& part, int zipLevel, bool first) {
  const ImageSize size = proxy.size;
  const Extent& e = part.extent;
  Imf::Header header(Imath::Box2i({0, 0}, {size.width - 1, size.height - 1}),
                     Imath::Box2i({e.x0, e.y0}, {e.x1 - 1, e.y1 - 1}),
                     float(proxy.camera.pixelAspect));
  header.compression() = Imf::ZIP_COMPRESSION;
  header.zipCompressionLevel() = zipLevel;
  header.setName(part.layout.name);
  header.setType(Imf::SCANLINEIMAGE);
  for (const ChannelLayout& c : part.layout.channels)
    if (!c.constant)
      header.channels().insert(
          c.name, Imf::Channel(c.storage == ChannelStorage::Half ? Imf::HALF : Imf::FLOAT));
  // Readers need them once; part 0 speaks for the file.
  if (first) setProxyAttributes(header, proxy);
  setPartAttributes(header, part.layout);
  return header;
}

void writePart(Imf::MultiPartOutputFile& file, int number, const StoredPart& part, int width) {
  Imf::FrameBuffer frame;
  for (std::size_t c = 0; c < part.channels.size(); ++c) {
    const ChannelLayout& layout = part.layout.channels[c];
    if (layout.constant) continue;
    const bool half = layout.storage == ChannelStorage::Half;
    const void* plane =
        half ? static_cast<const void*>(part.channels[c].halves.data()) : part.channels[c].plane;
    const std::size_t word = half ? sizeof(std::uint16_t) : sizeof(float);
    frame.insert(layout.name, Imf::Slice(half ? Imf::HALF : Imf::FLOAT,
                                         static_cast<char*>(const_cast<void*>(plane)), word,
                                         word * std::size_t(width)));
  }
  Imf::OutputPart out(file, number);
  out.setFrameBuffer(frame);
  out.writePixels(part.extent.y1 - part.extent.y0);
}

std::vector<std::byte> encode(const ProxyHeader& header, const std::vector<StoredPart>& parts,
                              int zipLevel) {
  std::vector<Imf::Header> headers;
  for (const StoredPart& part : parts)
    headers.push_back(headerOf(header, part, zipLevel, headers.empty()));
  MemoryStream stream;
  {
    Imf::MultiPartOutputFile file(stream, headers.data(), int(headers.size()));
    for (std::size_t p = 0; p < parts.size(); ++p)
      writePart(file, int(p), parts[p], header.size.width);
  }  // writes the tables of chunks
  return stream.take();
}

std::vector<std::byte> encode(const ProxyImage& image, bool sparse) {
  std::vector<StoredPart> parts;
  for (const ProxyPart& part : image.parts) parts.push_back(store(part, image.header.size, sparse));
  return encode(image.header, parts, kZipLevel);
}

std::uint64_t pictureBytesOf(const ProxyHeader& header, const ProxyPart& part) {
  std::uint64_t bytes = 0;
  for (const Channel& c : part.channels)
    bytes += header.size.pixels() * (c.storage == ChannelStorage::Half ? 2u : 4u);
  return bytes;
}

/// Parts are made once for the headers, which come first in the file, and once to be written.
std::vector<std::byte> encode(const ProxyHeader& header, int parts,
                              const std::function<ProxyPart(int)>& part, int zipLevel, bool sparse,
                              std::uint64_t& pictureBytes) {
  PartValidator validator(header);
  std::vector<Imf::Header> headers;
  pictureBytes = 0;
  for (int i = 0; i < parts; ++i) {
    const ProxyPart made = part(i);
    validator.check(made);
    pictureBytes += pictureBytesOf(header, made);
    headers.push_back(headerOf(header, store(made, header.size, sparse), zipLevel, i == 0));
  }
  MemoryStream stream;
  {
    Imf::MultiPartOutputFile file(stream, headers.data(), parts);
    for (int i = 0; i < parts; ++i) {
      const ProxyPart made = part(i);
      writePart(file, i, store(made, header.size, sparse), header.size.width);
    }
  }
  return stream.take();
}

/// encode(sparse, pictureBytes), sparsely if it may be; a huge and nearly empty picture would look
/// like a trap to readers: then every pixel is stored.
template <typename Encode>
std::vector<std::byte> encodeFitting(const ProxyHeader& header, bool sparse, const Encode& encode) {
  ensureExrThreads();
  try {
    std::uint64_t pictureBytes = 0;
    std::vector<std::byte> bytes = encode(sparse, pictureBytes);
    if (sparse && !pictureFitsFile(pictureBytes, bytes.size())) bytes = encode(false, pictureBytes);
    return bytes;
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    throw Error(ErrorCode::Internal, fmt::format("the {} proxy of field '{}' does not encode: {}",
                                                 header.kind, header.field, e.what()));
  }
}

}  // namespace

std::vector<std::byte> encodeExr(const ProxyImage& image, EmptyPixels empty) {
  validate(image.header, image.parts.size());
  PartValidator validator(image.header);
  std::uint64_t all = 0;
  for (const ProxyPart& part : image.parts) {
    validator.check(part);
    all += pictureBytesOf(image.header, part);
  }
  return encodeFitting(image.header, empty == EmptyPixels::Omit,
                       [&](bool sparse, std::uint64_t& pictureBytes) {
                         pictureBytes = all;
                         return encode(image, sparse);
                       });
}

std::vector<std::byte> encodeExr(const ProxyHeader& header, int parts,
                                 const std::function<ProxyPart(int)>& part, int zipLevel) {
  validate(header, std::size_t(std::max(parts, 0)));
  return encodeFitting(header, true, [&](bool sparse, std::uint64_t& pictureBytes) {
    return encode(header, parts, part, zipLevel, sparse, pictureBytes);
  });
}

}  // namespace vestige
