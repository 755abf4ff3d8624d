// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>

#include "proxy/base/durable_file.h"
#include "proxy/archive/each_file.h"
#include "proxy/format/layout/proxy_check.h"
#include "tests/proxy/archive/archive_fixture.h"

namespace vestige::test {
namespace {

/// An archive of two steps.
class ArchiveCheck : public ::testing::Test {
 protected:
  void SetUp() override {
    ArchiveWriter writer(path_, ExistingArchive::Refuse);
    writeStep(writer, 0, 0.0);
    writeStep(writer, 10, 0.5);
    archive_ = std::make_unique<Archive>(path_);
  }

  std::vector<Finding> findings(bool leftover) const {
    std::vector<Finding> all = checkArchive(path_);
    std::erase_if(all, [&](const Finding& f) { return f.leftover != leftover; });
    return all;
  }
  /// Expects damage that names this file with these words.
  void expectDamage(const std::string& file, const std::string& words) const {
    std::string seen;
    bool found = false;
    for (const Finding& f : findings(false)) {
      seen += f.file + ": " + f.problem + "\n";
      found |= f.file == file && f.problem.find(words) != std::string::npos;
    }
    EXPECT_TRUE(found) << "expected " << file << ": " << words << "; found\n" << seen;
  }
  /// After a repair only leftovers remain and this many rows.
  void expectMended(std::size_t rows) const {
    repairArchive(path_);
    for (const Finding& f : findings(false)) ADD_FAILURE() << f.file << ": " << f.problem;
    EXPECT_EQ(Archive(path_).rows().size(), rows);
  }
  std::string file(long cycle, const std::string& proxy, const std::string& extension) const {
    const ArchiveRow* row = archive_->find(cycle, "front", "temperature", proxy);
    return extension == "exr" ? row->exr : row->png;
  }
  /// Writes an image over the file of its row.
  void replace(const ProxyImage& image) const {
    writeDurably(path_ / file(image.header.cycle, image.header.kind, "exr"), encodeExr(image));
  }
  ProxyImage image(const std::string& proxy) const {
    return archive_->open(*archive_->find(10, "front", "temperature", proxy)).image();
  }

  Folder folder_;
  fs::path path_ = folder_ / "a.cdb";
  std::unique_ptr<Archive> archive_;
};

TEST_F(ArchiveCheck, ASoundArchiveHasNoFindings) {
  EXPECT_TRUE(checkArchive(path_).empty());
  EXPECT_TRUE(repairArchive(path_).empty());
  EXPECT_EQ(Archive(path_).rows().size(), 10u);
  EXPECT_TRUE(checkArchive(path_).empty());
}

TEST_F(ArchiveCheck, MissingFilesAreFoundAndTheirRowsGoInARepair) {
  const std::string exr = file(0, "mip", "exr"), png = file(10, "depth", "png");
  fs::remove(path_ / exr);
  fs::remove(path_ / png);
  expectDamage(exr, "does not exist");
  expectDamage(png, "does not exist");
  expectMended(9);  // without its preview, a proxy stays
  EXPECT_FALSE(Archive(path_).find(10, "front", "temperature", "depth")->hasPreview());
}

TEST_F(ArchiveCheck, DamagedFilesAreFoundAndTheirRowsGoInARepair) {
  const std::string cut = file(0, "mip", "exr"), flipped = file(10, "length", "exr"),
                    png = file(10, "reference", "png");
  std::string bytes = contents(path_ / cut);
  overwrite(path_ / cut, bytes.substr(0, bytes.size() - 5));
  bytes = contents(path_ / flipped);
  bytes[bytes.size() - 9] = char(bytes[bytes.size() - 9] ^ 0x10);
  overwrite(path_ / flipped, bytes);
  bytes = contents(path_ / png);
  bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 0x10);
  overwrite(path_ / png, bytes);
  expectDamage(cut, "not a readable proxy");
  expectDamage(flipped, "not a readable proxy");
  expectDamage(png, "not a readable PNG");
  std::vector<Finding> leftOut = repairArchive(path_);
  EXPECT_EQ(leftOut.size(), 3u);
  expectMended(8);
}

TEST_F(ArchiveCheck, ExchangedFilesAreFoundAndRepaired) {
  const std::string a = file(0, "mip", "exr"), b = file(10, "mip", "exr");
  const std::string bytes = contents(path_ / a);
  overwrite(path_ / a, contents(path_ / b));
  overwrite(path_ / b, bytes);
  expectDamage(a, "its time is 0.5, the table says 0");
  expectDamage(b, "its time is 0, the table says 0.5");
  expectMended(10);
}

TEST_F(ArchiveCheck, WrongRowsAreFoundAndRepaired) {
  std::vector<ArchiveRow> rows = archive_->rows();
  auto damaged = [&](const std::string& where, const std::string& words, auto spoil) {
    std::vector<ArchiveRow> bad = rows;
    spoil(bad);
    overwrite(path_ / "data.csv", tableText(bad));
    expectDamage(where, words);
    expectMended(10);
  };
  damaged(rows[0].exr, "its cycle is 0, the table says 1", [](auto& r) { r[0].cycle = 1; });
  damaged(rows[1].exr, "its view is 'front'", [](auto& r) { r[1].view = "back"; });
  damaged(rows[1].exr, "its field is 'temperature'", [](auto& r) { r[1].field = "rho"; });
  damaged(rows[1].exr, "its kind is 'length'", [](auto& r) { r[1].proxy = "depth"; });
  damaged("data.csv", "comes twice", [](auto& r) { r.push_back(r[0]); });
  damaged("data.csv", "another row of the cycle has", [](auto& r) { r[1].time = 7.0; });
  damaged("data.csv", "belongs to another row too", [](auto& r) { r[1].png = r[0].png; });
  overwrite(path_ / "data.csv", "time,cycle\n1.0,2\n");
  expectDamage("data.csv", "the header is not");
  expectMended(10);
  fs::remove(path_ / "data.csv");
  expectDamage("data.csv", "No such file");
  expectMended(10);
}

TEST_F(ArchiveCheck, LeftoversAreNamedButAreNoDamage) {
  std::string table = contents(path_ / "data.csv");
  overwrite(path_ / "data.csv", table.substr(0, table.size() - 3));
  overwrite(path_ / "c00000010/front/x.exr.tmp", "half a file");
  overwrite(path_ / "data.csv.tmp", "");
  EXPECT_TRUE(findings(false).empty());
  std::vector<Finding> left = findings(true);
  std::vector<std::string> files;
  for (const Finding& f : left) files.push_back(f.file);
  std::sort(files.begin(), files.end());
  EXPECT_EQ(files,
            (std::vector<std::string>{"c00000010/front/temperature.reference.exr",
                                      "c00000010/front/temperature.reference.png",
                                      "c00000010/front/x.exr.tmp", "data.csv", "data.csv.tmp"}));
  expectMended(10);
  EXPECT_TRUE(checkArchive(path_).empty());
}

TEST_F(ArchiveCheck, ALinkOutOfTheArchiveIsFound) {
  const std::string exr = file(0, "mip", "exr");
  fs::rename(path_ / exr, folder_ / "outside.exr");
  fs::create_symlink(folder_ / "outside.exr", path_ / exr);
  expectDamage(exr, "link");
}

TEST_F(ArchiveCheck, ValuesThatCannotBeAreFound) {
  auto damaged = [&](const std::string& proxy, const std::string& words, auto spoil) {
    const ProxyImage good = image(proxy);
    EXPECT_TRUE(problemsOf(good).empty());
    ProxyImage bad = good;
    spoil(bad);
    replace(bad);
    expectDamage(file(10, proxy, "exr"), words);
    replace(good);
  };
  // Pixel 66 of 12 x 10 is inside the round thing, pixel 0 outside.
  auto set = [](std::size_t part, std::size_t channel, std::size_t pixel, float value) {
    return [=](ProxyImage& i) { i.parts[part].channels[channel].values[pixel] = value; };
  };
  damaged("attenuation", "a fraction of light", set(0, 0, 66, -0.25f));
  damaged("attenuation", "a fraction of light", set(0, 0, 66, 1.5f));
  damaged("attenuation", "a fraction of light", set(0, 0, 66, NAN));
  damaged("attenuation", "add up to 1.5 at pixel (0, 0)", set(0, 0, 0, 0.5f));
  damaged("length", "a length within the domain", set(0, 0, 66, 100.0f));
  damaged("length", "a depth within the domain", set(1, 0, 66, 100.0f));
  damaged("length", "a whole number >= 1", set(2, 0, 66, 0.0f));
  damaged("length", "or 0 where the length is 0", set(2, 0, 0, 1.0f));
  damaged("length", "stay within the domain", [](ProxyImage& i) {
    for (std::size_t k = 0; k < 4; ++k)
      i.parts[0].channels[k].values[66] = float(0.4 * i.header.domain.diagonal());
  });
  damaged("depth", "a depth within the domain or +infinity", set(0, 0, 66, -50.0f));
  damaged("depth", "a depth within the domain or +infinity", set(1, 0, 0, NAN));
  damaged("depth", "a unit vector", set(0, 3, 66, 3.0f));
  damaged("depth", "else 0", set(0, 1, 0, 1.0f));
  damaged("mip", "within the field's range", set(0, 0, 66, 1e9f));
  damaged("reference", "light >= 0", set(0, 0, 66, -1.0f));
  damaged("reference", "an opacity", set(0, 3, 66, 2.0f));
  damaged("length", "part 'runs' is missing", [](ProxyImage& i) { i.parts.pop_back(); });
  damaged("length", "does not have the channels",
          [](ProxyImage& i) { i.parts[0].channels[2].name = "i07"; });
  damaged("length", "it has no interval bounds", [](ProxyImage& i) { i.header.partition.reset(); });
  damaged("depth", "it has 2 parts", [](ProxyImage& i) { i.header.isovalues.pop_back(); });
  EXPECT_TRUE(checkArchive(path_).empty());
}

TEST_F(ArchiveCheck, OfTwoFilesOfOneRowARepairKeepsTheTables) {
  fs::create_directories(path_ / "c00000010-2/front");
  for (const char* ending : {"exr", "png"})
    fs::copy(path_ / file(10, "mip", ending),
             path_ / "c00000010-2/front" / (std::string("temperature.mip.") + ending));
  std::vector<Finding> leftOut = repairArchive(path_);
  ASSERT_EQ(leftOut.size(), 1u);
  EXPECT_EQ(leftOut[0].file, "c00000010-2/front/temperature.mip.exr");
  fs::remove(path_ / "data.csv");
  leftOut = repairArchive(path_);
  ASSERT_EQ(leftOut.size(), 1u);
  EXPECT_EQ(leftOut[0].file, "c00000010/front/temperature.mip.exr");
}

TEST_F(ArchiveCheck, AFolderThatIsNoneCannotBeRepaired) {
  expectError(ErrorCode::NotFound, "nowhere", [&] { repairArchive(folder_ / "nowhere"); });
}

/// What a command prints; it must succeed.
std::string outputOf(const std::string& command) {
  std::FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  std::string text;
  std::array<char, 4096> buffer;
  while (std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe))
    text.append(buffer.data(), n);
  EXPECT_EQ(::pclose(pipe), 0) << command << ": " << text;
  return text;
}

bool installed(const std::string& program) {
  return std::system(("command -v " + program + " > /dev/null 2>&1").c_str()) == 0;
}

/// An archive of stacks, layers and fields.
class ArchiveCheckNewer : public ArchiveCheck {
 protected:
  void SetUp() override {
    ArchiveWriter writer(path_, ExistingArchive::Refuse);
    writeNewerStep(writer, 0);
    writeNewerStep(writer, 10);
    archive_ = std::make_unique<Archive>(path_);
  }
  const ArchiveRow& row(std::string_view proxy) const {
    for (const ArchiveRow& each : archive_->rows())
      if (each.cycle == 10 && each.proxy == proxy) return each;
    throw std::runtime_error("no row");
  }
  /// Spoils the image of the last step's proxy, expects words, and puts the good one back.
  void damaged(std::string_view proxy, const std::string& words,
               const std::function<void(ProxyImage&)>& spoil) const {
    const fs::path file = path_ / row(proxy).exr;
    const std::string good = contents(file);
    ProxyImage bad = archive_->open(row(proxy)).image();
    spoil(bad);
    writeDurably(file, encodeExr(bad));
    expectDamage(row(proxy).exr, words);
    overwrite(file, good);
  }
  static constexpr std::string_view kKinds[] = {kind::kSliced, kind::kLayered, kind::kField};
};

TEST_F(ArchiveCheckNewer, ASoundArchiveHasNoFindings) {
  EXPECT_EQ(Archive(path_).rows().size(), 6u);
  for (const Finding& f : checkArchive(path_)) ADD_FAILURE() << f.file << ": " << f.problem;
  EXPECT_TRUE(repairArchive(path_).empty());
}

TEST_F(ArchiveCheckNewer, DamagedFilesAreFoundAndTheirRowsGoInARepair) {
  for (const std::string_view proxy : kKinds) {
    const fs::path file = path_ / row(proxy).exr;
    const std::string good = contents(file);
    overwrite(file, good.substr(0, good.size() - 5));
    expectDamage(row(proxy).exr, "not a readable proxy");
    std::string flipped = good;
    flipped[good.size() - 9] = char(flipped[good.size() - 9] ^ 0x10);
    overwrite(file, flipped);
    expectDamage(row(proxy).exr, "not a readable proxy");
    fs::remove(file);
    expectDamage(row(proxy).exr, "does not exist");
  }
  repairArchive(path_);
  EXPECT_EQ(Archive(path_).rows().size(), 3u);
}

TEST_F(ArchiveCheckNewer, ExchangedKindsAndStepsAreFound) {
  const std::string stack = contents(path_ / row(kind::kSliced).exr);
  const std::string layers = contents(path_ / row(kind::kLayered).exr);
  overwrite(path_ / row(kind::kSliced).exr, layers);
  overwrite(path_ / row(kind::kLayered).exr, stack);
  expectDamage(row(kind::kSliced).exr, "its kind is 'layered', the table says 'sliced'");
  expectDamage(row(kind::kLayered).exr, "its kind is 'sliced', the table says 'layered'");
}

TEST_F(ArchiveCheckNewer, ValuesThatCannotBeAreFound) {
  const auto set = [](const char* part, std::size_t channel, std::size_t pixel, float value) {
    return [=](ProxyImage& image) {
      for (ProxyPart& each : image.parts)
        if (each.name == part) each.channels[channel].values[pixel] = value;
    };
  };
  const auto without = [](const char* part) {
    return [=](ProxyImage& image) {
      std::erase_if(image.parts, [&](const ProxyPart& each) { return each.name == part; });
    };
  };
  damaged(kind::kSliced, "whole number of levels", set("slab01", 0, 66, 2.0f));
  damaged(kind::kSliced, "1 + a rank", set("faces", 1, 66, 200.0f));
  damaged(kind::kSliced, "it has 3 parts, 3 slabs need 4", without("slab02"));
  damaged(kind::kSliced, "it has 4 parts, 2 slabs need 3",
          [](ProxyImage& image) { image.header.slabDepths.pop_back(); });
  damaged(kind::kLayered, "an optical depth", set("tau", 0, 66, -1.0f));
  damaged(kind::kLayered, "0, 1 or 2", set("state", 0, 66, 7.0f));
  damaged(kind::kLayered, "deeper than the one before", set("boundaries", 1, 66, 0.0f));
  damaged(kind::kLayered, "light >= 0", set("layer00", 1, 66, -1.0f));
  damaged(kind::kLayered, "part 'boundaries' is missing", without("boundaries"));
  damaged(kind::kField, "passes the end of its stream", set("zfp", 0, 2, 255.0f));
  damaged(kind::kField, "should hold", [](ProxyImage& image) { image.header.grid->bytes *= 2; });
  damaged(kind::kField, "has 1048576 samples, not 1 to 65536",
          [](ProxyImage& image) { image.header.grid->axes[0].count = 1 << 20; });
  EXPECT_TRUE(findings(false).empty());
}

TEST_F(ArchiveCheck, OpenExrsOwnProgramsReadTheFiles) {
  if (!installed("exrheader") || !installed("exrinfo"))
    GTEST_SKIP() << "the programs of the openexr package are not installed";
  for (const ArchiveRow& row : archive_->rows()) {
    const std::string path = "'" + (path_ / row.exr).string() + "'";
    const std::string text = outputOf("exrheader " + path);
    EXPECT_NE(text.find("vestige:field (type string): \"temperature\""), std::string::npos);
    EXPECT_NE(text.find("worldToCamera (type m44f)"), std::string::npos);
    EXPECT_NE(text.find("owner (type string): \"somebody\""), std::string::npos);
    outputOf("exrinfo " + path);
  }
}

TEST_F(ArchiveCheck, TheReaderOfTheFormatPageReadsTheSameValues) {
  if (!installed("python3")) GTEST_SKIP() << "python3 is not installed";
  const std::string page = contents(fs::path(VESTIGE_SOURCE_DIR) / "docs/archive-format.md");
  const std::string open = "```python\n";
  const std::size_t begin = page.find(open) + open.size(), end = page.find("```", begin);
  ASSERT_NE(end, std::string::npos);
  overwrite(folder_ / "reader.py", page.substr(begin, end - begin));
  overwrite(folder_ / "all.py",
            "import sys, reader\n"
            "for part in sys.argv[2:]:\n"
            "    for channel, rows in reader.read(sys.argv[1], part).items():\n"
            "        print(part, channel, *sum(rows, []))\n");
  for (const char* proxy : {"attenuation", "length", "depth", "mip", "reference"}) {
    const ProxyImage mine = image(proxy);
    std::string command = "cd '" + folder_.path().string() + "' && python3 all.py '" +
                          (path_ / file(10, proxy, "exr")).string() + "'";
    for (const ProxyPart& part : mine.parts) command += " " + part.name;
    std::istringstream lines(outputOf(command));
    for (const ProxyPart& part : mine.parts)
      for (const Channel& channel : part.channels) {
        std::string partName, channelName, number;
        lines >> partName >> channelName;
        EXPECT_EQ(partName + "." + channelName, part.name + "." + channel.name);
        for (float value : channel.values) {
          lines >> number;
          const float read = std::strtof(number.c_str(), nullptr);
          ASSERT_TRUE(read == value || (std::isnan(read) && std::isnan(value)))
              << proxy << "." << part.name << "." << channel.name << ": " << number << ", "
              << value;
        }
      }
  }
}

TEST_F(ArchiveCheck, FindsTheSameInTheSameOrderWhicheverThreadReads) {
  for (const char* proxy : {"length", "depth"})
    for (const long cycle : {0L, 10L}) fs::resize_file(path_ / file(cycle, proxy, "exr"), 100);
  const auto text = [&] {
    std::string all;
    for (const Finding& f : findings(false)) all += f.file + ": " + f.problem + "\n";
    return all;
  };
  const std::string first = text();
  EXPECT_EQ(std::count(first.begin(), first.end(), '\n'), 4) << first;
  for (int i = 0; i < 20; ++i) EXPECT_EQ(text(), first);
}

TEST_F(ArchiveCheck, TellsItsProgressOnceAFile) {
  for (const bool repair : {false, true}) {
    std::vector<int> calls;
    const auto note = [&](int done, int total) {
      EXPECT_EQ(total, int(archive_->rows().size()));
      calls.push_back(done);
    };
    repair ? repairArchive(path_, note) : checkArchive(path_, note);
    ASSERT_EQ(calls.size(), archive_->rows().size());
    for (std::size_t i = 0; i < calls.size(); ++i) EXPECT_EQ(calls[i], int(i) + 1);
  }
}

TEST(EachFile, RunsEachOnceAndPassesTheFirstExceptionOn) {
  std::vector<std::atomic<int>> runs(500);
  forEachFile(500, [&](int i) { ++runs[std::size_t(i)]; }, {});
  for (const auto& count : runs) EXPECT_EQ(count, 1);
  EXPECT_THROW(forEachFile(100,
                           [](int i) {
                             if (i == 7) throw Error(ErrorCode::Io, "seven");
                           },
                           {}),
               Error);
  forEachFile(0, [](int) { FAIL(); }, {});
}

}  // namespace
}  // namespace vestige::test
