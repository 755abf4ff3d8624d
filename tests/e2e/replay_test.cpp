// SPDX-License-Identifier: BSD-3-Clause
#include <cstdlib>

#include "proxy/archive/archive.h"
#include "tests/e2e/program.h"
#include "tests/e2e/scratch.h"

namespace vestige::test {
namespace {

namespace fs = std::filesystem;

class Replay : public Scratch {
 protected:
  Outcome replay(const std::vector<std::string>& arguments) {
    return run("vestige-replay", arguments, folder_);
  }
  /// A raw volume that grows with `step`.
  fs::path writeVolume(const std::string& name, int step) {
    std::string bytes;
    for (int z = 0; z < 8; ++z)
      for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) bytes += char(8 * x + y + z + step);
    return write(name, bytes);
  }
  const std::vector<std::string> raw_ = {"--shape", "8,8,8", "--type", "uint8"};
};

std::vector<std::string> operator+(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST_F(Replay, RecordedRunGivesTheSameProxiesByteForByte) {
  write("small.toml", std::string(kSmallConfig) +
                          "[[field]]\nsource = \"velocity\"\nmagnitude = true\n"
                          "[[field]]\nsource = \"vorticity\"\n[trigger]\nevery_cycles = 10\n"
                          "[customization.corners]\nopacity = 0.5\n");
  for (const char* precision : {"float", "double"}) {
    const std::string record = std::string("record-") + precision;
    const std::string live = std::string("live-") + precision + ".cdb";
    const std::string again = std::string("again-") + precision + ".cdb";
    const auto simulated = run("vestige-mini-sim",
                               {"--size", "20,16,24", "--steps", "25", "--every", "5", "--config",
                                "small.toml", "--output", live, "--precision", precision},
                               folder_, {{"VESTIGE_RECORD", record}});
    ASSERT_EQ(simulated.exitCode, 0) << simulated.err;
    const auto replayed = replay({record, "--output", again});
    ASSERT_EQ(replayed.exitCode, 0) << replayed.err;
    auto one = filesIn(folder_ / live), two = filesIn(folder_ / again);
    one.erase("timings.csv");
    two.erase("timings.csv");
    EXPECT_GT(one.size(), 9u);
    const Archive archive(folder_ / again);
    const ArchiveRow* row = archive.find(archive.cycles().front(), "front", "vorticity", "mip");
    ASSERT_NE(row, nullptr);
    EXPECT_FALSE(archive.open(*row).header().customization) << "MIP, without a gamma";
    row = archive.find(archive.cycles().front(), "front", "vorticity", "reference");
    ASSERT_NE(row, nullptr);
    EXPECT_TRUE(archive.open(*row).header().customization);
    ASSERT_EQ(one.size(), two.size());
    for (const auto& [name, bytes] : one) EXPECT_TRUE(bytes == two[name]) << name << " differs";
  }
}

TEST_F(Replay, StoresOneStepForEachFileInNaturalOrder) {
  write("small.toml", "[image]\nwidth = 32\nheight = 32\n");
  fs::create_directory(folder_ / "series");
  for (int step : {1, 2, 10}) writeVolume("series/s" + std::to_string(step) + ".raw", step);
  const auto outcome =
      replay(std::vector<std::string>{"series", "--config", "small.toml", "--output", "a.cdb",
                                      "--time-step", "0.5", "--spacing", "1,1,2"} +
             raw_);
  ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "3 of 3 steps stored\n");
  const Archive archive(folder_ / "a.cdb");
  EXPECT_EQ(archive.cycles(), (std::vector<long>{0, 1, 2}));
  EXPECT_EQ(archive.timeOf(2), 1.0);
  EXPECT_EQ(archive.fields(), std::vector<std::string>{"scalars"});
  EXPECT_TRUE(checkArchive(folder_ / "a.cdb").empty());
}

TEST_F(Replay, SkipsADamagedStepSaysSoAndGoesOn) {
  write("small.toml", "[image]\nwidth = 32\nheight = 32\n");
  fs::create_directory(folder_ / "series");
  for (int step : {1, 3}) writeVolume("series/s" + std::to_string(step) + ".raw", step);
  write("series/s2.raw", "short");
  const auto outcome = replay(
      std::vector<std::string>{"series", "--config", "small.toml", "--output", "a.cdb"} + raw_);
  EXPECT_EQ(outcome.exitCode, 1);
  EXPECT_NE(outcome.err.find("s2.raw"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.out, "2 of 3 steps stored\n");
  EXPECT_TRUE(checkArchive(folder_ / "a.cdb").empty());
}

TEST_F(Replay, SaysOnceWhatIsWrongInEveryStepAndLeavesNoArchive) {
  write("wrong.toml", "[image]\nwidth = 32\nheight = 32\n[[field]]\nsource = \"scalar\"\n");
  fs::create_directory(folder_ / "series");
  for (int step : {1, 2, 3}) writeVolume("series/s" + std::to_string(step) + ".raw", step);
  const auto outcome = replay(
      std::vector<std::string>{"series", "--config", "wrong.toml", "--output", "a.cdb"} + raw_);
  EXPECT_EQ(outcome.exitCode, 1);
  EXPECT_EQ(outcome.err.find("'scalar'"), outcome.err.rfind("'scalar'")) << outcome.err;
  for (const char* words : {"did you mean 'scalars'?", "VESTIGE_ERROR_NO_FIELD", "2 more steps"})
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
  EXPECT_FALSE(fs::exists(folder_ / "a.cdb"));
}

TEST_F(Replay, SaysOfADryRunWhatItWouldStore) {
  write("dry.toml", "dry_run = true\n[image]\nwidth = 32\nheight = 32\n");
  writeVolume("a.raw", 0);
  const auto outcome =
      replay(std::vector<std::string>{"a.raw", "--config", "dry.toml", "--output", "a.cdb"} + raw_);
  EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "1 of 1 steps would be stored (dry run)\n");
  EXPECT_NE(outcome.err.find("bytes in 10 files"), std::string::npos) << outcome.err;
  EXPECT_FALSE(fs::exists(folder_ / "a.cdb"));
}

TEST_F(Replay, ResamplesUnstructuredGridsAndSaysSo) {
  write("small.toml", "[image]\nwidth = 32\nheight = 32\n");
  write("tetrahedron.vtk",
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n"
        "0 0 0  1 0 0  0 1 0  0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nPOINT_DATA 4\n"
        "SCALARS rho float 1\nLOOKUP_TABLE default\n0 1 2 3\n");
  const auto outcome = replay({"tetrahedron.vtk", "--config", "small.toml", "--output", "a.cdb",
                               "--resample", "16", "--array", "rho"});
  ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("resampled, 16 points"), std::string::npos) << outcome.err;
  EXPECT_EQ(Archive(folder_ / "a.cdb").fields(), std::vector<std::string>{"rho"});
}

TEST_F(Replay, SaysWhatIsWrongWithItsInput) {
  EXPECT_EQ(replay({}).exitCode, 2);
  EXPECT_EQ(replay({"a.raw", "--type", "int8"}).exitCode, 2);
  const auto missing = replay({"none.vti"});
  EXPECT_EQ(missing.exitCode, 1);
  EXPECT_NE(missing.err.find("'none.vti' does not exist"), std::string::npos) << missing.err;
  EXPECT_FALSE(fs::exists(folder_ / "vestige.cdb")) << "no archive without input";
  writeVolume("a.raw", 0);
  const auto array = replay(std::vector<std::string>{"a.raw", "--array", "rho"} + raw_);
  EXPECT_EQ(array.exitCode, 1);
  EXPECT_NE(array.err.find("no array 'rho'; there are: scalars"), std::string::npos) << array.err;
  fs::create_directory(folder_ / "record");
  write("record/config.toml", "");
  write("record/calls.jsonl", "{\"call\": \"open\", \"output\": \"b.cdb\"}\n{nonsense}\n");
  const auto broken = replay({"record"});
  EXPECT_EQ(broken.exitCode, 1);
  EXPECT_NE(broken.err.find("calls.jsonl' line 2"), std::string::npos) << broken.err;
  // Nor does one whose reading would take as much of the stack as somebody likes.
  write("record/calls.jsonl",
        "{\"call\": " + std::string(100000, '[') + std::string(100000, ']') + "}\n");
  const auto deep = replay({"record"});
  EXPECT_EQ(deep.exitCode, 1);
  EXPECT_NE(deep.err.find("line 1: JSON is nested deeper than 64 levels"), std::string::npos)
      << deep.err.substr(0, 200);
}

TEST_F(Replay, CtHeadIsStoredAndRendered) {
  // As scripts/fetch-ct-head leaves it; scripts/test fetches it beforehand.
  const char* cache = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  const fs::path folder = cache ? fs::path(cache) : fs::path(home ? home : "") / ".cache";
  const fs::path head = folder / "vestige" / "ct" / "head.mhd";
  if (!fs::exists(head)) GTEST_SKIP() << "run scripts/fetch-ct-head first";
  write("ct.toml",
        "[image]\nwidth = 128\nheight = 128\n"
        "[[field]]\nsource = \"scalars\"\nname = \"density\"\nrange = [-1024.0, 2986.0]\n"
        "opacity = [[-200.0, 0.0], [0.0, 0.05], [300.0, 0.2], [1500.0, 0.8]]\n");
  const auto outcome = replay({head.string(), "--config", "ct.toml", "--output", "ct.cdb"});
  ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
  EXPECT_TRUE(checkArchive(folder_ / "ct.cdb").empty());
  const auto render =
      run("vestige-explorer", {"render", "ct.cdb", "-o", "ct.png", "--opacity", "200:0,400:0.9"},
          folder_);
  EXPECT_EQ(render.exitCode, 0) << render.err;
  EXPECT_GT(fs::file_size(folder_ / "ct.png"), 2000u);
}

}  // namespace
}  // namespace vestige::test
