// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/exr/exr_scan.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <optional>
#include <vector>

#include "proxy/base/error.h"

namespace vestige {
namespace {

constexpr std::uint32_t kMagic = 20000630;
constexpr std::uint32_t kTiled = 0x200, kLongNames = 0x400, kDeep = 0x800, kMultiPart = 0x1000;
constexpr std::size_t kLongestName = 255;

/// Thrown when the bytes at hand end; the caller fetches more or gives up.
struct NeedMore {};

/// Reads little-endian values from a prefix of the file, never past its end.
class Cursor {
 public:
  explicit Cursor(const std::vector<char>& bytes) : bytes_(bytes) {}

  std::uint32_t u32() {
    need(4);
    const auto* b = reinterpret_cast<const unsigned char*>(bytes_.data() + at_);
    at_ += 4;
    return std::uint32_t(b[0]) | std::uint32_t(b[1]) << 8 | std::uint32_t(b[2]) << 16 |
           std::uint32_t(b[3]) << 24;
  }
  std::int32_t i32() { return std::int32_t(u32()); }
  std::uint8_t u8() {
    need(1);
    return std::uint8_t(bytes_[at_++]);
  }
  /// A zero-terminated name; nullopt when it is longer than a name may be.
  std::optional<std::string> name() {
    std::string text;
    while (char c = char(u8())) {
      if (text.size() == kLongestName) return std::nullopt;
      text += c;
    }
    return text;
  }
  std::string text(std::size_t n) {
    need(n);
    at_ += n;
    return {bytes_.data() + at_ - n, n};
  }
  std::size_t at() const { return at_; }
  void skip(std::size_t n) {
    need(n);
    at_ += n;
  }

 private:
  void need(std::size_t n) const {
    if (n > bytes_.size() - at_) throw NeedMore{};
  }
  const std::vector<char>& bytes_;
  std::size_t at_ = 0;
};

struct Window {
  std::int64_t x0, y0, x1, y1;
  std::int64_t width() const { return x1 - x0 + 1; }
  std::int64_t height() const { return y1 - y0 + 1; }
};

struct Part {
  std::map<std::string, std::string> types;
  Window data{}, display{};
  int channels = 0;
  std::uint64_t bytesPerPixel = 0;
  int compression = 0;
  int chunkCount = -1;
  std::string type;
};

class Scanner {
 public:
  Scanner(const std::filesystem::path& name, std::uint64_t fileBytes)
      : name_(name), fileBytes_(fileBytes) {}

  /// Parses all headers from a prefix of the file and checks their claims.
  void run(const std::vector<char>& prefix) {
    Cursor in(prefix);
    std::uint32_t flags = readVersion(in);
    std::vector<Part> parts;
    if (flags & kMultiPart) {
      for (;;) {
        Part part;
        if (!readHeader(in, part)) break;
        if (parts.size() == ExrLimits::kParts)
          refuse("it has more than " + std::to_string(ExrLimits::kParts) + " parts");
        parts.push_back(std::move(part));
      }
      if (parts.empty()) refuse("it has no part");
    } else {
      Part part;
      if (!readHeader(in, part)) refuse("it has no header");
      parts.push_back(std::move(part));
    }
    checkClaims(parts, in.at(), flags & kMultiPart);
  }

  [[noreturn]] void refuse(const std::string& reason) const {
    throw Error(ErrorCode::Format, "'" + name_.string() + "' is not a readable proxy: " + reason);
  }

 private:
  std::uint32_t readVersion(Cursor& in) const {
    if (in.u32() != kMagic) refuse("it does not begin like an OpenEXR file");
    std::uint32_t version = in.u32();
    if ((version & 0xff) != 2)
      refuse("its OpenEXR version is " + std::to_string(version & 0xff) + ", not 2");
    if (version & (kTiled | kDeep)) refuse("it is tiled or deep, not made of scan lines");
    if (version & ~std::uint32_t(0xff | kLongNames | kMultiPart))
      refuse("its version field has unknown flags");
    return version;
  }

  /// False at the empty header that ends a list of headers.
  bool readHeader(Cursor& in, Part& part) const {
    for (;;) {
      std::optional<std::string> name = in.name();
      if (!name) refuse("an attribute's name is longer than 255 bytes");
      if (name->empty()) break;
      std::optional<std::string> type = in.name();
      if (!type) refuse("the type name of attribute '" + *name + "' is longer than 255 bytes");
      std::uint32_t size = in.u32();
      if (size > ExrLimits::kHeaderBytes ||
          size > fileBytes_ - std::min<std::uint64_t>(in.at(), fileBytes_))
        refuse("attribute '" + *name + "' claims " + std::to_string(size) + " bytes");
      if (part.types.size() == ExrLimits::kAttributes)
        refuse("a part has more than " + std::to_string(ExrLimits::kAttributes) + " attributes");
      if (!part.types.emplace(*name, *type).second) refuse("attribute '" + *name + "' comes twice");
      std::size_t end = in.at() + size;
      readAttribute(in, part, *name, *type, size);
      if (in.at() > end || (*type == "chlist" && in.at() < end))
        refuse("attribute '" + *name + "' is not as long as it says");
      in.skip(end - in.at());
    }
    return !part.types.empty();
  }

  void readAttribute(Cursor& in, Part& part, const std::string& name, const std::string& type,
                     std::uint32_t size) const {
    auto expect = [&](const char* wanted, std::uint32_t bytes) {
      if (type != wanted || (bytes && size != bytes))
        refuse("attribute '" + name + "' is no " + wanted);
    };
    if (name == "dataWindow" || name == "displayWindow") {
      expect("box2i", 16);
      Window& window = name == "dataWindow" ? part.data : part.display;
      window.x0 = in.i32(), window.y0 = in.i32(), window.x1 = in.i32(), window.y1 = in.i32();
    } else if (name == "channels") {
      expect("chlist", 0);
      readChannels(in, part, in.at() + size);
    } else if (name == "compression") {
      expect("compression", 1);
      part.compression = in.u8();
    } else if (name == "lineOrder") {
      expect("lineOrder", 1);
    } else if (name == "chunkCount") {
      expect("int", 4);
      part.chunkCount = in.i32();
    } else if (name == "type") {
      expect("string", 0);
      part.type = in.text(size);
    }
    checkSize(name, type, size);
  }

  /// OpenEXR reads attributes of the types it knows by their type and not by their size: a wrong
  /// size would make it see another header than this one.
  void checkSize(const std::string& name, const std::string& type, std::uint32_t size) const {
    static const std::map<std::string, std::uint32_t> kBytes = {
        {"box2f", 16},      {"box2i", 16}, {"chromaticities", 32},
        {"compression", 1}, {"double", 8}, {"envmap", 1},
        {"float", 4},       {"int", 4},    {"keycode", 28},
        {"lineOrder", 1},   {"m33d", 72},  {"m33f", 36},
        {"m44d", 128},      {"m44f", 64},  {"rational", 8},
        {"timecode", 8},    {"v2d", 16},   {"v2f", 8},
        {"v2i", 8},         {"v3d", 24},   {"v3f", 12},
        {"v3i", 12}};
    if (const auto known = kBytes.find(type); known != kBytes.end()) {
      if (size != known->second)
        refuse("attribute '" + name + "' is no " + type + " with its " + std::to_string(size) +
               " bytes");
    } else if (type != "string" && (type != "chlist" || name != "channels")) {
      refuse("attribute '" + name + "' is of type '" + type + "', which no proxy has");
    }
  }

  void readChannels(Cursor& in, Part& part, std::size_t end) const {
    static constexpr std::uint64_t kBytes[] = {4, 2, 4};  // UINT, HALF, FLOAT
    for (;;) {
      if (in.at() >= end) refuse("its list of channels does not end");
      std::optional<std::string> name = in.name();
      if (!name) refuse("a channel's name is longer than 255 bytes");
      if (name->empty()) return;
      std::uint32_t type = in.u32();
      in.skip(4);
      std::int32_t xSampling = in.i32(), ySampling = in.i32();
      if (type > 2) refuse("channel '" + *name + "' has an unknown type");
      if (xSampling != 1 || ySampling != 1) refuse("channel '" + *name + "' is subsampled");
      if (++part.channels > ExrLimits::kChannels)
        refuse("it has more than " + std::to_string(ExrLimits::kChannels) + " channels");
      part.bytesPerPixel += kBytes[type];
    }
  }

  void checkClaims(const std::vector<Part>& parts, std::size_t headerBytes, bool multiPart) const {
    std::uint64_t channels = 0, storedBytes = 0, tableBytes = 0;
    for (const Part& part : parts) {
      for (const char* needed :
           {"dataWindow", "displayWindow", "channels", "compression", "lineOrder",
            "pixelAspectRatio", "screenWindowCenter", "screenWindowWidth"})
        if (!part.types.count(needed)) refuse(std::string("attribute '") + needed + "' is missing");
      if (!multiPart && !part.type.empty() && part.type != "scanlineimage")
        refuse("it is of type '" + part.type + "', not scanlineimage");
      if (multiPart && (!part.types.count("name") || part.type != "scanlineimage"))
        refuse("a part has no name or is not of type scanlineimage");
      checkWindows(part);
      if (part.channels == 0) refuse("a part has no channels");
      channels += std::uint64_t(part.channels);
      if (part.compression > 3)
        refuse("its compression is number " + std::to_string(part.compression) +
               ", not none, RLE, ZIPS or ZIP");
      const std::int64_t lines = part.compression == 3 ? 16 : 1;
      const std::int64_t chunks = (part.data.height() + lines - 1) / lines;
      if (part.chunkCount != (multiPart ? chunks : -1) && part.chunkCount != chunks)
        refuse("it claims " + std::to_string(part.chunkCount) +
               " chunks where its data window has " + std::to_string(chunks));
      tableBytes += std::uint64_t(chunks) * 8;
      // Decoders make room for whole chunks, however few lines a picture has.
      if (std::uint64_t(part.data.width()) * part.bytesPerPixel * std::uint64_t(lines) >
          ExrLimits::kChunkBytes)
        refuse("its chunks are larger than 128 MiB");
      storedBytes +=
          std::uint64_t(part.data.width()) * std::uint64_t(part.data.height()) * part.bytesPerPixel;
    }
    if (channels > ExrLimits::kChannels)
      refuse("it has more than " + std::to_string(ExrLimits::kChannels) + " channels");
    if (headerBytes + tableBytes > fileBytes_) refuse("it ends before its table of chunks does");
    if (storedBytes / ExrLimits::kDeflateRatio > fileBytes_)
      refuse("it claims " + std::to_string(storedBytes) + " bytes of pixels, more than its " +
             std::to_string(fileBytes_) + " bytes can hold");
  }

  void checkWindows(const Part& part) const {
    const Window &data = part.data, &display = part.display;
    if (display.x0 != 0 || display.y0 != 0 || display.width() < 1 || display.height() < 1)
      refuse("its display window does not start at (0, 0)");
    if (display.width() > ExrLimits::kSide || display.height() > ExrLimits::kSide)
      refuse("its picture is " + std::to_string(display.width()) + " x " +
             std::to_string(display.height()) + ", more than " + std::to_string(ExrLimits::kSide) +
             " a side");
    if (data.x0 < 0 || data.y0 < 0 || data.x1 > display.x1 || data.y1 > display.y1 ||
        data.width() < 1 || data.height() < 1)
      refuse("its data window is empty or leaves the display window");
  }

  const std::filesystem::path& name_;
  std::uint64_t fileBytes_;
};

}  // namespace

void scanExr(const std::filesystem::path& name, std::uint64_t fileBytes, const ReadAt& read) {
  Scanner scanner(name, fileBytes);
  std::vector<char> prefix;
  for (std::uint64_t want = 64 << 10;; want *= 4) {
    want = std::min({want, fileBytes, ExrLimits::kHeaderBytes});
    std::size_t have = prefix.size();
    prefix.resize(std::size_t(want));
    read(have, prefix.size() - have, prefix.data() + have);
    try {
      return scanner.run(prefix);
    } catch (const NeedMore&) {
      if (want == fileBytes) scanner.refuse("it ends within its header");
      if (want == ExrLimits::kHeaderBytes) scanner.refuse("its header is larger than 16 MiB");
    }
  }
}

}  // namespace vestige
