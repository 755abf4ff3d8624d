// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/base/parallel.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace vestige {
namespace {

int cores() { return std::max(1, int(std::thread::hardware_concurrency())); }

}  // namespace

void parallelFor(int tasks, int threads, const std::function<void(int)>& work) {
  std::atomic<int> next{0};
  std::exception_ptr failure;
  std::mutex mutex;
  const auto drain = [&] {
    for (int i = next++; i < tasks; i = next++) {
      try {
        work(i);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failure) failure = std::current_exception();
        next = tasks;
      }
    }
  };
  if (threads == 0) threads = cores();
  std::vector<std::jthread> helpers;
  try {
    for (int i = 1; i < std::min(threads, tasks); ++i) helpers.emplace_back(drain);
  } catch (const std::system_error&) {
    // No more threads to be had: the ones that we have do all of it.
  }
  drain();
  helpers.clear();
  if (failure) std::rethrow_exception(failure);
}

void parallelRanges(int count, const std::function<void(int begin, int end)>& work) {
  const int ranges = std::min(cores(), count);
  const auto start = [&](int i) { return int(std::int64_t(count) * i / ranges); };
  parallelFor(ranges, ranges, [&](int i) { work(start(i), start(i + 1)); });
}

}  // namespace vestige
