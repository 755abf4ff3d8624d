// SPDX-License-Identifier: BSD-3-Clause
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <sstream>
#include <thread>

#include "proxy/archive/archive.h"
#include "tests/e2e/program.h"
#include "tests/e2e/scratch.h"

namespace vestige::test {
namespace {

namespace fs = std::filesystem;

/// Cycles that the simulation announced: their execute had returned. A torn line says nothing.
std::vector<long> announced(const std::string& printed) {
  std::vector<long> cycles;
  std::istringstream lines(printed.substr(0, printed.rfind('\n') + 1));
  std::string word;
  for (long cycle; lines >> word >> cycle;) cycles.push_back(cycle);
  return cycles;
}

class Kill : public Scratch {
 protected:
  std::vector<std::string> simulation(const std::string& config, const std::string& archive,
                                      const std::string& steps) const {
    return {"--size",   "16",   "--steps",  steps,   "--every",    "1",
            "--config", config, "--output", archive, "--announce", "--quiet"};
  }
  /// Kills a program after a while. What it had announced.
  std::vector<long> kill(Program& program, std::chrono::microseconds after) const {
    std::this_thread::sleep_for(after);
    program.signal(SIGKILL);
    return announced(program.wait().out);
  }
  void waitForOutput(Program& program) const {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (program.printed().empty() && std::chrono::steady_clock::now() < deadline)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  void expectNoDamage(const fs::path& archive, const std::string& when) const {
    for (const Finding& finding : checkArchive(archive))
      EXPECT_TRUE(finding.leftover) << when << ": " << finding.file << ": " << finding.problem;
  }
  /// Steps 0 .. 7 of a run that ended well, and what no row names as a killed run leaves it.
  fs::path storedRun() {
    write("small.toml", kSmallConfig);
    const auto made = run("vestige-mini-sim", simulation("small.toml", "stored.cdb", "8"), folder_);
    EXPECT_EQ(made.exitCode, 0) << made.err;
    return folder_ / "stored.cdb";
  }

  std::mt19937 random_{20261122};
};

// The acceptance test of crash safety: kill -9 at 50 random moments.
TEST_F(Kill, NoStepWhoseExecuteReturnedIsLostAtFiftyRandomMoments) {
  write("small.toml", kSmallConfig);
  std::uniform_int_distribution<int> milliseconds(0, 250);
  std::size_t stored = 0, inWrite = 0;
  for (int round = 0; round < 50; ++round) {
    const std::string name = "killed" + std::to_string(round) + ".cdb";
    Program program("vestige-mini-sim", simulation("small.toml", name, "1000000"), folder_);
    // Most moments fall among writes; every fifth may fall into the start.
    if (round % 5 != 0) waitForOutput(program);
    const auto returned = kill(program, std::chrono::milliseconds(milliseconds(random_)));

    const auto archive = folder_ / name;
    if (returned.empty() && !std::filesystem::exists(archive / "data.csv")) continue;
    const auto cycles = Archive(archive).cycles();
    for (long cycle : returned)
      EXPECT_TRUE(std::binary_search(cycles.begin(), cycles.end(), cycle))
          << "round " << round << " lost cycle " << cycle;
    for (const Finding& finding : checkArchive(archive)) {
      // What every reader ignores may be left; damage may not.
      EXPECT_TRUE(finding.leftover)
          << "round " << round << ": " << finding.file << ": " << finding.problem;
      ++inWrite;
    }
    if (round % 10 == 0) {
      const auto check = run("vestige-explorer", {"check", name}, folder_);
      EXPECT_EQ(check.exitCode, 0) << check.out << check.err;
    }
    // At most the step that was under way is there beyond what was announced.
    EXPECT_LE(cycles.size(), returned.size() + 1);
    stored += returned.size();
    std::filesystem::remove_all(archive);
  }
  EXPECT_GT(stored, 50u) << "the test needs steps to lose";
  RecordProperty("stored", int(stored));
  RecordProperty("leftovers", int(inWrite));
}

// A run that starts at cycle 0 again supersedes or removes all that the archive holds. Killed at
// any moment, it leaves the old steps, all of them, or the new ones that returned.
TEST_F(Kill, AppendingAndOverwritingLeaveTheOldRunOrTheNewOne) {
  const auto stored = storedRun();
  const auto old = Archive(stored).rows();
  // The program's start, which is most of the time until its first step, holds nothing to kill.
  std::uniform_int_distribution<int> milliseconds(0, 60);
  int olds = 0, news = 0;
  for (const std::string policy : {"append", "overwrite"}) {
    std::string config = kSmallConfig;
    config.insert(config.find("path ="), "existing = \"" + policy + "\"\n");
    write(policy + ".toml", config);
    for (int round = 0; round < 8; ++round) {
      const std::string name = policy + std::to_string(round) + ".cdb";
      const auto archive = folder_ / name;
      fs::copy(stored, archive, fs::copy_options::recursive);
      Program program("vestige-mini-sim", simulation(policy + ".toml", name, "1000000"), folder_);
      if (round % 2 == 0) {
        // From the moment at which the table changes.
        const auto before = fs::last_write_time(archive / "data.csv");
        const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
        while (fs::last_write_time(archive / "data.csv") == before &&
               std::chrono::steady_clock::now() < deadline)
          std::this_thread::yield();
      } else {
        waitForOutput(program);
      }
      const auto after = round % 2 == 0 ? std::chrono::microseconds(random_() % 3000)
                                        : std::chrono::milliseconds(milliseconds(random_));
      const auto returned = kill(program, after);
      const std::string when = policy + ", round " + std::to_string(round);
      expectNoDamage(archive, when);
      const auto rows = Archive(archive).rows();
      if (rows == old && returned.empty()) {
        ++olds;
        continue;
      }
      ++news;
      const auto cycles = Archive(archive).cycles();
      EXPECT_TRUE(std::includes(cycles.begin(), cycles.end(), returned.begin(), returned.end()))
          << when;
      EXPECT_LE(cycles.size(), returned.size() + 1) << when << ": old steps are among the new ones";
      // Nothing that was superseded comes back.
      EXPECT_EQ(run("vestige-explorer", {"check", "--repair", name}, folder_).exitCode, 0) << when;
      EXPECT_EQ(Archive(archive).cycles(), cycles) << when;
    }
  }
  EXPECT_GT(news, 4);
  RecordProperty("old", olds);
}

// A repair that is killed has done nothing or all, and the next one ends it.
TEST_F(Kill, ARepairThatIsKilledCanBeRepeated) {
  const auto stored = storedRun();
  const auto cycles = Archive(stored).cycles();
  const auto table = readFile(stored / "data.csv");
  for (int round = 0; round < 12; ++round) {
    const std::string name = "repaired" + std::to_string(round) + ".cdb";
    const auto archive = folder_ / name;
    fs::copy(stored, archive, fs::copy_options::recursive);
    // Leftovers only; the table truncated; the table gone.
    std::ofstream(archive / "c00000003/front/x.exr.tmp") << "half a file";
    const bool sound = round % 3 == 0;
    if (round % 3 == 1) fs::resize_file(archive / "data.csv", table.size() / 2);
    if (round % 3 == 2) fs::remove(archive / "data.csv");
    Program program("vestige-explorer", {"check", "--repair", name}, folder_);
    kill(program, std::chrono::microseconds(random_() % 60000));
    const std::string when = "round " + std::to_string(round);
    if (sound) {
      expectNoDamage(archive, when);
      EXPECT_EQ(Archive(archive).cycles(), cycles) << when;
    }
    const auto again = run("vestige-explorer", {"check", "--repair", name}, folder_);
    EXPECT_EQ(again.exitCode, 0) << when << ": " << again.out << again.err;
    EXPECT_TRUE(checkArchive(archive).empty()) << when;
    EXPECT_EQ(Archive(archive).cycles(), cycles) << when;
    EXPECT_EQ(Archive(archive).rows().size(), Archive(stored).rows().size()) << when;
  }
}

}  // namespace
}  // namespace vestige::test
