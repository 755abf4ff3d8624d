// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/archive/each_file.h"

#include <algorithm>
#include <mutex>
#include <thread>

#include "proxy/base/parallel.h"

namespace vestige {

void forEachFile(int count, const std::function<void(int)>& work,
                 const std::function<void(int, int)>& progress) {
  constexpr int kMostThreads = 8;  // each may hold a file of hundreds of MB
  std::mutex mutex;
  int done = 0;
  parallelFor(count, std::min(kMostThreads, int(std::thread::hardware_concurrency())), [&](int i) {
    work(i);
    const std::lock_guard lock(mutex);
    ++done;
    if (progress) progress(done, count);
  });
}

}  // namespace vestige
