// SPDX-License-Identifier: BSD-3-Clause
// Hostile archives: tables, paths, links, special files and previews that
// nobody sane would write.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <zlib.h>

#include <random>

#include "archive_fixture.h"
#include "hostile.h"
#include "proxy/format/exr/png_file.h"

namespace vestige {
namespace {

using namespace vestige::test;

class HostileArchive : public testing::Test {
 protected:
  static void SetUpTestSuite() { setExrThreads(0); }  // tests fork

  Folder folder_;
  const fs::path archive_ = folder_ / "run.cdb";
  const fs::path table_ = archive_ / "data.csv";

  HostileArchive() {
    ArchiveWriter writer(archive_, ExistingArchive::Refuse);
    writeStep(writer, 1, 0.5);
    writeStep(writer, 2, 1.0);
  }

  /// What reading all of the archive does wrong.
  std::string reaction(bool mustRefuse = false) const {
    const auto readAll = [&] {
      const Archive archive(archive_);
      for (const ArchiveRow& row : archive.rows()) {
        const std::string wrong = complaint(
            row.exr, [&] { archive.open(row).image(); }, mustRefuse);
        if (!wrong.empty()) throw std::runtime_error(row.exr.substr(0, 200) + ": " + wrong);
      }
    };
    std::string wrong = complaint(archive_, readAll);
    // check and repair report, and throw nothing but Error.
    if (wrong.empty()) wrong = complaint(archive_, [&] { checkArchive(archive_); });
    return wrong;
  }
  std::string firstRow(const std::string& exr, const std::string& png = "c00000001/x.png") const {
    return tableHeaderLine() + "0.5,1,front,temperature,mip," + exr + "," + png + "\n";
  }
  void expectTableRefused(const std::string& text) const {
    replaceFile(table_, text);
    EXPECT_EQ(contained([&] {
                std::string wrong = complaint(
                    archive_, [&] { Archive a(archive_); }, true);
                if (wrong.empty()) wrong = complaint(archive_, [&] { checkArchive(archive_); });
                if (wrong.empty() && checkArchive(archive_).empty()) wrong = "passes the check";
                return wrong;
              }),
              "")
        << text.substr(0, 300);
  }
};

TEST_F(HostileArchive, TablesThatPointOutsideAreRefused) {
  for (const char* path : {"../secret.exr", "c00000001/../../secret.exr", "..", "/etc/passwd", "",
                           "//etc/passwd", "c00000001/..", "\"c00000001/x.exr\""}) {
    expectTableRefused(firstRow(path));
    expectTableRefused(firstRow("c00000001/x.exr", path));
  }
}

TEST_F(HostileArchive, TablesWithOddCharactersAreRefused) {
  const std::string sound = contents(table_);
  const std::string nul(1, '\0');
  expectTableRefused(firstRow("c00000001/x" + nul + ".exr"));
  expectTableRefused(firstRow("c00000001/x\r.exr"));
  expectTableRefused(firstRow("c00000001/x.exr", "c00000001/x.png\r"));
  expectTableRefused(firstRow("c00000001/x\x1b[31m.exr"));
  expectTableRefused(nul + sound);
  expectTableRefused(std::string(100000, '\0') + "\n");
  expectTableRefused("\xef\xbb\xbf" + sound);
  std::string crlf;
  for (const char c : sound) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
  expectTableRefused(crlf);
  std::string quoted = sound;
  quoted.replace(quoted.find("front"), 5, "\"front\"");
  expectTableRefused(quoted);
}

TEST_F(HostileArchive, TablesWithAMillionCharactersInACellAreRefused) {
  const std::string much(1000000, 'x');
  expectTableRefused(firstRow(much));
  expectTableRefused(firstRow("c00000001/x.exr", much));
  expectTableRefused(tableHeaderLine() + "0.5,1," + much + ",temperature,mip,a.exr,a.png\n");
  expectTableRefused(tableHeaderLine() + much + ",1,front,temperature,mip,a.exr,a.png\n");
  expectTableRefused(tableHeaderLine() + std::string(1000000, ',') + "\n");
  expectTableRefused(much + "\n");
  std::string deep;
  for (int i = 0; i < 300000; ++i) deep += "d/";
  expectTableRefused(firstRow(deep + "x.exr"));
}

TEST_F(HostileArchive, TablesWithOddNumbersAreRefused) {
  for (const char* cells :
       {"nan,1", "inf,1", "1,1", "1.0,-1", "1.0,1.0", "1.0,99999999999999999999", "1.0,", ",1",
        "0x1.8p3,1", "1.0e999,1", " 1.0,1", "1.0,0x10"})
    expectTableRefused(tableHeaderLine() + cells + ",front,temperature,mip,a.exr,a.png\n");
}

TEST_F(HostileArchive, MutilatedTablesNeverCrash) {
  const std::string sound = contents(table_);
  EXPECT_EQ(contained([&]() -> std::string {
              std::mt19937 engine(4);
              for (int i = 0; i < 1500; ++i) {
                std::string text = sound;
                for (unsigned n = 1 + engine() % 4; n > 0; --n) {
                  const std::size_t at = engine() % text.size();
                  if (engine() % 3 == 0)
                    text.erase(at, engine() % 50);
                  else if (engine() % 2 == 0)
                    text[at] = char(engine());
                  else
                    text.insert(at, 1 + engine() % 3, ",./\n\"\r0-"[engine() % 9]);
                }
                replaceFile(table_, text);
                bool torn = false;
                std::string wrong = complaint("data.csv", [&] { rowsFromTable(text, torn); });
                if (wrong.empty() && i % 25 == 0) wrong = reaction();
                if (!wrong.empty()) return std::to_string(i) + ": " + wrong;
              }
              return {};
            }),
            "");
}

TEST_F(HostileArchive, LinksThatLeaveTheArchiveAreNotFollowed) {
  const ArchiveRow row = Archive(archive_).rows().front();
  const fs::path inside = archive_ / row.exr, outside = folder_ / "outside";
  fs::create_directory(outside);
  fs::copy_file(inside, outside / inside.filename());
  fs::remove(inside);
  fs::create_symlink(outside / inside.filename(), inside);
  EXPECT_EQ(complaint(
                inside, [&] { Archive(archive_).open(row); }, true),
            "");
  EXPECT_FALSE(checkArchive(archive_).empty());

  fs::remove(inside);
  const fs::path view = inside.parent_path();
  fs::rename(view, folder_ / "moved");
  fs::create_directory_symlink(folder_ / "moved", view);
  for (const ArchiveRow& each : Archive(archive_).rows())
    if (each.cycle == row.cycle) {
      EXPECT_EQ(complaint(
                    each.exr, [&] { Archive(archive_).open(each); }, true),
                "");
    }
  EXPECT_FALSE(checkArchive(archive_).empty());
  const auto before = std::distance(fs::directory_iterator(folder_ / "moved"), {});
  repairArchive(archive_);
  ArchiveWriter(archive_, ExistingArchive::Overwrite);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "moved"), {}), before);
  EXPECT_TRUE(fs::exists(outside / inside.filename()));
}

TEST_F(HostileArchive, AnArchiveThatIsItselfReachedByALinkOpens) {
  fs::create_directory_symlink(archive_, folder_ / "link");
  for (const fs::path& path : {folder_ / "link", fs::relative(archive_), archive_ / ""}) {
    const Archive archive(path);
    EXPECT_EQ(archive.open(archive.rows().front()).header().cycle, 1);
    EXPECT_TRUE(checkArchive(path).empty());
  }
}

TEST_F(HostileArchive, SpecialFilesNeitherHangNorFloodMemory) {
  const ArchiveRow row = Archive(archive_).rows().front();
  const fs::path exr = archive_ / row.exr, png = archive_ / row.png;
  const std::function<void(const fs::path&)> makes[] = {
      [](const fs::path& p) { ASSERT_EQ(::mkfifo(p.c_str(), 0600), 0); },
      [](const fs::path& p) { fs::create_directory(p); },
      [](const fs::path& p) { fs::create_symlink(p, p); },
      [](const fs::path& p) { fs::create_symlink("/dev/zero", p); },
      [](const fs::path& p) { fs::create_symlink("/nowhere/at/all", p); },
      [](const fs::path& p) {
        std::ofstream(p).put('x');
        ASSERT_EQ(::truncate(p.c_str(), off_t(1) << 40), 0);
      }};
  for (const auto& make : makes) {
    for (const fs::path& victim : {exr, png, table_}) {
      fs::remove(victim);
      make(victim);
      EXPECT_EQ(contained([&] {
                  return complaint(
                      victim, [&] { ExrFile f(victim); }, true);
                }),
                "");
      EXPECT_EQ(contained([&] {
                  return complaint(
                      victim, [&] { readPng(victim); }, true);
                }),
                "");
      EXPECT_EQ(contained([&] {
                  const std::string wrong = reaction();
                  return wrong.empty() && checkArchive(archive_).empty() ? "passes" : wrong;
                }),
                "")
          << victim;
      fs::remove(victim);
    }
    fs::remove_all(archive_);
    ArchiveWriter writer(archive_, ExistingArchive::Refuse);
    writeStep(writer, 1, 0.5);
  }
}

TEST_F(HostileArchive, DamagedFilesAreFoundAndRepairLeavesThemOut) {
  const std::vector<ArchiveRow> rows = Archive(archive_).rows();
  fs::resize_file(archive_ / rows[0].exr, 1000);
  replaceFile(archive_ / rows[1].png, "no picture");
  fs::copy_file(archive_ / rows[3].exr, archive_ / rows[2].exr,
                fs::copy_options::overwrite_existing);
  EXPECT_GE(checkArchive(archive_).size(), 3u);
  EXPECT_GE(repairArchive(archive_).size(), 2u);
  for (const Finding& finding : checkArchive(archive_)) EXPECT_TRUE(finding.leftover);
  // The proxy with the damaged preview stays.
  EXPECT_EQ(Archive(archive_).rows().size(), rows.size() - 2);
}

// --- previews
// ------------------------------------------------------------------------------------

std::string bigEndian(std::uint32_t n) {
  return {char(n >> 24), char(n >> 16), char(n >> 8), char(n)};
}
std::string chunk(const std::string& type, const std::string& data) {
  const std::string body = type + data;
  const auto sum = ::crc32(0, reinterpret_cast<const Bytef*>(body.data()), uInt(body.size()));
  return bigEndian(std::uint32_t(data.size())) + body + bigEndian(std::uint32_t(sum));
}
std::string deflated(const std::string& data) {
  uLongf size = ::compressBound(uLong(data.size()));
  std::string out(size, '\0');
  ::compress2(reinterpret_cast<Bytef*>(out.data()), &size,
              reinterpret_cast<const Bytef*>(data.data()), uLong(data.size()), 9);
  out.resize(size);
  return out;
}
std::string pngOf(std::uint32_t width, std::uint32_t height, int depth, int color, int interlace,
                  const std::string& before, const std::string& data) {
  return "\x89PNG\r\n\x1a\n" +
         chunk("IHDR", bigEndian(width) + bigEndian(height) + char(depth) + char(color) +
                           std::string(2, '\0') + char(interlace)) +
         before + chunk("IDAT", data) + chunk("IEND", "");
}

class HostilePng : public testing::Test {
 protected:
  Folder folder_;
  const fs::path file_ = folder_ / "some.png";
  std::string reaction(const std::string& bytes, bool mustRefuse) const {
    replaceFile(file_, bytes);
    return complaint(
        file_,
        [&] {
          const Raster raster = readPng(file_);
          if (raster.rgba.size() != raster.size.pixels() * 4) throw std::logic_error("short");
        },
        mustRefuse);
  }
};

TEST_F(HostilePng, TruncationAnywhereIsRefused) {
  writePng(file_, someRaster({80, 60}));
  const std::string whole = contents(file_);
  EXPECT_EQ(contained([&] {
              for (std::size_t size = 0; size < whole.size() - 12; size += 16) {
                const std::string wrong = reaction(whole.substr(0, size), true);
                if (!wrong.empty()) return std::to_string(size) + " bytes: " + wrong;
              }
              return reaction(whole, false);
            }),
            "");
}

TEST_F(HostilePng, EveryKindOfPngGivesWholePixelsOrASentence) {
  std::mt19937 engine(5);
  const std::string data = deflated(std::string(4000, '\1'));
  EXPECT_EQ(contained([&]() -> std::string {
              for (const int color : {0, 1, 2, 3, 4, 5, 6, 7, 99})
                for (const int depth : {0, 1, 2, 4, 8, 16, 32})
                  for (const int interlace : {0, 1, 2})
                    for (int extra = 0; extra < 6; ++extra) {
                      std::string before;
                      if (extra & 1) before += chunk("PLTE", std::string(3 * (engine() % 9), 'p'));
                      if (extra & 2) before += chunk("tRNS", std::string(engine() % 9, '\0'));
                      if (extra & 4) before += chunk("tEXt", std::string(engine() % 900, 't'));
                      const std::string wrong =
                          reaction(pngOf(7, 5, depth, color, interlace, before, data), false);
                      if (!wrong.empty())
                        return std::to_string(color) + " " + std::to_string(depth) + ": " + wrong;
                    }
              return {};
            }),
            "");
}

TEST_F(HostilePng, HugeClaimsTakeBoundedMemory) {
  const std::string little = deflated("little");
  for (const std::uint32_t side : {0u, 32769u, 0x7fffffffu, 0xffffffffu, 32768u})
    for (const int color : {0, 2, 6})
      EXPECT_EQ(
          contained([&] { return reaction(pngOf(side, side, 8, color, 0, "", little), true); }), "")
          << side;
  // One bit a pixel, well deflated: 130 kB that are 4 GiB of RGBA.
  const std::string bomb = deflated(std::string(std::size_t(4097) * 32768, '\0'));
  EXPECT_EQ(contained([&] { return reaction(pngOf(32768, 32768, 1, 0, 0, "", bomb), false); }), "");
}

}  // namespace
}  // namespace vestige
