// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/each_file.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace vestige {

void forEachFile(int count, const std::function<void(int)>& work,
                 const std::function<void(int, int)>& progress) {
  constexpr int kMostThreads = 8;  // each may hold a file of hundreds of MB
  const int threads = std::min({count, kMostThreads, int(std::thread::hardware_concurrency())});
  std::atomic<int> next{0};
  std::mutex mutex;
  std::exception_ptr first;
  int done = 0;
  const auto take = [&] {
    for (int i; (i = next++) < count;) {
      std::exception_ptr failure;
      try {
        work(i);
      } catch (...) {
        failure = std::current_exception();
        next = count;
      }
      const std::lock_guard lock(mutex);
      if (failure && !first) first = failure;
      ++done;
      if (progress && !failure) progress(done, count);
    }
  };
  std::vector<std::thread> others;
  for (int i = 1; i < threads; ++i) others.emplace_back(take);
  take();
  for (std::thread& thread : others) thread.join();
  if (first) std::rethrow_exception(first);
}

}  // namespace vestige
