// SPDX-License-Identifier: BSD-3-Clause
#include <cstring>

#include "proxy/base/durable_file.h"
#include "proxy/format/exr/exr_scan.h"
#include "proxy/format/exr/png_file.h"
#include "tests/proxy/archive/archive_fixture.h"

namespace vestige::test {
namespace {

std::string textOf(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Decodes a file of these bytes: it may be fine, or an Error that names the file. Anything else
/// (a crash, another exception, a finding of the sanitizers) fails the test.
bool opens(const fs::path& path, const std::string& bytes) {
  overwrite(path, bytes);
  try {
    if (path.extension() == ".png")
      readPng(path);
    else
      ExrFile(path).image();
    return true;
  } catch (const Error& e) {
    EXPECT_TRUE(e.code() == ErrorCode::Format || e.code() == ErrorCode::Io) << e.what();
    EXPECT_NE(std::string(e.what()).find(path.string()), std::string::npos) << e.what();
    return false;
  }
}

std::string smallExr(std::size_t kind) {
  ProxyHeader h = someHeader({6, 5});
  h.partition = IntervalPartition::uniform(0.1, 0.7, 1);
  h.isovalues = {0.2};
  h.base.reset();
  return textOf(encodeExr(someImages(h)[kind]));
}

/// Where the value of an attribute begins.
std::size_t valueOf(const std::string& bytes, const std::string& name, const std::string& type) {
  const std::string key = name + '\0' + type + '\0';
  const std::size_t at = bytes.find(key);
  EXPECT_NE(at, std::string::npos) << name;
  return at + key.size() + 4;
}

void put(std::string& bytes, std::size_t at, std::int32_t value) {
  std::memcpy(bytes.data() + at, &value, 4);
}

TEST(HostileFile, EveryTruncatedExrIsRefused) {
  Folder folder;
  for (std::size_t kind : {1, 3}) {
    const std::string whole = smallExr(kind);
    for (std::size_t size = 0; size < whole.size(); ++size)
      EXPECT_FALSE(opens(folder / "a.exr", whole.substr(0, size))) << size;
    EXPECT_TRUE(opens(folder / "a.exr", whole));
  }
}

TEST(HostileFile, NoFlippedByteOfAnExrDoesHarm) {
  Folder folder;
  setExrThreads(0);  // thousands of tiny files: waking threads would be most of the work
  for (std::size_t kind : {2, 3}) {
    const std::string whole = smallExr(kind);
    for (std::size_t at = 0; at < whole.size(); ++at) {
      std::string bytes = whole;
      bytes[at] = char(bytes[at] ^ (kind == 2 ? 0xff : 1 << at % 8));
      opens(folder / "a.exr", bytes);
    }
  }
  setExrThreads(2);
}

TEST(HostileFile, NoFlippedOrMissingByteOfAPngDoesHarm) {
  Folder folder;
  const std::string whole = textOf(encodePng(someRaster()));
  for (std::size_t at = 0; at < whole.size(); ++at) {
    EXPECT_FALSE(opens(folder / "a.png", whole.substr(0, at)));
    for (int flip : {0x01, 0x80, 0xff}) {
      std::string bytes = whole;
      bytes[at] = char(bytes[at] ^ flip);
      opens(folder / "a.png", bytes);
    }
  }
}

TEST(HostileFile, ATinyFileThatClaimsAHugePictureIsRefusedBeforeItIsAllocated) {
  Folder folder;
  std::string bytes = smallExr(3);
  const std::size_t data = valueOf(bytes, "dataWindow", "box2i"),
                    display = valueOf(bytes, "displayWindow", "box2i");
  auto refused = [&](const std::string& words) {
    overwrite(folder / "a.exr", bytes);
    expectError(ErrorCode::Format, words, [&] { ExrFile file(folder / "a.exr"); });
  };
  put(bytes, display + 8, 32767), put(bytes, display + 12, 32767);
  refused("claims pictures of 4294967296 bytes");
  put(bytes, data + 8, 32767), put(bytes, data + 12, 15);
  refused("more than its");
  put(bytes, data + 12, 32767);
  refused("ends before its table of chunks");
  put(bytes, display + 8, 32768);
  refused("more than 32768 a side");
  put(bytes, display + 8, 2147483647);
  refused("a side");
  put(bytes, display + 8, -2147483647 - 1);
  refused("display window");
  put(bytes, display + 8, 5), put(bytes, display + 12, 4);
  refused("data window");
  put(bytes, data, -5);
  refused("data window");
}

TEST(HostileFile, FalseClaimsOfTheHeaderAreNamed) {
  Folder folder;
  const std::string whole = smallExr(1);
  auto refused = [&](const std::string& words, const std::function<void(std::string&)>& spoil) {
    std::string bytes = whole;
    spoil(bytes);
    overwrite(folder / "a.exr", bytes);
    expectError(ErrorCode::Format, words, [&] { ExrFile(folder / "a.exr").image(); });
  };
  refused("does not begin like", [](auto& b) { b[0] = 'x'; });
  refused("version is 3", [](auto& b) { b[4] = 3; });
  refused("tiled or deep", [](auto& b) { b[5] = char(b[5] | 0x08); });
  refused("unknown flags", [](auto& b) { b[6] = 1; });
  refused("claims 2147483647 bytes",
          [](auto& b) { put(b, valueOf(b, "vestige:field", "string") - 4, 2147483647); });
  refused("compression is number 4",
          [](auto& b) { b[valueOf(b, "compression", "compression")] = 4; });
  refused("claims 1000000 chunks",
          [](auto& b) { put(b, valueOf(b, "chunkCount", "int"), 1000000); });
  refused("schema version is 99", [](auto& b) { put(b, valueOf(b, "vestige:schema", "int"), 99); });
  refused("subsampled", [](auto& b) { put(b, valueOf(b, "channels", "chlist") + 4 + 8, 1000); });
  refused("'vestige:cycle' has 'x0'",
          [](auto& b) { b[valueOf(b, "vestige:cycle", "string")] = 'x'; });
  refused("vestige:channels",
          [](auto& b) { b[valueOf(b, "vestige:channels", "string") + 3] = ' '; });
  refused("vestige:unit",
          [](auto& b) { b[valueOf(b, "vestige:unit", "double") + 7] = char(0xff); });
  refused("more than 80 parts", [](auto& b) {
    const std::size_t first = 8, end = b.find(std::string("\0channels", 9), first);
    std::string header = b.substr(first, end + 1 - first);
    for (int i = 0; i < 90; ++i) b.insert(first, header);
  });
}

TEST(HostileFile, ManyChannelsAreCountedBeforeTheyAreMade) {
  Folder folder;
  std::string bytes = smallExr(3);
  const std::size_t value = valueOf(bytes, "channels", "chlist");
  std::string list;
  for (int i = 0; i < 5000; ++i) {
    list += "c" + std::to_string(10000 + i) + '\0' +
            std::string("\2\0\0\0\0\0\0\0\1\0\0\0\1\0\0\0", 16);
  }
  list += '\0';
  std::int32_t old;
  std::memcpy(&old, bytes.data() + value - 4, 4);
  bytes.replace(value, std::size_t(old), list);
  put(bytes, value - 4, std::int32_t(list.size()));
  overwrite(folder / "a.exr", bytes);
  expectError(ErrorCode::Format, "more than 4096 channels", [&] { ExrFile f(folder / "a.exr"); });
}

TEST(HostileFile, WhatIsNoFileIsAnIoError) {
  Folder folder;
  expectError(ErrorCode::Io, "nothing.exr", [&] { ExrFile file(folder / "nothing.exr"); });
  expectError(ErrorCode::Io, folder.path().string(), [&] { ExrFile file(folder.path()); });
  expectError(ErrorCode::Io, "nothing.png", [&] { readPng(folder / "nothing.png"); });
  overwrite(folder / "a.exr", "");
  expectError(ErrorCode::Format, "ends within its header", [&] { ExrFile f(folder / "a.exr"); });
}

TEST(HostileFile, PicturesMustFitTheirFiles) {
  EXPECT_TRUE(pictureFitsFile(std::uint64_t(512) << 20, 100));
  EXPECT_FALSE(pictureFitsFile((std::uint64_t(512) << 20) + 1, 100));
  EXPECT_TRUE(pictureFitsFile(std::uint64_t(4) << 30, 5u << 20));
}

TEST(HostileFile, APngThatClaimsTooMuchIsRefused) {
  Folder folder;
  Raster raster{{100, 100}, std::vector<std::uint8_t>(40000, 7)};
  std::string bytes = textOf(encodePng(raster));
  EXPECT_TRUE(opens(folder / "a.png", bytes));
  // Width and height stand at 16 and 20, big endian; the checksum after them goes wrong too, which
  // libpng reports first: both are refusals.
  bytes[18] = 0x7f;
  EXPECT_FALSE(opens(folder / "a.png", bytes));
}

}  // namespace
}  // namespace vestige::test
