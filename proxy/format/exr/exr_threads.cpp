// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/exr/exr_threads.h"

#include <OpenEXR/IlmThreadPool.h>
#include <OpenEXR/ImfThreading.h>

#include <algorithm>
#include <cfenv>
#include <csignal>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "proxy/format/exr/exr_file.h"

namespace vestige {
namespace {

constexpr int kMostDefaultThreads = 8;
constexpr int kMostThreads = 256;

std::mutex poolMutex;
bool poolChosen = false;

/// Threads inherit the signal mask and the floating-point environment of their maker; the pool's
/// must take no signal of the host's and must not trap, whatever the host does.
void resizePool(int count) {
  sigset_t all, before;
  sigfillset(&all);
  std::fenv_t environment;
  pthread_sigmask(SIG_BLOCK, &all, &before);
  std::fegetenv(&environment);
  std::fesetenv(FE_DFL_ENV);
  Imf::setGlobalThreadCount(count);
  std::fesetenv(&environment);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

class Job : public IlmThread::Task {
 public:
  Job(IlmThread::TaskGroup* group, const std::function<void()>& run) : Task(group), run_(run) {}
  void execute() override { run_(); }

 private:
  std::function<void()> run_;
};

}  // namespace

void setExrThreads(int count) {
  std::lock_guard lock(poolMutex);
  poolChosen = true;
  resizePool(std::clamp(count, 0, kMostThreads));
}

void ensureExrThreads(int threads) {
  std::lock_guard lock(poolMutex);
  if (std::exchange(poolChosen, true)) return;
  if (Imf::globalThreadCount() > 0) return;  // the host's own choice
  const int cores = int(std::thread::hardware_concurrency());
  const int wanted =
      threads > 0 ? std::min(threads, kMostThreads) : std::min(cores, kMostDefaultThreads);
  if (wanted > 1) resizePool(wanted);
}

void forEachOnExrThreads(int count, const std::function<void(int)>& work) {
  if (count < 2 || Imf::globalThreadCount() == 0) {
    for (int i = 0; i < count; ++i) work(i);
    return;
  }
  std::recursive_mutex mutex;  // a pool without threads runs jobs where they are made
  std::exception_ptr first;
  {
    IlmThread::TaskGroup group;  // its destructor waits
    // The pool hands tasks over by means that ThreadSanitizer does not see: it sees the mutex, held
    // while there are jobs to make and at both ends of each.
    const std::lock_guard making(mutex);
    for (int i = 0; i < count; ++i) {
      auto guarded = [&, i] {
        { const std::lock_guard made(mutex); }
        std::exception_ptr failure;
        try {
          work(i);
        } catch (...) {
          failure = std::current_exception();
        }
        const std::lock_guard done(mutex);
        if (failure && !first) first = failure;
      };
      IlmThread::ThreadPool::addGlobalTask(new Job(&group, guarded));
    }
  }
  const std::lock_guard all(mutex);
  if (first) std::rethrow_exception(first);
}

}  // namespace vestige
