// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/parallel.h"

#include <algorithm>
#include <exception>
#include <thread>
#include <vector>

namespace vestige {

void parallelRanges(int count, const std::function<void(int begin, int end)>& work) {
  const int threads = std::clamp(int(std::thread::hardware_concurrency()), 1, std::max(count, 1));
  if (threads == 1) {
    if (count > 0) work(0, count);
    return;
  }
  std::vector<std::exception_ptr> failures{std::size_t(threads)};
  std::vector<std::thread> pool;
  const auto rangeBegin = [&](int i) { return int(std::int64_t(count) * i / threads); };
  for (int i = 0; i < threads; ++i) {
    pool.emplace_back([&, i] {
      try {
        work(rangeBegin(i), rangeBegin(i + 1));
      } catch (...) {
        failures[std::size_t(i)] = std::current_exception();
      }
    });
  }
  for (std::thread& thread : pool) thread.join();
  for (const std::exception_ptr& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
}

}  // namespace vestige
