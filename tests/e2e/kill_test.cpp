// SPDX-License-Identifier: BSD-3-Clause
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <sstream>
#include <thread>

#include "proxy/archive.h"
#include "tests/e2e/program.h"
#include "tests/e2e/scratch.h"

namespace vestige::test {
namespace {

class Kill : public Scratch {};

/// Cycles that the simulation announced: their execute had returned. A torn line says nothing.
std::vector<long> announced(const std::string& printed) {
  std::vector<long> cycles;
  std::istringstream lines(printed.substr(0, printed.rfind('\n') + 1));
  std::string word;
  for (long cycle; lines >> word >> cycle;) cycles.push_back(cycle);
  return cycles;
}

// The acceptance test of crash safety: kill -9 at 50 random moments.
TEST_F(Kill, NoStepWhoseExecuteReturnedIsLostAtFiftyRandomMoments) {
  write("small.toml", kSmallConfig);
  std::mt19937 random(20261122);
  std::uniform_int_distribution<int> milliseconds(0, 250);
  std::size_t stored = 0, inWrite = 0;
  for (int round = 0; round < 50; ++round) {
    const std::string name = "killed" + std::to_string(round) + ".cdb";
    Program program("vestige-mini-sim",
                    {"--size", "16", "--steps", "1000000", "--every", "1", "--config", "small.toml",
                     "--output", name, "--announce", "--quiet"},
                    folder_);
    // Most moments fall among writes; every fifth may fall into the start.
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (round % 5 != 0 && program.printed().empty() &&
           std::chrono::steady_clock::now() < deadline)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds(random)));
    program.signal(SIGKILL);
    const auto outcome = program.wait();
    ASSERT_EQ(outcome.exitCode, 128 + SIGKILL) << outcome.err;

    const auto returned = announced(outcome.out);
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

}  // namespace
}  // namespace vestige::test
