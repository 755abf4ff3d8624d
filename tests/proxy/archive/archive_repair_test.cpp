// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <set>

#include "proxy/base/durable_file.h"
#include "proxy/format/exr/png_file.h"
#include "tests/proxy/archive/archive_fixture.h"

namespace vestige::test {
namespace {

/// An archive of three steps with timings.csv.
class ArchiveRepair : public ::testing::Test {
 protected:
  void SetUp() override {
    ArchiveWriter writer(path_, ExistingArchive::Refuse);
    for (long cycle : {0, 10, 20}) step(writer, cycle);
    table_ = contents(path_ / "data.csv");
  }
  void step(ArchiveWriter& writer, long cycle, const std::string& field = "temperature") const {
    writeStep(writer, cycle, 0.5, field);
    const bool isNew = !fs::exists(path_ / "timings.csv");
    appendDurably(path_ / "timings.csv",
                  (isNew ? "cycle,time,march\n" : "") + std::to_string(cycle) + ",0.5,1.0\n");
  }
  /// The files of a step that was placed but whose rows were not written.
  void orphan(long cycle, const std::string& field = "temperature") const {
    const std::string before = contents(path_ / "data.csv");
    {
      ArchiveWriter writer(path_, ExistingArchive::Append);
      writeStep(writer, cycle, 0.5, field);
    }
    overwrite(path_ / "data.csv", before);
  }
  std::vector<long> cycles() const { return Archive(path_).cycles(); }
  std::string damage() const {
    std::string all;
    for (const Finding& f : checkArchive(path_))
      if (!f.leftover) all += f.file + ": " + f.problem + "\n";
    return all;
  }
  void expectRepaired(const std::vector<long>& expected) const {
    repairArchive(path_);
    EXPECT_EQ(damage(), "");
    EXPECT_EQ(cycles(), expected);
    EXPECT_EQ(Archive(path_).rows().size(), 5 * expected.size());
    const std::string table = contents(path_ / "data.csv");
    repairArchive(path_);
    EXPECT_EQ(contents(path_ / "data.csv"), table) << "a repair of the repaired changes nothing";
  }

  Folder folder_;
  fs::path path_ = folder_ / "a.cdb";
  std::string table_;
};

TEST_F(ArchiveRepair, IsRefusedWhileARunWrites) {
  ArchiveWriter writer(path_, ExistingArchive::Append);
  expectError(ErrorCode::Exists, "is being written by another run", [&] { repairArchive(path_); });
  EXPECT_EQ(contents(path_ / "data.csv"), table_);
  step(writer, 30);
  EXPECT_EQ(cycles(), (std::vector<long>{0, 10, 20, 30}));
}

TEST_F(ArchiveRepair, AStepThatWasNotFinishedStaysOut) {
  orphan(30);
  EXPECT_EQ(damage(), "");
  expectRepaired({0, 10, 20});
}

TEST_F(ArchiveRepair, SupersededStepsStayOut) {
  const std::string old = "c00000020";
  fs::copy(path_ / old, folder_ / old, fs::copy_options::recursive);
  {
    ArchiveWriter writer(path_, ExistingArchive::Append);
    step(writer, 5);
  }
  EXPECT_FALSE(fs::exists(path_ / old));
  fs::copy(folder_ / old, path_ / old, fs::copy_options::recursive);  // as if killed before that
  EXPECT_EQ(damage(), "");
  expectRepaired({0, 5});
}

TEST_F(ArchiveRepair, StepsThatATruncatedTableLostAreDamageAndComeBack) {
  orphan(30);
  for (std::size_t rows : {0, 5, 10}) {
    std::size_t end = 0;
    for (std::size_t i = 0; i <= rows; ++i) end = table_.find('\n', end) + 1;
    overwrite(path_ / "data.csv", table_.substr(0, end));
    EXPECT_NE(damage().find("it has no row of cycle 20"), std::string::npos) << damage();
    expectRepaired({0, 10, 20});
  }
}

TEST_F(ArchiveRepair, AnEmptyOrBeheadedTableIsDamage) {
  for (std::size_t size : {0, 7}) {
    overwrite(path_ / "data.csv", table_.substr(0, size));
    EXPECT_NE(damage().find(size ? "data.csv: its first line is cut off" : "data.csv: it is empty"),
              std::string::npos)
        << damage();
    expectRepaired({0, 10, 20});
    // Without timings.csv, too.
    overwrite(path_ / "data.csv", table_.substr(0, size));
    fs::rename(path_ / "timings.csv", folder_ / "timings.csv");
    EXPECT_NE(damage(), "");
    expectRepaired({0, 10, 20});
    fs::rename(folder_ / "timings.csv", path_ / "timings.csv");
  }
}

TEST_F(ArchiveRepair, AStepThatIsInTheTableInPartIsCompleted) {
  fs::remove(path_ / "timings.csv");
  orphan(30);
  for (std::size_t bytes : {1, 200}) {
    overwrite(path_ / "data.csv", table_.substr(0, table_.size() - bytes));
    expectRepaired({0, 10, 20});
  }
}

TEST_F(ArchiveRepair, ALineThatCannotBeReadIsDamageAndItsFileComesBack) {
  std::string bad = table_;
  bad[bad.find("c00000010")] = ',';
  overwrite(path_ / "data.csv", bad);
  EXPECT_NE(damage().find("cells, not 7"), std::string::npos) << damage();
  expectRepaired({0, 10, 20});
}

TEST_F(ArchiveRepair, WithoutATableAStepWhoseFilesWereBeingPlacedStaysOut) {
  orphan(30);
  fs::rename(path_ / "c00000030/front/temperature.mip.png",
             path_ / "c00000030/front/temperature.mip.png.tmp");
  fs::remove(path_ / "data.csv");
  expectRepaired({0, 10, 20});
  EXPECT_FALSE(fs::exists(path_ / "c00000030/front/temperature.mip.png.tmp"));
}

TEST_F(ArchiveRepair, AppendingRemovesAStepWhoseFilesWereBeingPlaced) {
  orphan(30);
  overwrite(path_ / "c00000030/front/temperature.x.exr.tmp", "half a file");
  overwrite(path_ / "timings.csv.tmp", "");
  overwrite(path_ / "timings.csv", contents(path_ / "timings.csv") + "30,0");
  { ArchiveWriter writer(path_, ExistingArchive::Append); }
  EXPECT_FALSE(fs::exists(path_ / "c00000030"));
  EXPECT_TRUE(checkArchive(path_).empty());
  EXPECT_EQ(contents(path_ / "data.csv"), table_);
}

TEST_F(ArchiveRepair, AStepNeverSharesAFolderWithLeftovers) {
  orphan(30, "density");
  {
    ArchiveWriter writer(path_, ExistingArchive::Append);
    step(writer, 30);
  }
  for (const ArchiveRow& row : Archive(path_).rows())
    EXPECT_EQ(row.cycle == 30, row.exr.starts_with("c00000030-2/")) << row.exr;
  expectRepaired({0, 10, 20, 30});
}

TEST_F(ArchiveRepair, TimingsNameNoStepThatTheTableLacks) {
  const std::string times = contents(path_ / "timings.csv");
  {
    ArchiveWriter writer(path_, ExistingArchive::Append);
    step(writer, 10);
  }
  EXPECT_EQ(contents(path_ / "timings.csv"), times.substr(0, times.find("20,")));
  fs::remove_all(path_ / "c00000000");
  EXPECT_NE(damage(), "");
  expectRepaired({10});
  EXPECT_EQ(contents(path_ / "timings.csv"), "cycle,time,march\n10,0.5,1.0\n");
  { ArchiveWriter writer(path_, ExistingArchive::Overwrite); }
  EXPECT_FALSE(fs::exists(path_ / "timings.csv"));
}

TEST_F(ArchiveRepair, TimingsAreChecked) {
  const std::string times = contents(path_ / "timings.csv");
  const auto expect = [&](const std::string& text, const std::string& words, bool leftover) {
    overwrite(path_ / "timings.csv", text);
    std::vector<Finding> found = checkArchive(path_);
    ASSERT_EQ(found.size(), 1u) << text;
    EXPECT_EQ(found[0].file, "timings.csv");
    EXPECT_NE(found[0].problem.find(words), std::string::npos) << found[0].problem;
    EXPECT_EQ(found[0].leftover, leftover);
    expectRepaired({0, 10, 20});
    EXPECT_TRUE(checkArchive(path_).empty());
  };
  expect("", "first line is cut off", true);
  expect("cycle,ti", "first line is cut off", true);
  expect(times + "30,", "line 5 is cut off", true);
  expect(times + "30\n", "line 5 is cut off", true);
  expect(times + "30,0.5,1,2\n", "line 5 has 4 cells, not 3", false);
  expect(times + "x,0.5,1\n", "line 5 has the cycle 'x'", false);
  expect(times + "30,soon,1\n", "line 5 has the time 'soon'", false);
  expect("a,b\n1,2\n", "first column is not 'cycle'", false);
  overwrite(path_ / "timings.csv", "cycle,time,march\n10,0.25,1.0\n");
  EXPECT_NE(damage().find("line 2: its time is 0.25, the table says 0.5"), std::string::npos);
}

TEST_F(ArchiveRepair, PreviewsOfPixelsThatAreNotSquareStay) {
  Folder folder;
  ProxyHeader header = someHeader({12, 10});
  header.camera.pixelAspect = 2.0;
  const Raster preview = someRaster(squarePixels(header.size, 2.0));
  ASSERT_NE(preview.size, header.size);
  const ProxyImage image =
      referenceImage(header, std::vector<float>(360, 0.0f), std::vector<float>(120, 1.0f));
  ArchiveWriter(folder / "a.cdb", ExistingArchive::Refuse)
      .writeStep({encodeProxy(image, &preview)});
  EXPECT_TRUE(checkArchive(folder / "a.cdb").empty());
  EXPECT_TRUE(repairArchive(folder / "a.cdb").empty());
  EXPECT_TRUE(Archive(folder / "a.cdb").rows().front().hasPreview());
}

TEST_F(ArchiveRepair, APreviewOfAnotherSizeThanItsProxyIsDamage) {
  const std::string png = Archive(path_).rows()[0].png;
  writeDurably(path_ / png, encodePng(someRaster({8, 6})));
  EXPECT_NE(damage().find(png + ": it has 8 x 6 pixels, the proxy's picture 12 x 10"),
            std::string::npos)
      << damage();
}

}  // namespace
}  // namespace vestige::test
