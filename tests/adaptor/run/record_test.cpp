// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/run/record.h"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "adaptor/config/config.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

class RecordTest : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::remove_all(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::vector<nlohmann::json> calls() const {
    std::istringstream lines(readTextFile((folder_ / "calls.jsonl").string()));
    std::vector<nlohmann::json> result;
    for (std::string line; std::getline(lines, line);) {
      result.push_back(nlohmann::json::parse(line));
    }
    return result;
  }

  std::filesystem::path folder_ = std::filesystem::path(testing::TempDir()) /
                                  (std::string("vestige_record_") +
                                   testing::UnitTest::GetInstance()->current_test_info()->name());
};

/// A block of 3 x 2 x 2 points with a point field of two components, held separately, and a masked
/// cell field.
struct Sample {
  std::vector<float> u{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  std::vector<float> v{100, 101, 102, 103, 104, 105, 106, 107, 108, 109, 110, 111};
  std::vector<std::uint16_t> cells{7, 8};
  std::vector<std::uint8_t> mask{0, 32};
  BlockSet blocks;

  explicit Sample(bool rectilinear) {
    GridDescription grid;
    grid.points = {3, 2, 2};
    grid.first = {4, 0, 0};
    grid.origin = {0.1, 0.2, 0.3};
    grid.spacing = {0.1, 1.0, 1.0 / 3.0};
    if (rectilinear) grid.axes[2] = {5.0, 9.0};
    blocks.describe(2, grid);
    blocks.describe(3, GridDescription{});
    FieldView field;
    field.name = "velocity <&>";
    field.strides = {4, 12, 24};
    field.components = {reinterpret_cast<const std::byte*>(u.data()),
                        reinterpret_cast<const std::byte*>(v.data())};
    blocks.share(2, field);
    FieldView cell;
    cell.name = "id";
    cell.type = SampleType::UInt16;
    cell.location = Location::Cell;
    cell.strides = {2, 4, 4};
    cell.components = {reinterpret_cast<const std::byte*>(cells.data())};
    blocks.share(2, cell);
    blocks.shareMask(2, Location::Cell,
                     MaskView{reinterpret_cast<const std::byte*>(mask.data()), 32, {1, 2, 2}});
  }
};

TEST_F(RecordTest, CallsRoundTripExactly) {
  const Sample sample(false);
  {
    Recorder recorder(folder_, "[image]\nwidth = 8\n", "x.cdb");
    recorder.execute(10, 1.0 / 3.0, sample.blocks, {{"id", "1"}});
  }
  EXPECT_EQ(readTextFile((folder_ / "config.toml").string()), "[image]\nwidth = 8\n");
  const auto lines = calls();
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0]["call"], "open");
  EXPECT_EQ(lines[0]["output"], "x.cdb");
  EXPECT_EQ(lines[2]["call"], "close");
  const auto& call = lines[1];
  EXPECT_EQ(call["cycle"], 10);
  EXPECT_EQ(call["time"].get<double>(), 1.0 / 3.0);
  EXPECT_EQ(call["units"]["id"], "1");
  EXPECT_FALSE(call.contains("domain"));
  const auto& block = call["blocks"][0];
  EXPECT_EQ(block["index"], 2);
  EXPECT_EQ(block["file"], "step000000_block0002.vti");
  EXPECT_EQ(block["spacing"][2].get<double>(), 1.0 / 3.0);
  EXPECT_EQ(block["fields"][0]["name"], "velocity <&>");
  EXPECT_EQ(block["fields"][0]["components"], 2);
  EXPECT_EQ(block["fields"][1]["type"], "UInt16");
  EXPECT_EQ(block["masks"], nlohmann::json({"cell"}));
  EXPECT_EQ(call["blocks"][1]["file"], "");
}

TEST_F(RecordTest, FilesHoldTheFieldsInTheirOwnTypes) {
  const Sample sample(true);
  {
    Recorder recorder(folder_, "", "x.cdb");
    recorder.execute(0, 0.0, sample.blocks, {});
  }
  const auto text = readTextFile((folder_ / "step000000_block0002.vtr").string());
  EXPECT_NE(text.find("WholeExtent=\"4 6 0 1 0 1\""), std::string::npos);
  EXPECT_NE(text.find("Name=\"velocity &lt;&amp;&gt;\" NumberOfComponents=\"2\""),
            std::string::npos);
  const auto start = text.find("encoding=\"raw\">\n_") + std::strlen("encoding=\"raw\">\n_");
  std::uint64_t bytes = 0;
  std::memcpy(&bytes, text.data() + start, sizeof bytes);
  ASSERT_EQ(bytes, 12u * 2u * 4u);
  std::vector<float> values(24);
  std::memcpy(values.data(), text.data() + start + 8, bytes);
  EXPECT_EQ(values[0], 0.0f);
  EXPECT_EQ(values[1], 100.0f);
  EXPECT_EQ(values[23], 111.0f);
  // Then the cell field, and its mask as 0 and 1.
  const auto cells = start + 8 + bytes;
  std::uint16_t id = 0;
  std::memcpy(&id, text.data() + cells + 8 + 2, sizeof id);
  EXPECT_EQ(id, 8);
  EXPECT_EQ(text[cells + 8 + 4 + 8 + 0], 0);
  EXPECT_EQ(text[cells + 8 + 4 + 8 + 1], 1);
}

TEST_F(RecordTest, AnEarlierRecordingStaysAndTheNextOneGoesBesideIt) {
  { Recorder recorder(folder_, "", "x.cdb"); }
  Recorder second(folder_, "", "y.cdb"), third(folder_, "", "z.cdb");
  EXPECT_EQ(second.directory(), folder_.string() + ".1");
  EXPECT_EQ(third.directory(), folder_.string() + ".2");
  EXPECT_EQ(calls().size(), 2u);
  for (const auto* recorder : {&second, &third}) std::filesystem::remove_all(recorder->directory());
}

TEST_F(RecordTest, FolderThatCannotBeMadeIsAnError) {
  try {
    Recorder recorder("/proc/vestige", "", "x.cdb");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::Io);
  }
}

}  // namespace
}  // namespace vestige
