// SPDX-License-Identifier: BSD-3-Clause
// What storage does when the disk is full, the process is limited or killed. Each case runs in a
// child process, so that limits, mounts and signals end with it.
#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <random>

#include "proxy/base/durable_file.h"
#include "tests/proxy/archive/archive_fixture.h"

namespace vestige::test {
namespace {

constexpr int kSkipped = 77;

/// Runs `body` in a child; it returns normally or with _exit(kSkipped). Failures print and count.
int inChild(const std::function<void()>& body) {
  setExrThreads(0);  // threads do not survive a fork
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    try {
      body();
    } catch (const std::exception& e) {
      std::fprintf(stderr, "unexpected: %s\n", e.what());
      std::fflush(nullptr);
      ::_exit(1);
    }
    std::fflush(nullptr);
    ::_exit(::testing::Test::HasFailure() ? 1 : 0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  setExrThreads(2);
  EXPECT_TRUE(WIFEXITED(status)) << "killed by signal " << WTERMSIG(status);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

void limitFileSize(rlim_t bytes) {
  rlimit limit;
  ::getrlimit(RLIMIT_FSIZE, &limit);
  limit.rlim_cur = bytes;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
}

void expectUndamaged(const fs::path& path) {
  for (const Finding& f : checkArchive(path)) ADD_FAILURE() << f.file << ": " << f.problem;
}

TEST(ArchiveFaults, AFileSizeLimitLosesTheStepAndNothingElse) {
  Folder folder;
  const fs::path path = folder / "a.cdb";
  EXPECT_EQ(inChild([&] {
              std::signal(SIGXFSZ, SIG_DFL);  // would kill
              ArchiveWriter writer(path, ExistingArchive::Refuse);
              writeStep(writer, 0, 0.0);
              limitFileSize(1000);
              expectError(ErrorCode::NoSpace, path.string(), [&] { writeStep(writer, 10, 1.0); });
              EXPECT_EQ(Archive(path).cycles(), std::vector<long>{0});
              EXPECT_FALSE(fs::exists(path / "c00000010"));
              expectUndamaged(path);
              limitFileSize(RLIM_INFINITY);
              writeStep(writer, 10, 1.0);  // the same cycle again
              EXPECT_EQ(Archive(path).cycles(), (std::vector<long>{0, 10}));
              expectUndamaged(path);
              sigset_t pending;
              sigpending(&pending);
              EXPECT_FALSE(sigismember(&pending, SIGXFSZ));
            }),
            0);
}

TEST(ArchiveFaults, ATableThatCannotGrowLosesTheStepAndNothingElse) {
  Folder folder;
  const fs::path path = folder / "a.cdb";
  EXPECT_EQ(inChild([&] {
              ArchiveWriter writer(path, ExistingArchive::Refuse);
              long cycle = 0;
              // Until the table is the largest file by far.
              while (fs::file_size(path / "data.csv") < 20000) writeStep(writer, cycle++, 0.5);
              const std::string table = contents(path / "data.csv");
              limitFileSize(table.size() + 50);
              expectError(ErrorCode::NoSpace, "data.csv", [&] { writeStep(writer, cycle, 0.5); });
              EXPECT_EQ(contents(path / "data.csv"), table);
              expectUndamaged(path);
              limitFileSize(RLIM_INFINITY);
              writeStep(writer, cycle, 0.5);
              EXPECT_EQ(Archive(path).cycles().back(), cycle);
              expectUndamaged(path);
            }),
            0);
}

TEST(ArchiveFaults, ALimitWhileTheHostBlocksOrCatchesTheSignalChangesNothingForIt) {
  Folder folder;
  EXPECT_EQ(
      inChild([&] {
        static volatile int caught = 0;
        std::signal(SIGXFSZ, [](int) { caught = caught + 1; });
        limitFileSize(10);
        std::string text(100, 'x');
        auto bytes = std::as_bytes(std::span(text.data(), text.size()));
        expectError(ErrorCode::NoSpace, "a.bin", [&] { writeDurably(folder / "a.bin", bytes); });
        expectError(ErrorCode::NoSpace, "b.txt", [&] { appendDurably(folder / "b.txt", text); });
        EXPECT_EQ(caught, 0);
        EXPECT_FALSE(fs::exists(folder / "a.bin"));
        EXPECT_FALSE(fs::exists(folder / "a.bin.tmp"));
        EXPECT_EQ(fs::file_size(folder / "b.txt"), 0u);
      }),
      0);
}

TEST(ArchiveFaults, AFullDiskLosesTheStepAndLaterStepsSucceed) {
  Folder folder;
  const fs::path disk = folder / "disk", path = disk / "a.cdb";
  fs::create_directories(disk);
  const int status = inChild([&] {
    const char* size = "size=128k";
    if (::unshare(CLONE_NEWNS) != 0 && ::unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0)
      ::_exit(kSkipped);
    ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr);
    if (::mount("tmpfs", disk.c_str(), "tmpfs", 0, size) != 0) ::_exit(kSkipped);
    ArchiveWriter writer(path, ExistingArchive::Refuse);
    writeStep(writer, 0, 0.0);
    {
      // Room for the first files of a step, but not for all.
      std::FILE* ballast = std::fopen((disk / "ballast").c_str(), "w");
      const std::string block(4096, 'x');
      while (fs::space(disk).available > 5 * 4096)
        if (std::fwrite(block.data(), 1, block.size(), ballast) != block.size() ||
            std::fflush(ballast) != 0)
          break;
      std::fclose(ballast);
    }
    expectError(ErrorCode::NoSpace, path.string(), [&] { writeStep(writer, 10, 1.0); });
    EXPECT_EQ(Archive(path).cycles(), std::vector<long>{0});
    expectUndamaged(path);
    fs::remove(disk / "ballast");
    writeStep(writer, 20, 2.0);
    EXPECT_EQ(Archive(path).cycles(), (std::vector<long>{0, 20}));
    expectUndamaged(path);
  });
  if (status == kSkipped) GTEST_SKIP() << "this process may not mount a small disk";
  EXPECT_EQ(status, 0);
}

TEST(ArchiveFaults, AKilledWriterLeavesEveryFinishedStepAndNoDamage) {
  Folder folder;
  setExrThreads(0);
  std::mt19937 random(7);
  for (int round = 0; round < 12; ++round) {
    const fs::path path = folder / ("a" + std::to_string(round) + ".cdb");
    int pipe[2];
    ASSERT_EQ(::pipe(pipe), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      try {
        ArchiveWriter writer(path, ExistingArchive::Refuse);
        for (long cycle = 0;; ++cycle) {
          writeStep(writer, cycle, 0.5);
          if (::write(pipe[1], &cycle, sizeof cycle) != sizeof cycle) ::_exit(1);
        }
      } catch (...) {
      }
      ::_exit(1);
    }
    ::close(pipe[1]);
    ::usleep(useconds_t(random() % 120000));
    ::kill(child, SIGKILL);
    long finished = -1;
    for (long cycle; ::read(pipe[0], &cycle, sizeof cycle) == sizeof cycle;) finished = cycle;
    ::close(pipe[0]);
    int status;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL);
    if (!fs::exists(path / "data.csv")) {
      EXPECT_EQ(finished, -1);
      ArchiveWriter again(path, ExistingArchive::Refuse);  // it may take the folder over
      continue;
    }
    std::vector<long> cycles = Archive(path).cycles();
    EXPECT_GE(long(cycles.size()), finished + 1);
    EXPECT_EQ(Archive(path).rows().size(), cycles.size() * 5);
    for (const Finding& f : checkArchive(path)) EXPECT_TRUE(f.leftover) << f.file << f.problem;
    ArchiveWriter writer(path, ExistingArchive::Append);
    writeStep(writer, long(cycles.size()), 0.75);
    EXPECT_EQ(Archive(path).cycles().size(), cycles.size() + 1);
  }
  setExrThreads(2);
}

TEST(ArchiveFaults, AWriterKilledWhileItSupersedesLeavesTheOldStepsOrItsOwn) {
  Folder folder;
  setExrThreads(0);
  std::mt19937 random(11);
  const fs::path stored = folder / "stored.cdb";
  {
    ArchiveWriter writer(stored, ExistingArchive::Refuse);
    for (long cycle = 0; cycle < 6; ++cycle) writeStep(writer, cycle, 0.5);
  }
  const std::vector<ArchiveRow> old = Archive(stored).rows();
  for (int round = 0; round < 16; ++round) {
    const bool append = round % 2 == 0;
    const fs::path path = folder / ("a" + std::to_string(round) + ".cdb");
    fs::copy(stored, path, fs::copy_options::recursive);
    const pid_t child = ::fork();
    if (child == 0) {
      try {
        ArchiveWriter writer(path, append ? ExistingArchive::Append : ExistingArchive::Overwrite);
        for (long cycle = 3;; ++cycle) writeStep(writer, cycle, 0.75);
      } catch (...) {
      }
      ::_exit(1);
    }
    ::usleep(useconds_t(random() % 30000));
    ::kill(child, SIGKILL);
    int status;
    ::waitpid(child, &status, 0);
    for (const Finding& f : checkArchive(path)) EXPECT_TRUE(f.leftover) << f.file << f.problem;
    const std::vector<ArchiveRow> rows = Archive(path).rows();
    if (rows != old) {
      for (const ArchiveRow& row : rows)
        EXPECT_EQ(row.time, row.cycle < 3 && append ? 0.5 : 0.75) << row.exr;
      EXPECT_EQ(rows.size() % 5, 0u);
      EXPECT_TRUE(!append || rows.size() > 15u);
    }
    repairArchive(path);
    EXPECT_EQ(Archive(path).rows().size(), rows.size()) << "a repair brought steps back";
  }
  setExrThreads(2);
}

TEST(DurableFile, WritesAppendsAndTruncates) {
  Folder folder;
  auto write = [&](const std::string& text) {
    writeDurably(folder / "a.txt", std::as_bytes(std::span(text.data(), text.size())));
  };
  write("one");
  write("two two");
  EXPECT_EQ(contents(folder / "a.txt"), "two two");
  EXPECT_FALSE(fs::exists(folder / "a.txt.tmp"));
  appendDurably(folder / "a.txt", " three", true);
  EXPECT_EQ(contents(folder / "a.txt"), "two two three");
  appendDurably(folder / "new.txt", "x");
  EXPECT_EQ(contents(folder / "new.txt"), "x");
  expectError(ErrorCode::Io, "none.txt", [&] { appendDurably(folder / "none.txt", "x", true); });
  truncateDurably(folder / "a.txt", 3);
  EXPECT_EQ(contents(folder / "a.txt"), "two");
  expectError(ErrorCode::Io, "none.txt", [&] { readBytes(folder / "none.txt"); });
  expectError(ErrorCode::Io, folder.path().string(), [&] { readBytes(folder.path()); });
  fs::create_directory(folder / "taken");
  expectError(ErrorCode::Io, "taken", [&] { writeDurably(folder / "taken", {}); });
  EXPECT_FALSE(fs::exists(folder / "taken.tmp"));
}

TEST(DurableFile, ABatchThatIsNotKeptLeavesNothing) {
  Folder folder;
  const std::string text = "text";
  auto bytes = std::as_bytes(std::span(text.data(), text.size()));
  {
    DurableBatch batch(folder.path());
    batch.add("x/y/a", bytes);
  }
  EXPECT_FALSE(fs::exists(folder / "x"));
  {
    DurableBatch batch(folder.path());
    batch.add("x/y/a", bytes);
    batch.place();
    EXPECT_EQ(contents(folder / "x/y/a"), text);
  }
  EXPECT_FALSE(fs::exists(folder / "x"));
  {
    DurableBatch batch(folder.path());
    batch.add("x/y/a", bytes);
    batch.place();
    batch.keep();
  }
  EXPECT_EQ(contents(folder / "x/y/a"), text);
  expectError(ErrorCode::Io, "gone", [&] {
    DurableBatch batch(folder / "gone");
    batch.add("a/b", bytes);
  });
}

}  // namespace
}  // namespace vestige::test
