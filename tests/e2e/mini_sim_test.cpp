// SPDX-License-Identifier: BSD-3-Clause
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "proxy/archive/archive.h"
#include "tests/e2e/program.h"
#include "tests/e2e/scratch.h"

namespace vestige::test {
namespace {

namespace fs = std::filesystem;

class MiniSim : public Scratch {
 protected:
  Outcome simulate(std::vector<std::string> arguments,
                   const std::map<std::string, std::string>& environment = {}) {
    arguments.insert(arguments.begin(), {"--size", "24"});
    return run("vestige-mini-sim", arguments, folder_, environment);
  }
  Outcome explore(const std::vector<std::string>& arguments) {
    return run("vestige-explorer", arguments, folder_);
  }
};

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST_F(MiniSim, LeavesAnArchiveThatTheExplorerChecksListsAndRenders) {
  write("small.toml", kSmallConfig);
  const auto outcome =
      simulate({"--steps", "40", "--every", "20", "--config", "small.toml", "--announce"});
  ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
  EXPECT_EQ(outcome.out.substr(0, outcome.out.find("steps ")), "stored 0\nstored 20\nstored 40\n");
  EXPECT_NE(outcome.out.find("\nstored_steps     3\n"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("\nmlups "), std::string::npos);
  EXPECT_NE(outcome.out.find("\nadaptor_percent "), std::string::npos);

  const auto check = explore({"check", "plume.cdb"});
  EXPECT_EQ(check.exitCode, 0) << check.out << check.err;
  const auto info = explore({"info", "plume.cdb"});
  EXPECT_EQ(info.exitCode, 0) << info.err;
  EXPECT_NE(info.out.find("temperature"), std::string::npos) << info.out;
  const auto render = explore({"render", "plume.cdb", "-o", "out.png", "--opacity",
                               "0:0,0.1:0,0.3:0.6,1:0.9", "--colormap", "inferno"});
  ASSERT_EQ(render.exitCode, 0) << render.err;
  EXPECT_EQ(readFile(folder_ / "out.png").substr(1, 3), "PNG");
}

TEST_F(MiniSim, OneProcessOfSeveralIsWarnedAndCheckSaysSoAfterwards) {
  write("small.toml", kSmallConfig);
  const auto outcome =
      simulate({"--steps", "1", "--config", "small.toml"}, {{"PMI_SIZE", "4"}, {"PMI_RANK", "2"}});
  ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
  EXPECT_EQ(occurrences(outcome.out + outcome.err, "PMI_SIZE says that several processes run"), 1u);
  const auto check = explore({"check", "plume.cdb"});
  EXPECT_EQ(check.exitCode, 0) << check.out << check.err;
  EXPECT_EQ(occurrences(check.out, "written by process 2 of 4 without a communicator"), 1u)
      << check.out;
}

TEST_F(MiniSim, ArchiveIsTheSameWithAnyNumberOfThreads) {
  write("small.toml", kSmallConfig);
  for (const char* threads : {"1", "2"}) {
    const auto outcome =
        simulate({"--steps", "30", "--every", "15", "--config", "small.toml", "--threads", threads,
                  "--output", std::string("threads") + threads + ".cdb"});
    ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
  }
  auto one = filesIn(folder_ / "threads1.cdb"), two = filesIn(folder_ / "threads2.cdb");
  one.erase("timings.csv");
  two.erase("timings.csv");
  EXPECT_GT(one.size(), 6u);
  EXPECT_TRUE(one == two);
}

TEST_F(MiniSim, GoesOnWithABadConfigurationAndSaysWhyOnce) {
  write("bad.toml", "[image]\nwidht = 12\n");
  const auto outcome = simulate({"--steps", "30", "--config", "bad.toml"});
  EXPECT_EQ(outcome.exitCode, 0);
  EXPECT_EQ(occurrences(outcome.err, "bad.toml:2"), 1u) << outcome.err;
  EXPECT_NE(outcome.err.find("widht"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.out.find("\nstored_steps     0\n"), std::string::npos) << outcome.out;
}

TEST_F(MiniSim, GoesOnWithoutItsConfigurationFile) {
  const auto outcome = simulate({"--steps", "10", "--config", "none.toml"});
  EXPECT_EQ(outcome.exitCode, 0);
  EXPECT_EQ(occurrences(outcome.err, "none.toml"), 1u) << outcome.err;
}

TEST_F(MiniSim, GoesOnBesideAnArchiveThatItMayNotTouch) {
  write("small.toml", kSmallConfig);
  const std::vector<std::string> arguments = {"--steps", "10",       "--every",
                                              "10",      "--config", "small.toml"};
  ASSERT_EQ(simulate(arguments).exitCode, 0);
  const auto before = filesIn(folder_ / "plume.cdb");
  const auto outcome = simulate(arguments);
  EXPECT_EQ(outcome.exitCode, 0);
  EXPECT_EQ(occurrences(outcome.err, "VESTIGE_ERROR_EXISTS"), 1u) << outcome.err;
  EXPECT_TRUE(before == filesIn(folder_ / "plume.cdb"));
}

TEST_F(MiniSim, LeavesNothingWithoutTheAdaptor) {
  EXPECT_EQ(simulate({"--steps", "10", "--no-adaptor", "--output", "none.cdb"}).exitCode, 0);
  EXPECT_FALSE(fs::exists(folder_ / "none.cdb"));
  EXPECT_EQ(
      simulate({"--steps", "10", "--output", "none.cdb"}, {{"VESTIGE_DISABLE", "1"}}).exitCode, 0);
  EXPECT_FALSE(fs::exists(folder_ / "none.cdb"));
}

TEST_F(MiniSim, LeavesNoArchiveOfARunInWhichNothingCouldBeStored) {
  write("none.toml", std::string(kSmallConfig) + "[[field]]\nsource = \"presure\"\n");
  const auto outcome = simulate({"--steps", "30", "--config", "none.toml"});
  EXPECT_EQ(outcome.exitCode, 0);
  EXPECT_EQ(occurrences(outcome.err, "'presure'"), 1u) << outcome.err;
  EXPECT_FALSE(fs::exists(folder_ / "plume.cdb"));
}

TEST_F(MiniSim, SaysWhichOptionWasMeant) {
  const auto outcome = simulate({"--stesp", "30"});
  EXPECT_EQ(outcome.exitCode, 2);
  EXPECT_NE(outcome.err.find("did you mean --steps?"), std::string::npos) << outcome.err;
}

TEST_F(MiniSim, ASmallBudgetTakesALowerLevelThatInfoNames) {
  write("budget.toml",
        "[image]\nwidth = 48\nheight = 48\nproxies = [\"sliced\"]\n[output]\npath = \"plume.cdb\"\n"
        "previews = false\n[budget]\nbytes_per_step = \"24 kB\"\n"
        "[[field]]\nsource = \"temperature\"\nrange = [0.0, 1.0]\nintervals = 8\n");
  const auto outcome = simulate({"--steps", "10", "--every", "5", "--config", "budget.toml"});
  ASSERT_EQ(outcome.exitCode, 0) << outcome.err;
  const auto info = explore({"info", "plume.cdb"});
  EXPECT_NE(info.out.find("; budget of 24000 bytes a step: quality level "), std::string::npos)
      << info.out;
  EXPECT_NE(info.out.find("(one stack of "), std::string::npos) << info.out;
  EXPECT_EQ(info.out.find("quality level 1 of"), std::string::npos) << info.out;
  EXPECT_TRUE(checkArchive(folder_ / "plume.cdb").empty());
}

TEST_F(MiniSim, ADryRunPrintsItsFigures) {
  write("dry.toml", "dry_run = true\n" + std::string(kSmallConfig));
  const auto outcome = simulate({"--steps", "10", "--config", "dry.toml"});
  EXPECT_EQ(outcome.exitCode, 0) << outcome.err;
  for (const char* words : {"dry run: a step takes", "proxy 'length'", "would have been stored"})
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.out.find("\nstored_steps     0\nwould_store      "), std::string::npos)
      << outcome.out;
  EXPECT_FALSE(fs::exists(folder_ / "plume.cdb"));
}

TEST_F(MiniSim, ClosesTheArchiveWhenInterrupted) {
  write("small.toml", kSmallConfig);
  Program program("vestige-mini-sim",
                  {"--size", "24", "--steps", "1000000", "--every", "5", "--config", "small.toml",
                   "--announce"},
                  folder_);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (program.printed().find("stored 10\n") == std::string::npos &&
         std::chrono::steady_clock::now() < deadline)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  program.signal(SIGINT);
  const auto outcome = program.wait();
  EXPECT_EQ(outcome.exitCode, 130);
  EXPECT_NE(outcome.err.find("interrupted after step"), std::string::npos) << outcome.err;
  EXPECT_TRUE(checkArchive(folder_ / "plume.cdb").empty());
  EXPECT_GE(Archive(folder_ / "plume.cdb").cycles().size(), 3u);
}

TEST_F(MiniSim, RefusesBadUsageWithTheValue) {
  for (const auto& [option, value] :
       {std::pair{"--size", "12y"}, std::pair{"--size", "0"}, std::pair{"--precision", "half"},
        std::pair{"--steps", "-1"}, std::pair{"--fields", "pressure"}}) {
    const auto outcome = run("vestige-mini-sim", {option, value}, folder_);
    EXPECT_EQ(outcome.exitCode, 2) << option;
    EXPECT_NE((outcome.err + outcome.out).find(value), std::string::npos) << outcome.err;
  }
  EXPECT_EQ(run("vestige-mini-sim", {"--help"}, folder_).exitCode, 0);
}

}  // namespace
}  // namespace vestige::test
