// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <clocale>

#include "proxy/base/durable_file.h"
#include "proxy/format/exr/png_file.h"
#include "tests/proxy/archive/archive_fixture.h"

namespace vestige::test {
namespace {

TEST(Archive, WhatIsWrittenIsReadAndPassesTheCheck) {
  Folder folder;
  const fs::path path = folder / "deep/er/run.cdb";
  {
    ArchiveWriter writer(path, ExistingArchive::Refuse);
    writeStep(writer, 0, 0.0);
    writeStep(writer, 10, 0.25);
    writeStep(writer, 20, 1e20);
  }
  Archive archive(path);
  EXPECT_EQ(archive.rows().size(), 15u);
  EXPECT_EQ(archive.cycles(), (std::vector<long>{0, 10, 20}));
  EXPECT_EQ(archive.views(), std::vector<std::string>{"front"});
  EXPECT_EQ(archive.fields(), std::vector<std::string>{"temperature"});
  EXPECT_EQ(archive.proxies().size(), 5u);
  EXPECT_EQ(archive.timeOf(20), 1e20);
  expectError(ErrorCode::NotFound, "cycle 30", [&] { archive.timeOf(30); });
  const ArchiveRow* row = archive.find(10, "front", "temperature", kind::kDepth);
  ASSERT_TRUE(row);
  EXPECT_EQ(row->exr, "c00000010/front/temperature.depth.exr");
  EXPECT_EQ(row->png, "c00000010/front/temperature.depth.png");
  EXPECT_EQ(archive.open(*row).header().cycle, 10);
  EXPECT_EQ(archive.open(*row).header().time, 0.25);
  EXPECT_FALSE(archive.find(10, "back", "temperature", kind::kDepth));
  EXPECT_EQ(readPng(path / row->png).rgba, someRaster({12, 10}).rgba);
  int last = 0;
  auto findings = checkArchive(path, [&](int done, int total) {
    EXPECT_EQ(done, ++last);
    EXPECT_EQ(total, 15);
  });
  for (const Finding& f : findings) ADD_FAILURE() << f.file << ": " << f.problem;
  EXPECT_EQ(last, 15);
}

TEST(Archive, FindsRowsWhateverTheirOrderInTheTable) {
  Folder folder;
  std::vector<ArchiveRow> rows;
  for (const char* proxy : {"length", "mip"})
    for (const long cycle : {30L, 10L, 20L})
      rows.push_back({0.5 * double(cycle), cycle, "front", "t", proxy, "x.exr", "x.exr"});
  fs::create_directories(folder / "a.cdb");
  overwrite(folder / "a.cdb/data.csv", tableText(rows));
  const Archive archive(folder / "a.cdb");
  EXPECT_EQ(archive.cycles(), (std::vector<long>{10, 20, 30}));
  EXPECT_EQ(Archive(folder / "a.cdb").cycles(), archive.cycles());
  EXPECT_EQ(archive.timeOf(20), 10.0);
  EXPECT_EQ(archive.find(10, "front", "t", "mip"), &archive.rows()[4]);
  EXPECT_EQ(archive.find(10, "front", "t", "depth"), nullptr);
  EXPECT_EQ(archive.find(11, "front", "t", "mip"), nullptr);
  const Archive copy = archive;
  EXPECT_EQ(copy.find(30, "front", "t", "length"), &copy.rows()[0]);
}

TEST(Archive, AWriterThatWroteNoStepTakesAwayWhatItBegan) {
  Folder folder;
  const fs::path path = folder / "run.cdb";
  {
    ArchiveWriter writer(path, ExistingArchive::Refuse);
    EXPECT_TRUE(Archive(path).rows().empty());  // readers find it meanwhile
  }
  EXPECT_FALSE(fs::exists(path));
  fs::create_directory(path);  // the user's
  { ArchiveWriter writer(path, ExistingArchive::Refuse); }
  EXPECT_TRUE(fs::is_empty(path));
  {
    ArchiveWriter writer(path, ExistingArchive::Refuse);
    overwrite(path / "note.txt", "mine");
  }
  EXPECT_TRUE(fs::exists(path / "note.txt"));
  fs::remove(path / "note.txt");
  {
    ArchiveWriter writer(path, ExistingArchive::Refuse);
    writeStep(writer, 0, 0.0);
  }
  { ArchiveWriter writer(path, ExistingArchive::Append); }
  EXPECT_EQ(Archive(path).rows().size(), 5u);
}

TEST(Archive, EqualRunsGiveEqualBytes) {
  Folder folder;
  for (const char* name : {"a.cdb", "b.cdb"}) {
    ArchiveWriter writer(folder / name, ExistingArchive::Refuse);
    writeStep(writer, 0, 0.0);
  }
  for (const ArchiveRow& row : Archive(folder / "a.cdb").rows())
    for (const std::string& file : {row.exr, row.png})
      EXPECT_EQ(contents(folder / "a.cdb" / file), contents(folder / "b.cdb" / file)) << file;
  EXPECT_EQ(contents(folder / "a.cdb/data.csv"), contents(folder / "b.cdb/data.csv"));
}

TEST(Archive, FieldNamesThatLookAlikeAsFileNamesStayApart) {
  Folder folder;
  ArchiveWriter writer(folder / "a.cdb", ExistingArchive::Refuse);
  long cycle = 0;
  std::vector<std::string> names = {"a b",
                                    "a_b",
                                    "a/b",
                                    "A_B",
                                    "../x",
                                    "..",
                                    "|v|",
                                    "é",
                                    std::string(200, 'x'),
                                    std::string(200, 'x') + "y"};
  std::vector<ProxyImage> images;
  for (const std::string& name : names) {
    ProxyHeader h = someHeader({12, 10});
    h.field = name;
    h.cycle = cycle;
    images.push_back(mipImage(h, Planes(h).mip));
  }
  const Raster preview = someRaster({12, 10});
  std::vector<EncodedProxy> proxies;
  for (const ProxyImage& image : images) proxies.push_back(encodeProxy(image, &preview));
  writer.writeStep(proxies);
  Archive archive(folder / "a.cdb");
  EXPECT_EQ(archive.fields(), names);
  for (const std::string& name : names)
    EXPECT_EQ(archive.open(*archive.find(0, "front", name, kind::kMip)).header().field, name);
  EXPECT_TRUE(checkArchive(folder / "a.cdb").empty());
}

TEST(Archive, NamesThatATableCannotHoldAreRefusedBeforeAnythingIsWritten) {
  Folder folder;
  ArchiveWriter writer(folder / "a.cdb", ExistingArchive::Refuse);
  for (std::string name : {"a,b", "a\"b", "a\nb", "", " a", "a ", "12", "-1e5", "nan", "+3.5"})
    expectError(ErrorCode::InvalidArgument, "field name '" + name + "'",
                [&] { writeStep(writer, 0, 0.0, name); });
  expectError(ErrorCode::InvalidArgument, "cycle -1", [&] { writeStep(writer, -1, 0.0); });
  expectError(ErrorCode::InvalidArgument, "time inf", [&] { writeStep(writer, 0, HUGE_VAL); });
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "a.cdb"), {}), 1);
  writeStep(writer, 5, 0.0);
  expectError(ErrorCode::InvalidArgument, "cycle 5 does not come after cycle 5",
              [&] { writeStep(writer, 5, 0.0); });
  ProxyImage image = someImages(someHeader())[3], later = image;
  later.header.cycle = 11;
  image.header.cycle = 10;
  const Raster preview = someRaster({12, 10});
  expectError(ErrorCode::InvalidArgument, "cycles 10 and 11", [&] {
    writer.writeStep({encodeProxy(image, &preview), encodeProxy(later, &preview)});
  });
  expectError(ErrorCode::InvalidArgument, "twice", [&] {
    writer.writeStep({encodeProxy(image, &preview), encodeProxy(image, &preview)});
  });
  EXPECT_EQ(Archive(folder / "a.cdb").rows().size(), 5u);
  EXPECT_TRUE(checkArchive(folder / "a.cdb").empty());
}

TEST(Archive, WithoutPreviewsTheTableNamesTheProxiesTwice) {
  Folder folder;
  const fs::path path = folder / "a.cdb";
  const std::vector<ProxyImage> images = someImages(someHeader({12, 10}));
  const Raster preview = someRaster({12, 10});
  {
    ArchiveWriter writer(path, ExistingArchive::Refuse);
    writer.writeStep({encodeProxy(images[0]), encodeProxy(images[3], &preview)});
  }
  const std::vector<ArchiveRow> rows = Archive(path).rows();
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_FALSE(rows[0].hasPreview());
  EXPECT_TRUE(rows[1].hasPreview());
  EXPECT_EQ(contents(path / "data.csv").find(",\n"), std::string::npos) << "no empty cells";
  EXPECT_TRUE(checkArchive(path).empty());
  fs::remove(path / "data.csv");
  EXPECT_TRUE(repairArchive(path).empty());
  EXPECT_EQ(Archive(path).rows(), rows);
  { ArchiveWriter writer(path, ExistingArchive::Overwrite); }
  EXPECT_FALSE(fs::exists(path / "c00000010"));
}

TEST(Archive, RefuseAppendAndOverwriteDoWhatTheySay) {
  Folder folder;
  const fs::path path = folder / "a.cdb";
  {
    ArchiveWriter writer(path, ExistingArchive::Refuse);
    for (long cycle : {0, 10, 20, 30}) writeStep(writer, cycle, 0.1 * double(cycle));
  }
  expectError(ErrorCode::Exists, "exists already",
              [&] { ArchiveWriter(path, ExistingArchive::Refuse); });
  const std::string before = contents(path / "c00000010/front/temperature.mip.exr");
  {
    ArchiveWriter writer(path, ExistingArchive::Append);
    writeStep(writer, 15, 1.5);
    EXPECT_EQ(Archive(path).cycles(), (std::vector<long>{0, 10, 15}));
    writeStep(writer, 20, 2.5);
    EXPECT_EQ(Archive(path).cycles(), (std::vector<long>{0, 10, 15, 20}));
  }
  EXPECT_EQ(Archive(path).timeOf(20), 2.5);
  EXPECT_EQ(contents(path / "c00000010/front/temperature.mip.exr"), before);
  EXPECT_TRUE(checkArchive(path).empty());
  EXPECT_FALSE(fs::exists(path / "c00000030"));
  {
    ArchiveWriter writer(path, ExistingArchive::Append);
    writeStep(writer, 20, 2.75);  // the same cycle: other files until the table is replaced
  }
  EXPECT_EQ(Archive(path).timeOf(20), 2.75);
  EXPECT_TRUE(checkArchive(path).empty());
  overwrite(path / "mine.txt", "not yours");
  overwrite(path / "c00000000/mine.txt", "not yours");
  { ArchiveWriter writer(path, ExistingArchive::Overwrite); }
  EXPECT_TRUE(Archive(path).rows().empty());
  EXPECT_TRUE(fs::exists(path / "mine.txt"));
  EXPECT_TRUE(fs::exists(path / "c00000000/mine.txt"));
  EXPECT_FALSE(fs::exists(path / "c00000010"));
}

TEST(Archive, AFolderThatIsNoArchiveIsNeverTouched) {
  Folder folder;
  overwrite(folder / "thesis.tex", "years of work");
  for (auto policy : {ExistingArchive::Refuse, ExistingArchive::Append, ExistingArchive::Overwrite})
    expectError(ErrorCode::Exists, "neither empty nor an archive",
                [&] { ArchiveWriter(folder.path(), policy); });
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
  expectError(ErrorCode::Io, "thesis.tex",
              [&] { ArchiveWriter(folder / "thesis.tex", ExistingArchive::Refuse); });
  expectError(ErrorCode::NotFound, "no archive", [&] { Archive archive(folder.path()); });
}

TEST(Archive, OverwriteFollowsNoPathOutOfTheArchive) {
  Folder folder;
  const fs::path path = folder / "a.cdb", outside = folder / "outside";
  fs::create_directories(path);
  fs::create_directories(outside);
  overwrite(outside / "x.exr", "mine");
  overwrite(outside / "x.png", "mine");
  fs::create_directory_symlink(outside, path / "c00000000");
  overwrite(path / "data.csv",
            tableHeaderLine() + "0.0,0,front,t,mip,c00000000/x.exr,c00000000/x.png\n");
  { ArchiveWriter writer(path, ExistingArchive::Overwrite); }
  EXPECT_TRUE(fs::exists(outside / "x.exr"));
  EXPECT_TRUE(fs::exists(outside / "x.png"));
  overwrite(path / "data.csv",
            tableHeaderLine() + "0.0,0,front,t,mip,../outside/x.exr,c00000000/x.png\n");
  expectError(ErrorCode::Format, "../outside/x.exr",
              [&] { ArchiveWriter(path, ExistingArchive::Overwrite); });
}

TEST(Archive, TwoWritersDoNotMix) {
  Folder folder;
  auto first = std::make_unique<ArchiveWriter>(folder / "a.cdb", ExistingArchive::Refuse);
  for (auto policy : {ExistingArchive::Append, ExistingArchive::Overwrite})
    expectError(ErrorCode::Exists, "another run", [&] { ArchiveWriter(folder / "a.cdb", policy); });
  first.reset();
  ArchiveWriter second(folder / "a.cdb", ExistingArchive::Append);
}

TEST(Archive, TheTableIsTheSameInEveryLocale) {
  Folder folder;
  const std::string before = std::setlocale(LC_ALL, nullptr);
  bool comma = std::setlocale(LC_ALL, "de_DE.UTF-8") || std::setlocale(LC_ALL, "fr_FR.UTF-8") ||
               std::setlocale(LC_ALL, "de_DE");
  {
    ArchiveWriter writer(folder / "a.cdb", ExistingArchive::Refuse);
    writeStep(writer, 1, 1.5);
  }
  EXPECT_EQ(Archive(folder / "a.cdb").timeOf(1), 1.5);
  EXPECT_TRUE(checkArchive(folder / "a.cdb").empty());
  std::setlocale(LC_ALL, before.c_str());
  RecordProperty("comma_locale", comma);
}

TEST(Archive, ARemovedFolderIsReportedAndStartedAnew) {
  Folder folder;
  const fs::path path = folder / "a.cdb";
  ArchiveWriter writer(path, ExistingArchive::Refuse);
  writeStep(writer, 0, 0.0);
  fs::remove_all(path);
  expectError(ErrorCode::Io, path.string(), [&] { writeStep(writer, 10, 1.0); });
  writeStep(writer, 20, 2.0);
  EXPECT_EQ(Archive(path).cycles(), std::vector<long>{20});
  EXPECT_TRUE(checkArchive(path).empty());
  writeStep(writer, 30, 3.0);
  fs::remove(path / "data.csv");
  expectError(ErrorCode::Io, path.string(), [&] { writeStep(writer, 40, 4.0); });
  writeStep(writer, 50, 5.0);
  EXPECT_EQ(Archive(path).cycles(), (std::vector<long>{20, 30, 50}));
  EXPECT_TRUE(checkArchive(path).empty());
}

}  // namespace
}  // namespace vestige::test
