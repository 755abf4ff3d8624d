// SPDX-License-Identifier: BSD-3-Clause
//
// Hostile hosts. Each test is a host process of its own, forked before any thread or GL context is
// made, so that what it does to itself ends with it.
#include <dirent.h>
#include <fcntl.h>
#include <fenv.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#include <atomic>
#include <clocale>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <locale>

#include "simulation.h"
#include "tests/proxy/gl/host_context.h"

namespace vestige::test {
namespace {

TEST(Hosts, FloatingPointTrapsNeitherKillUsNorAreTouched) {
  EXPECT_EQ(inChild([]() -> std::string {
              const Folder folder;
              Sample sample;
              sample.values[3] = std::numeric_limits<float>::quiet_NaN();
              sample.values[4] = std::numeric_limits<float>::infinity();
              const int traps = FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW;
              feclearexcept(FE_ALL_EXCEPT);
              feenableexcept(traps);
              fesetround(FE_DOWNWARD);
              {
                Simulation run(folder / "a.cdb");
                RETURN_UNLESS_OK(run.opened);
                RETURN_UNLESS_OK(run.step(sample, 0));
                vestige_grid bad = sample.grid;
                bad.spacing[0] = std::numeric_limits<double>::signaling_NaN();
                RETURN_UNLESS(vestige_block(run.session, 0, &bad) == VESTIGE_ERROR_GRID);
                const double nan = std::numeric_limits<double>::signaling_NaN();
                vestige_wants(run.session, 1, nan);
                RETURN_UNLESS(vestige_execute(run.session, 1, nan) == VESTIGE_ERROR_CYCLE);
              }
              RETURN_UNLESS(fegetexcept() == traps);
              RETURN_UNLESS(fegetround() == FE_DOWNWARD);
              RETURN_UNLESS((fetestexcept(FE_ALL_EXCEPT) & traps) == 0);
              fesetround(FE_TONEAREST);
              fedisableexcept(FE_ALL_EXCEPT);
              return damageOf(folder / "a.cdb");
            }),
            "");
}

TEST(Hosts, FloatingPointEnvironmentOfTheHostDoesNotChangeAByte) {
  EXPECT_EQ(inChild([]() -> std::string {
              const Folder folder;
              const Sample sample;
              for (const int rounding : {FE_TONEAREST, FE_UPWARD, FE_TOWARDZERO}) {
                fesetround(rounding);
                Simulation run(folder / (std::to_string(rounding) + ".cdb"));
                RETURN_UNLESS_OK(run.step(sample, 0));
              }
              fesetround(FE_TONEAREST);
              const auto name = [&](int rounding) {
                return filesOf(folder / (std::to_string(rounding) + ".cdb"));
              };
              RETURN_UNLESS(name(FE_TONEAREST) == name(FE_UPWARD));
              RETURN_UNLESS(name(FE_TONEAREST) == name(FE_TOWARDZERO));
              return "";
            }),
            "");
}

TEST(Hosts, CommaDecimalLocaleDoesNotChangeAByte) {
  EXPECT_EQ(inChild([]() -> std::string {
              const Folder folder;
              const Sample sample;
              const std::string config = std::string(kSmallImage) +
                                         "reference_length = 0.0125\n[[field]]\nsource = 'f'\n"
                                         "range = [-0.5, 1.5]\nopacity = [[0.25, 0.5]]\n";
              {
                Simulation run(folder / "c.cdb", config);
                RETURN_UNLESS_OK(run.step(sample, 1));
              }
              const std::string target = folder / "de_DE.UTF-8";
              const std::string command = "localedef -i de_DE -f UTF-8 " + target;
              RETURN_UNLESS(std::system(command.c_str()) == 0);
              setenv("LOCPATH", folder.path().c_str(), 1);
              RETURN_UNLESS(std::setlocale(LC_ALL, "de_DE.UTF-8") != nullptr);
              std::locale::global(std::locale("de_DE.UTF-8"));
              RETURN_UNLESS(std::string(std::localeconv()->decimal_point) == ",");
              {
                Simulation run(folder / "de.cdb", config);
                RETURN_UNLESS_OK(run.opened);
                RETURN_UNLESS_OK(run.step(sample, 1));
              }
              const std::string damage = damageOf(folder / "de.cdb");
              RETURN_UNLESS(damage.empty());
              RETURN_UNLESS(filesOf(folder / "c.cdb") == filesOf(folder / "de.cdb"));
              std::ifstream timings(folder / "de.cdb/timings.csv");
              std::string line;
              std::getline(timings, line);
              std::getline(timings, line);
              RETURN_UNLESS(line.rfind("1,0.1,0.", 0) == 0);
              return "";
            }),
            "");
}

/// A host that draws, has us in between, and goes on drawing.
template <class Context>
std::string withContext(const char* backend) {
  const Folder folder;
  const Sample sample;
  Context host;
  host.clear(1.0f, 0.0f, 0.0f);
  {
    Simulation run(folder / "a.cdb",
                   std::string(kSmallImage) + "[gl]\nbackend = '" + backend + "'\n");
    RETURN_UNLESS_OK(run.opened);
    RETURN_UNLESS_OK(run.step(sample, 0));
    RETURN_UNLESS(host.isCurrent());
    RETURN_UNLESS(host.pixel()[0] == 255 && host.pixel()[1] == 0);
    host.clear(0.0f, 1.0f, 0.0f);
    RETURN_UNLESS_OK(run.step(sample, 1));
  }
  RETURN_UNLESS(host.isCurrent());
  RETURN_UNLESS(host.pixel()[0] == 0 && host.pixel()[1] == 255);
  return damageOf(folder / "a.cdb");
}

TEST(Hosts, OwnOSMesaContextStaysCurrentAndIntact) {
  EXPECT_EQ(inChild([] { return withContext<gl::HostOSMesa>("osmesa"); }), "");
  EXPECT_EQ(inChild([] { return withContext<gl::HostOSMesa>("egl"); }), "");
}

TEST(Hosts, OwnEglContextStaysCurrentAndIntact) {
  EXPECT_EQ(inChild([] { return withContext<gl::HostEgl>("osmesa"); }), "");
  EXPECT_EQ(inChild([] { return withContext<gl::HostEgl>("egl"); }), "");
}

TEST(Hosts, OneCoreAffinityOfTheHostIsKept) {
  EXPECT_EQ(inChild([]() -> std::string {
              const Folder folder;
              cpu_set_t before;
              CPU_ZERO(&before);
              sched_getaffinity(0, sizeof before, &before);
              int first = 0;
              while (!CPU_ISSET(first, &before)) ++first;
              cpu_set_t one;
              CPU_ZERO(&one);
              CPU_SET(first, &one);
              RETURN_UNLESS(sched_setaffinity(0, sizeof one, &one) == 0);
              Simulation run(folder / "a.cdb");
              RETURN_UNLESS_OK(run.opened);
              RETURN_UNLESS_OK(run.step(Sample(), 0));
              cpu_set_t after;
              CPU_ZERO(&after);
              sched_getaffinity(0, sizeof after, &after);
              RETURN_UNLESS(CPU_EQUAL(&one, &after));
              return damageOf(folder / "a.cdb");
            }),
            "");
}

TEST(Hosts, TheEncodersPoolHasAsManyThreadsAsTheConfigurationSays) {
  const auto threadsWith = [](int count) {
    return inChild([count]() -> std::string {
      const Folder folder;
      Simulation run(folder / "a.cdb",
                     std::string(kSmallImage) + "[gl]\nthreads = " + std::to_string(count) + "\n");
      RETURN_UNLESS_OK(run.opened);
      RETURN_UNLESS_OK(run.step(Sample(), 0));
      const std::filesystem::directory_iterator tasks("/proc/self/task");
      return std::to_string(std::distance(begin(tasks), end(tasks)));
    });
  };
  // The rasteriser's threads, and as many that encode.
  EXPECT_GE(std::stoi(threadsWith(9)) - std::stoi(threadsWith(2)), 2 * (9 - 2));
}

TEST(Hosts, ClosedStandardStreamsReceiveNothing) {
  EXPECT_EQ(inChild([]() -> std::string {
              const Folder folder;
              // 0, 1 and 2 are now the first descriptors that our files get.
              close(0);
              close(1);
              close(2);
              {
                Simulation run(folder / "a.cdb");
                RETURN_UNLESS_OK(run.opened);
                RETURN_UNLESS_OK(run.step(Sample(), 0));
                RETURN_UNLESS_OK(run.step(Sample(), 1));
              }
              return damageOf(folder / "a.cdb");
            }),
            "");
}

TEST(Hosts, MesaPrintsNothingWhereItCannotKeepItsCacheAndTheEnvironmentStays) {
  for (const char* backend : {"osmesa", "egl"}) {
    EXPECT_EQ(inChild([&]() -> std::string {
                const Folder folder;
                unsetenv("DISPLAY");
                unsetenv("MESA_SHADER_CACHE_DIR");
                setenv("HOME", "/proc/nowhere", 1);
                setenv("XDG_CACHE_HOME", "/proc/nowhere", 1);
                setenv("VESTIGE_GL", backend, 1);
                char** const before = environ;
                const int file = open((folder / "out").c_str(), O_CREAT | O_RDWR, 0600);
                dup2(file, 1);
                dup2(file, 2);
                {
                  Simulation run(folder / "a.cdb");
                  RETURN_UNLESS_OK(run.opened);
                  RETURN_UNLESS_OK(run.step(Sample(), 0));
                }
                RETURN_UNLESS(environ == before);
                RETURN_UNLESS(!getenv("MESA_SHADER_CACHE_DISABLE") && !getenv("EGL_LOG_LEVEL"));
                std::ifstream printed(folder / "out");
                return {std::istreambuf_iterator<char>(printed), {}};
              }),
              "")
        << backend;
  }
}

TEST(Hosts, NothingIsPrintedWhereThereIsALog) {
  EXPECT_EQ(inChild([]() -> std::string {
              const Folder folder;
              const int file = open((folder / "out").c_str(), O_CREAT | O_RDWR, 0600);
              dup2(file, 1);
              dup2(file, 2);
              {
                Simulation run(folder / "a.cdb");
                RETURN_UNLESS_OK(run.step(Sample(), 0));
                Simulation refused(folder / "a.cdb");
                RETURN_UNLESS(refused.opened == VESTIGE_ERROR_EXISTS);
              }
              RETURN_UNLESS(std::filesystem::file_size(folder / "out") == 0);
              return "";
            }),
            "");
}

/// A full disk: the step is lost, what was finished is not, and later steps succeed.
std::string whenFull(const std::string& archive, const std::function<void()>& fill,
                     const std::function<void()>& empty) {
  const Sample sample;
  {
    Simulation run(archive);
    RETURN_UNLESS_OK(run.opened);
    RETURN_UNLESS_OK(run.step(sample, 0));
    const auto before = filesOf(archive);
    fill();
    for (int cycle = 1; cycle < 3; ++cycle) {
      const int code = run.step(sample, cycle);
      if (code != VESTIGE_ERROR_NO_SPACE) {
        return std::string("full: ") + vestige_code_name(code) + ": " + run.error();
      }
      RETURN_UNLESS(run.logged("error: "));
    }
    empty();
    RETURN_UNLESS(filesOf(archive) == before);
    RETURN_UNLESS_OK(run.step(sample, 3));
  }
  RETURN_UNLESS(cyclesOf(archive) == (std::vector<long>{0, 3}));
  return damageOf(archive);
}

TEST(Hosts, FileSizeLimitLosesAStepAndKillsNobody) {
  EXPECT_EQ(inChild([]() -> std::string {
              const Folder folder;
              rlimit limit{};
              getrlimit(RLIMIT_FSIZE, &limit);
              const rlim_t before = limit.rlim_cur;
              signal(SIGXFSZ, SIG_DFL);
              return whenFull(
                  folder / "a.cdb",
                  [&] {
                    limit.rlim_cur = 700;
                    setrlimit(RLIMIT_FSIZE, &limit);
                  },
                  [&] {
                    limit.rlim_cur = before;
                    setrlimit(RLIMIT_FSIZE, &limit);
                  });
            }),
            "");
}

TEST(Hosts, FullDiskLosesAStepAndTheNextSucceeds) {
  const std::string result = inChild([]() -> std::string {
    const Folder folder;
    if (unshare(CLONE_NEWNS) != 0 ||
        mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        mount("vestige", folder.path().c_str(), "tmpfs", 0, "size=4m") != 0) {
      return "no mount";
    }
    const std::string ballast = folder / "ballast";
    const auto outcome = whenFull(
        folder / "a.cdb",
        [&] {
          std::ofstream stream(ballast, std::ios::binary);
          const std::string page(4096, 'x');
          while (stream.write(page.data(), std::streamsize(page.size())).flush()) continue;
        },
        [&] { std::filesystem::remove(ballast); });
    umount(folder.path().c_str());
    return outcome;
  });
  if (result == "no mount") GTEST_SKIP() << "mounting a tmpfs is not permitted here";
  EXPECT_EQ(result, "");
}

TEST(Hosts, ArchiveFolderRemovedWhileRunningIsReportedAndSurvived) {
  EXPECT_EQ(inChild([]() -> std::string {
              const Folder folder;
              const Sample sample;
              Simulation run(folder / "a.cdb");
              RETURN_UNLESS_OK(run.step(sample, 0));
              std::filesystem::remove_all(folder / "a.cdb");
              RETURN_UNLESS(run.step(sample, 1) == VESTIGE_ERROR_IO);
              RETURN_UNLESS(run.error().find("a.cdb") != std::string::npos);
              RETURN_UNLESS_OK(run.step(sample, 2));
              RETURN_UNLESS(cyclesOf(folder / "a.cdb") == std::vector<long>{2});
              return damageOf(folder / "a.cdb");
            }),
            "");
}

TEST(Hosts, OutOfMemoryAreToldSo) {
  EXPECT_EQ(inChild([]() -> std::string {
              const Folder folder;
              Simulation run(folder / "a.cdb");
              rlimit limit{};
              getrlimit(RLIMIT_AS, &limit);
              const rlim_t before = limit.rlim_cur;
              long pages = 0;
              std::ifstream("/proc/self/statm") >> pages;
              limit.rlim_cur = rlim_t(pages) * rlim_t(sysconf(_SC_PAGESIZE)) + (64u << 20);
              setrlimit(RLIMIT_AS, &limit);
              // The coordinates of a block are ours: 8 MB each.
              vestige_grid grid = VESTIGE_GRID_INIT;
              grid.points[0] = 1 << 20;
              grid.points[1] = grid.points[2] = 1;
              int code = VESTIGE_OK;
              for (int block = 1; block < 100 && code == VESTIGE_OK; ++block)
                code = vestige_block(run.session, block, &grid);
              limit.rlim_cur = before;
              setrlimit(RLIMIT_AS, &limit);
              if (code != VESTIGE_ERROR_MEMORY) return vestige_code_name(code);
              grid.points[0] = 0;
              for (int block = 1; block < 100; ++block) vestige_block(run.session, block, &grid);
              return run.step(Sample(), 0) == VESTIGE_OK ? "" : "not usable: " + run.error();
            }),
            "");
}

std::atomic<int> handled{0}, handledElsewhere{0};

TEST(Hosts, SignalHandlersOfTheHostRunOnItsOwnThreadsOnly) {
  EXPECT_EQ(inChild([]() -> std::string {
              const Folder folder;
              struct sigaction action {};
              action.sa_handler = [](int) {
                ++handled;
                if (syscall(SYS_gettid) != getpid()) ++handledElsewhere;
              };
              action.sa_flags = SA_RESTART;
              sigaction(SIGALRM, &action, nullptr);
              const itimerval often{{0, 1000}, {0, 1000}};
              setitimer(ITIMER_REAL, &often, nullptr);
              {
                Simulation run(folder / "a.cdb");
                RETURN_UNLESS_OK(run.opened);
                for (int cycle = 0; cycle < 3; ++cycle) {
                  RETURN_UNLESS_OK(run.step(Sample(), cycle));
                }
              }
              const itimerval never{};
              setitimer(ITIMER_REAL, &never, nullptr);
              RETURN_UNLESS(handled > 0);
              RETURN_UNLESS(handledElsewhere == 0);
              return damageOf(folder / "a.cdb");
            }),
            "");
}

TEST(Hosts, ForkedChildOfAHostIsTurnedAwayNotHung) {
  EXPECT_EQ(inChild([]() -> std::string {
              const Folder folder;
              Simulation run(folder / "a.cdb");
              RETURN_UNLESS_OK(run.step(Sample(), 0));
              const auto inner = inChild([&]() -> std::string {
                RETURN_UNLESS(run.step(Sample(), 1) == VESTIGE_ERROR_ARGUMENT);
                RETURN_UNLESS(run.error().find("another process") != std::string::npos);
                RETURN_UNLESS_OK(vestige_close(run.session));
                return "";
              });
              RETURN_UNLESS(inner.empty());
              RETURN_UNLESS_OK(run.step(Sample(), 1));
              return damageOf(folder / "a.cdb");
            }),
            "");
}

TEST(Hosts, ThreadsAreGoneAfterClose) {
  EXPECT_EQ(inChild([]() -> std::string {
              const auto threads = [] {
                int count = 0;
                DIR* tasks = opendir("/proc/self/task");
                while (tasks && readdir(tasks)) ++count;
                if (tasks) closedir(tasks);
                return count;
              };
              const Folder folder;
              const int before = threads();
              for (int i = 0; i < 2; ++i) {
                Simulation run(folder / (std::to_string(i) + ".cdb"));
                RETURN_UNLESS_OK(run.step(Sample(), 0));
              }
              // Mesa keeps its own pool, a second session adds nothing to it.
              const int after = threads();
              {
                Simulation run(folder / "again.cdb");
                RETURN_UNLESS_OK(run.step(Sample(), 0));
              }
              RETURN_UNLESS(threads() <= std::max(after, before));
              return "";
            }),
            "");
}

}  // namespace
}  // namespace vestige::test
