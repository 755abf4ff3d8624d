// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/layout/learned_layout.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "proxy/base/durable_file.h"
#include "proxy/format/exr/exr_file.h"
#include "proxy/format/layout/proxy_check.h"
#include "tests/proxy/archive/archive_fixture.h"

namespace vestige::test {
namespace {

ProxyHeader header() {
  ProxyHeader header = someHeader({12, 10});
  header.shading = "headlight";
  header.looks = {*header.base, *header.base};
  header.looks[1].setOpacity({{0.1, 0.0}, {0.4, 0.25}});
  header.learned = LearnedOrigin{"length", {12, 10}, 0.0123};
  return header;
}

LearnedTable someTable(int clusters) {
  const int channels = header().partition->channels();
  LearnedTable table{channels, clusters, {}, {}, {}};
  table.centroid.resize(std::size_t(clusters * channels));
  table.jacobian.resize(std::size_t(3 * clusters * channels));
  table.color.resize(std::size_t(3 * clusters));
  std::iota(table.centroid.begin(), table.centroid.end(), 0.125f);
  std::iota(table.jacobian.begin(), table.jacobian.end(), -100.3f);
  std::iota(table.color.begin(), table.color.end(), 0.7f);
  return table;
}

ProxyImage stored(const ProxyImage& image, const Folder& folder) {
  writeDurably(folder / "image.exr", encodeExr(image));
  return ExrFile(folder / "image.exr").image();
}

TEST(LearnedLayout, ATableSurvivesStorageBitForBit) {
  const Folder folder;
  for (const int clusters : {1, 24, kMostClusters}) {
    const LearnedTable table = someTable(clusters);
    const ProxyImage image = stored(learnedImage(header(), table), folder);
    EXPECT_EQ(problemsOf(image), std::vector<std::string>{});
    EXPECT_EQ(image.header.kind, kind::kLearned);
    EXPECT_EQ(image.header.shading, "headlight");
    ASSERT_EQ(image.header.looks.size(), 2u);
    EXPECT_EQ(image.header.looks[1].opacityPoints(), header().looks[1].opacityPoints());
    EXPECT_EQ(image.header.learned, header().learned);
    const LearnedTable back = learnedTable(image);
    EXPECT_EQ(back.channels, table.channels);
    EXPECT_EQ(back.clusters, clusters);
    EXPECT_EQ(back.centroid, table.centroid);
    EXPECT_EQ(back.jacobian, table.jacobian);
    EXPECT_EQ(back.color, table.color);
  }
}

TEST(LearnedLayout, TrainingPicturesAreStoredAsReferencePictures) {
  const Folder folder;
  const ProxyHeader head = header();
  const Planes planes(head), others(head, 2.0);
  const LightPlanes pictures[] = {{planes.rgb, planes.transmittance},
                                  {others.rgb, others.transmittance}};
  const ProxyImage image = stored(trainingImage(head, pictures), folder);
  EXPECT_EQ(problemsOf(image), std::vector<std::string>{});
  EXPECT_EQ(image.header.kind, kind::kTraining);
  const ProxyImage reference = referenceImage(head, others.rgb, others.transmittance);
  for (const char* channel : {"R", "G", "B", "A"}) {
    EXPECT_EQ(image.channel("picture01", channel).values,
              reference.channel("reference", channel).values);
  }
  ProxyHeader one = head;
  one.looks.pop_back();
  expectError(ErrorCode::InvalidArgument, "2 training pictures of 1 looks",
              [&] { trainingImage(one, pictures); });
  expectError(ErrorCode::InvalidArgument, "0 training pictures", [&] { trainingImage(head, {}); });
}

TEST(LearnedLayout, RefusesTablesThatMakeNoSense) {
  const auto refuses = [](const char* words, const auto& damage) {
    ProxyHeader head = header();
    LearnedTable table = someTable(3);
    damage(head, table);
    expectError(ErrorCode::InvalidArgument, words, [&] { learnedImage(head, table); });
  };
  refuses("no interval bounds", [](auto& head, auto&) { head.partition.reset(); });
  refuses("how it was made", [](auto& head, auto&) { head.learned.reset(); });
  refuses("which looks", [](auto& head, auto&) { head.looks.clear(); });
  refuses("0 clusters", [](auto&, auto& table) { table = {table.channels, 0, {}, {}, {}}; });
  refuses("257 clusters", [](auto&, auto& table) { table = someTable(257); });
  refuses("3 clusters of 6 channels; field 'temperature' needs 1 to 256 of 7",
          [](auto& head, auto&) { head.partition = IntervalPartition::uniform(0.0, 1.0, 4); });
  refuses("3 clusters", [](auto&, auto& table) { table.jacobian.pop_back(); });
  refuses("nan", [](auto&, auto& table) { table.color[4] = NAN; });
  refuses("1000001", [](auto&, auto& table) { table.jacobian[7] = 1000001.0f; });
}

TEST(LearnedLayout, CheckFindsDamageInFilesOfOtherWriters) {
  const auto finds = [](const char* words, const auto& damage) {
    ProxyImage image = learnedImage(header(), someTable(3));
    damage(image);
    const auto problems = problemsOf(image);
    ASSERT_FALSE(problems.empty()) << words;
    EXPECT_NE((problems.front() + problems.back()).find(words), std::string::npos)
        << problems.front() << " | " << problems.back();
    EXPECT_FALSE(problemsOf(image).empty());
  };
  finds("how it was made", [](auto& image) { image.header.learned.reset(); });
  finds("which looks", [](auto& image) { image.header.looks.clear(); });
  finds("interval bounds", [](auto& image) { image.header.partition.reset(); });
  finds("is 27 x 3; 7 channels need 31 x at most 256",
        [](auto& image) { image.header.partition = IntervalPartition::uniform(0.0, 1.0, 4); });
  finds("has no values", [](auto& image) { image.parts[0].channels[0].values.pop_back(); });
  finds("no values", [](auto& image) { image.parts.clear(); });
  finds("finite", [](auto& image) { image.parts[0].channels[0].values[5] = NAN; });
  finds("1e6", [](auto& image) { image.parts[0].channels[0].values[5] = 1e7f; });
}

TEST(LearnedLayout, CheckFindsTrainingPicturesWithoutTheirLooks) {
  const ProxyHeader head = header();
  const Planes planes(head);
  const LightPlanes pictures[] = {{planes.rgb, planes.transmittance},
                                  {planes.rgb, planes.transmittance}};
  ProxyImage image = trainingImage(head, pictures);
  image.header.looks.pop_back();
  EXPECT_EQ(problemsOf(image).front(), "it has 2 parts, a training proxy has 1");
  image.header.looks.clear();
  EXPECT_NE(problemsOf(image).front().find("which looks"), std::string::npos);
}

TEST(LearnedLayout, RefusesFilesOfMoreLooksThanAnyWriterStores) {
  const Folder folder;
  ProxyImage image = learnedImage(header(), someTable(3));
  image.header.looks.resize(5, image.header.looks[0]);
  writeDurably(folder / "many.exr", encodeExr(image));
  expectError(ErrorCode::Format, "no list of at most 4", [&] { ExrFile(folder / "many.exr"); });
}

TEST(LearnedLayout, RefusesOriginsThatMakeNoSense) {
  const auto refuses = [](const char* words, const char* text) {
    expectError(ErrorCode::Format, words,
                [&] { learnedOriginFromJson(nlohmann::json::parse(text)); });
  };
  refuses("size", R"({"from": "length", "error": 0, "size": [1]})");
  refuses("0 pixels", R"({"from": "length", "error": 0, "size": [0, 5]})");
  refuses("1e+99 pixels", R"({"from": "length", "error": 0, "size": [5, 1e99]})");
  refuses("'mip'", R"({"from": "mip", "error": 0, "size": [5, 5]})");
  refuses("-1", R"({"from": "length", "error": -1, "size": [5, 5]})");
  refuses("error", R"({"from": "length", "size": [5, 5]})");
  refuses("makes no sense", R"({"from": 3, "error": 0, "size": [5, 5]})");
  refuses("makes no sense", R"([])");
}

TEST(AddToStep, AddsARowWithinItsStepAndReplacesItsFile) {
  const Folder folder;
  const fs::path path = folder / "a.cdb";
  {
    ArchiveWriter writer(path, ExistingArchive::Refuse);
    for (const long cycle : {10, 20}) writeStep(writer, cycle, 0.1 * double(cycle));
  }
  const auto table = [&](long cycle, int clusters) {
    ProxyHeader head = header();
    head.cycle = cycle;
    head.time = 0.1 * double(cycle);
    return encodeProxy(learnedImage(head, someTable(clusters)));
  };
  for (const long cycle : {20, 10}) {  // the end of the table, and in between
    for (const int clusters : {4, 2}) {
      ArchiveWriter writer(path, ExistingArchive::Append);
      writer.addToStep(table(cycle, clusters));
      EXPECT_TRUE(checkArchive(path).empty());
      const Archive archive(path);
      EXPECT_EQ(archive.rows().size(), cycle == 20 ? 11u : 12u);
      EXPECT_EQ(archive.cycles(), (std::vector<long>{10, 20}));
      const ArchiveRow* row = archive.find(cycle, "front", "temperature", kind::kLearned);
      ASSERT_NE(row, nullptr);
      EXPECT_EQ(learnedTable(archive.open(*row).image()).clusters, clusters);
    }
  }
  const Archive archive(path);
  EXPECT_TRUE(std::is_sorted(archive.rows().begin(), archive.rows().end(),
                             [](const auto& a, const auto& b) { return a.cycle < b.cycle; }));
  // Without the table the files tell the same.
  const auto filesOf = [](const Archive& of) {
    std::vector<std::string> files;
    for (const ArchiveRow& row : of.rows()) files.push_back(row.exr);
    std::sort(files.begin(), files.end());
    return files;
  };
  const auto before = filesOf(archive);
  fs::remove(path / "data.csv");
  EXPECT_TRUE(repairArchive(path).empty());
  EXPECT_EQ(filesOf(Archive(path)), before);
}

TEST(AddToStep, ARunThatGoesOnSupersedesWhatWasAddedToItsSteps) {
  const Folder folder;
  const fs::path path = folder / "a.cdb";
  ArchiveWriter(path, ExistingArchive::Refuse);
  {
    ArchiveWriter writer(path, ExistingArchive::Append);
    for (const long cycle : {10, 20}) writeStep(writer, cycle, double(cycle));
  }
  {
    ArchiveWriter writer(path, ExistingArchive::Append);
    ProxyHeader head = header();
    for (const long cycle : {10, 20}) {
      head.cycle = cycle;
      head.time = double(cycle);
      writer.addToStep(encodeProxy(learnedImage(head, someTable(2))));
    }
    writeStep(writer, 20, 20.0);
  }
  EXPECT_TRUE(checkArchive(path).empty());
  const Archive archive(path);
  EXPECT_EQ(archive.rows().size(), 11u);
  EXPECT_NE(archive.find(10, "front", "temperature", kind::kLearned), nullptr);
  EXPECT_EQ(archive.find(20, "front", "temperature", kind::kLearned), nullptr);
}

TEST(AddToStep, RefusesStepsThatAreNotThereAndFoldersThatAreLinks) {
  const Folder folder;
  const fs::path path = folder / "a.cdb";
  ArchiveWriter writer(path, ExistingArchive::Refuse);
  writeStep(writer, 10, 0.1);
  const std::string before = contents(path / "data.csv");
  ProxyHeader head = header();
  const auto add = [&] { writer.addToStep(encodeProxy(learnedImage(head, someTable(2)))); };
  head.cycle = 11;
  expectError(ErrorCode::NotFound, "no cycle 11", add);
  head.cycle = 10;
  head.time = 0.5;
  expectError(ErrorCode::InvalidArgument, "0.1, not 0.5", add);
  head.time = 0.1;
  const Raster preview = someRaster();
  expectError(ErrorCode::InvalidArgument, "preview",
              [&] { writer.addToStep(encodeProxy(learnedImage(head, someTable(2)), &preview)); });
  fs::rename(path / "c00000010" / "front", folder / "elsewhere");
  fs::create_directory_symlink(folder / "elsewhere", path / "c00000010" / "front");
  expectError(ErrorCode::Format, "link or leaves", add);
  EXPECT_EQ(contents(path / "data.csv"), before);
  EXPECT_FALSE(fs::exists(folder / "elsewhere" / "temperature.learned.exr"));
}

}  // namespace
}  // namespace vestige::test
