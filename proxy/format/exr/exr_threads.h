// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

namespace vestige {

/// Calls work(0) .. work(count - 1), on OpenEXR's global pool when it has threads, and waits.
/// The first exception is rethrown. See setExrThreads().
void forEachOnExrThreads(int count, const std::function<void(int)>& work);

/// Starts a pool of that many threads (0 = the default of setExrThreads(), 1 = none) unless the
/// process has one already, or setExrThreads() or this was called before: the pool is the
/// process's, others may be using it.
void ensureExrThreads(int threads = 0);

}  // namespace vestige
