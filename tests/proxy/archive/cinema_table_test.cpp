// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/base/durable_file.h"
#include "tests/proxy/archive/archive_fixture.h"

namespace vestige::test {
namespace {

ArchiveRow someRow(double time, long cycle) {
  const std::string stem = "c" + std::to_string(cycle) + "/front/t.mip";
  return {time, cycle, "front", "t", "mip", stem + ".exr", stem + ".png"};
}

TEST(CinemaTable, TimesHaveAPointAndReadBackExactly) {
  for (double time : {0.0, 1.0, -3.0, 0.1, 1e20, 1e-300, 1.0 / 3.0, 5e-324, 1.7976931348623157e308,
                      123456789.0, 1e22}) {
    std::string line = tableLine(someRow(time, 1));
    std::string cell = line.substr(0, line.find(','));
    EXPECT_NE(cell.find('.'), std::string::npos) << cell;
    bool torn = true;
    auto rows = rowsFromTable(tableText({someRow(time, 1)}), torn);
    EXPECT_FALSE(torn);
    ASSERT_EQ(rows.size(), 1u);
    EXPECT_EQ(rows[0], someRow(time, 1));
  }
  EXPECT_EQ(tableLine(someRow(1e20, 1)).substr(0, 8), "1.0e+20,");
}

TEST(CinemaTable, TheHeaderKeepsTheRulesOfSpecD) {
  EXPECT_EQ(tableHeaderLine(), "time,cycle,view,field,proxy,FILE_exr,FILE\n");
}

TEST(CinemaTable, EveryPrefixOfATableOpens) {
  std::vector<ArchiveRow> rows = {someRow(0.0, 0), someRow(0.5, 10), someRow(1.0, 20)};
  const std::string whole = tableText(rows);
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    const std::string prefix = whole.substr(0, size);
    bool torn = false;
    std::vector<ArchiveRow> read = rowsFromTable(prefix, torn);
    EXPECT_EQ(torn, prefix.empty() || prefix.back() != '\n');
    const long breaks = std::count(prefix.begin(), prefix.end(), '\n');
    ASSERT_EQ(long(read.size()), std::max(0L, breaks - 1));
    for (std::size_t i = 0; i < read.size(); ++i) EXPECT_EQ(read[i], rows[i]);
  }
}

TEST(CinemaTable, EveryPrefixOfAnArchivesTableOpensAndCanBeContinued) {
  Folder folder;
  const fs::path path = folder / "a.cdb", table = path / "data.csv";
  {
    ArchiveWriter writer(path, ExistingArchive::Refuse);
    writeStep(writer, 0, 0.0);
  }
  const std::string whole = contents(table);
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    overwrite(table, whole.substr(0, size));
    const std::size_t rows = Archive(path).rows().size();
    // A table is put in place whole and then grows: less than its first line is damage.
    const bool beheaded = size < tableHeaderLine().size();
    std::vector<Finding> findings = checkArchive(path);
    for (const Finding& f : findings)
      EXPECT_EQ(f.leftover, !(beheaded && f.file == "data.csv")) << f.file << f.problem;
    EXPECT_EQ(beheaded, std::any_of(findings.begin(), findings.end(),
                                    [](const Finding& f) { return !f.leftover; }));
    if (size % 37) continue;
    {
      ArchiveWriter writer(path, ExistingArchive::Append);
      EXPECT_EQ(Archive(path).rows().size(), rows);
      EXPECT_EQ(contents(table).back(), '\n');
      writeStep(writer, 10, 1.0);
    }
    EXPECT_EQ(Archive(path).rows().size(), rows + 5);
    for (const Finding& f : checkArchive(path)) EXPECT_TRUE(f.leftover) << f.file << f.problem;
    fs::remove_all(path / "c00000010");
  }
}

TEST(CinemaTable, DamageIsNamedByItsLine) {
  auto damaged = [](const std::string& line, const std::string& words) {
    expectError(ErrorCode::Format, "line 3", [&] {
      bool torn;
      rowsFromTable(tableText({someRow(0.0, 0)}) + line + "\n", torn);
    });
    expectError(ErrorCode::Format, words, [&] {
      bool torn;
      rowsFromTable(tableText({someRow(0.0, 0)}) + line + "\n", torn);
    });
  };
  damaged("", "1 cells, not 7");
  damaged("0.0,1,front,t,mip,a.exr", "6 cells");
  damaged("0.0,1,front,t,mip,a.exr,a.png,x", "8 cells");
  damaged("0,1,front,t,mip,a.exr,a.png", "time '0'");
  damaged("inf,1,front,t,mip,a.exr,a.png", "time 'inf'");
  damaged("0.0x,1,front,t,mip,a.exr,a.png", "time '0.0x'");
  damaged("0.0,1.5,front,t,mip,a.exr,a.png", "cycle '1.5'");
  damaged("0.0,-1,front,t,mip,a.exr,a.png", "cycle '-1'");
  damaged("0.0,99999999999999999999,front,t,mip,a.exr,a.png", "cycle '9999");
  damaged("0.0,1,,t,mip,a.exr,a.png", "view name ''");
  damaged("0.0,1,front,\"t\",mip,a.exr,a.png", "quote");
  damaged("0.0,1,front,t,mip,,a.png", "file ''");
  damaged("0.0,1,front,t,mip,/etc/passwd,a.png", "/etc/passwd");
  damaged("0.0,1,front,t,mip,a/../../b.exr,a.png", "a/../../b.exr");
  bool torn;
  expectError(ErrorCode::Format, "line 1", [&] { rowsFromTable("a,b\n", torn); });
  expectError(ErrorCode::Format, "line 1", [&] { rowsFromTable("no table", torn); });
}

TEST(CinemaTable, TenThousandRowsOpen) {
  Folder folder;
  std::vector<ArchiveRow> rows;
  for (long i = 0; i < 10000; ++i) rows.push_back(someRow(0.1 * double(i), i));
  overwrite(folder / "data.csv", tableText(rows));
  Archive archive(folder.path());
  EXPECT_EQ(archive.rows(), rows);
  EXPECT_EQ(archive.cycles().size(), 10000u);
  EXPECT_TRUE(archive.find(9999, "front", "t", "mip"));
}

}  // namespace
}  // namespace vestige::test
