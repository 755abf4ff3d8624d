// SPDX-License-Identifier: BSD-3-Clause
//
// What a session prints where the host gave it no log. Each test is a host process of its own.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <fstream>

#include "proxy/archive/archive.h"
#include "proxy/base/launch.h"
#include "simulation.h"

namespace vestige::test {
namespace {

/// A session without a log.
struct Silent {
  explicit Silent(const std::string& output, int flags = 0, const char* config = kSmallImage) {
    vestige_options options = VESTIGE_OPTIONS_INIT;
    options.config_text = config;
    options.output = output.c_str();
    options.flags = flags;
    opened = vestige_open(&options, &session);
  }
  int step(const char* name, int cycle) {
    vestige_block(session, 0, &sample.grid);
    vestige_share_field(session, 0, name, VESTIGE_FLOAT32, VESTIGE_POINT, 1, sample.values.data(),
                        nullptr);
    return vestige_execute(session, cycle, cycle);
  }
  Sample sample;
  vestige_session* session = nullptr;
  int opened = VESTIGE_OK;
};

/// What `work` writes to both standard streams.
std::string printedBy(const Folder& folder, const std::function<void()>& work) {
  const std::string name = folder / "printed";
  const int file = open(name.c_str(), O_CREAT | O_TRUNC | O_RDWR, 0600);
  dup2(file, 1);
  dup2(file, 2);
  work();
  std::ifstream stream(name);
  return {std::istreambuf_iterator<char>(stream), {}};
}

constexpr const char* kWantsF = "[image]\nwidth = 48\nheight = 40\n[[field]]\nsource = 'f'\n";

TEST(StandardError, ASecondRunSaysThatItsArchiveExistsAndCloseSaysSoToo) {
  EXPECT_EQ(inChild([]() -> std::string {
              const Folder folder;
              {
                Silent first(folder / "a.cdb");
                RETURN_UNLESS_OK(first.step("f", 0));
                RETURN_UNLESS_OK(vestige_close(first.session));
              }
              int closed = VESTIGE_OK;
              const auto printed = printedBy(folder, [&] {
                Silent second(folder / "a.cdb");
                second.step("f", 0);
                second.step("f", 1);
                closed = vestige_close(second.session);
              });
              RETURN_UNLESS(closed == VESTIGE_ERROR_EXISTS);
              const std::string expected = "vestige: archive '" + (folder / "a.cdb") +
                                           "' exists already; append, overwrite or choose "
                                           "another (VESTIGE_ERROR_EXISTS)\n";
              return printed == expected ? "" : "printed: " + printed;
            }),
            "");
}

TEST(StandardError, OfASessionTheFirstErrorIsPrintedAndGoodStepsAreNot) {
  EXPECT_EQ(
      inChild([]() -> std::string {
        const Folder folder;
        int after = VESTIGE_OK, healed = -1;
        const auto printed = printedBy(folder, [&] {
          Silent run(folder / "a.cdb", 0, kWantsF);
          run.step("f", 0);
          run.step("g", 1);
          run.step("h", 2);
          after = vestige_close(run.session);
          Silent other(folder / "b.cdb", VESTIGE_QUIET, kWantsF);
          other.step("g", 0);
          other.step("f", 1);
          healed = vestige_close(other.session);
        });
        RETURN_UNLESS(after == VESTIGE_ERROR_NO_FIELD);
        RETURN_UNLESS_OK(healed);
        return printed == "vestige: field 'f' is not shared for block 0 (VESTIGE_ERROR_NO_FIELD)\n"
                   ? ""
                   : "printed: " + printed;
      }),
      "");
}

TEST(StandardError, ADryRunSaysWhatItFinds) {
  EXPECT_EQ(
      inChild([]() -> std::string {
        const Folder folder;
        const auto printed = printedBy(folder, [&] {
          Silent run(folder / "a.cdb", 0, "dry_run = true\n[image]\nwidth = 48\nheight = 40\n");
          run.step("f", 0);
          vestige_close(run.session);
        });
        return printed.find("vestige: dry run: 1 steps would have been stored") != std::string::npos
                   ? ""
                   : "printed: " + printed;
      }),
      "");
}

TEST(StandardError, QuietSessionsPrintNothing) {
  EXPECT_EQ(inChild([]() -> std::string {
              const Folder folder;
              return printedBy(folder, [&] {
                Silent run(folder / "a.cdb", VESTIGE_QUIET, "[image]\nwidht = 3\n");
                vestige_close(run.session);
              });
            }),
            "");
}

TEST(StandardError, ProcessesOfALauncherAreWarnedAndTheArchiveRemembers) {
  EXPECT_EQ(inChild([]() -> std::string {
              const Folder folder;
              setenv("OMPI_COMM_WORLD_SIZE", "2", 1);
              setenv("OMPI_COMM_WORLD_RANK", "0", 1);
              int second = VESTIGE_OK;
              const auto printed = printedBy(folder, [&] {
                Silent run(folder / "a.cdb");
                run.step("f", 0);
                // As the other process would.
                Silent other(folder / "a.cdb");
                second = other.opened;
                vestige_close(other.session);
                vestige_close(run.session);
              });
              RETURN_UNLESS(second == VESTIGE_ERROR_EXISTS);
              for (const char* part :
                   {"vestige: warning: OMPI_COMM_WORLD_SIZE says that several processes run",
                    "process 0 of 2, alone", "is being written by another run",
                    "each process needs an archive of its own (VESTIGE_ERROR_EXISTS)"}) {
                if (printed.find(part) == std::string::npos) return part + (": not in " + printed);
              }
              const Archive archive(folder / "a.cdb");
              const auto launch =
                  launchIn(archive.open(archive.rows().front()).header().provenance);
              RETURN_UNLESS((launch == Launch{"", 0, 2}));
              return "";
            }),
            "");
}

TEST(StandardError, AClosedPipeKillsNobody) {
  EXPECT_EQ(inChild([]() -> std::string {
              const Folder folder;
              int ends[2];
              RETURN_UNLESS(pipe(ends) == 0);
              dup2(ends[1], 2);
              close(ends[0]);
              signal(SIGPIPE, SIG_DFL);
              Silent run(folder / "a.cdb", 0, kWantsF);
              RETURN_UNLESS(run.step("g", 0) == VESTIGE_ERROR_NO_FIELD);
              RETURN_UNLESS_OK(run.step("f", 1));
              return "";
            }),
            "");
}

TEST(StandardError, AFileThatTookTheStreamsNumberReceivesNothing) {
  EXPECT_EQ(inChild([]() -> std::string {
              const Folder folder;
              for (const bool before : {true, false}) {
                const std::string archive = folder / (before ? "before.cdb" : "after.cdb");
                const std::string data = folder / "data";
                if (before) close(2);
                {
                  Silent run(archive, 0, kWantsF);
                  if (!before) close(2);
                  const int file = open(data.c_str(), O_CREAT | O_TRUNC | O_RDWR | O_CLOEXEC, 0600);
                  if (!before) RETURN_UNLESS(file == 2);
                  RETURN_UNLESS(run.step("g", 0) == VESTIGE_ERROR_NO_FIELD);
                  RETURN_UNLESS(std::filesystem::file_size(data) == 0);
                  RETURN_UNLESS_OK(run.step("f", 1));
                  vestige_close(run.session);
                  close(file);
                }
                RETURN_UNLESS(damageOf(archive).empty());
                RETURN_UNLESS(open("/dev/null", O_WRONLY) == 2);
              }
              return "";
            }),
            "");
}

}  // namespace
}  // namespace vestige::test
