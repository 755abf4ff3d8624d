// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

namespace vestige {

/// Calls work(i) for every i in [0, tasks), on up to `threads` threads (0: as many as there are
/// cores), the caller's among them. The order is not defined; the first exception is rethrown here
/// after all have stopped. Threads inherit the caller's floating-point environment, affinity and
/// signal mask.
void parallelFor(int tasks, int threads, const std::function<void(int)>& work);

/// Splits [0, count) into one contiguous range a core and calls work(begin, end) on each, likewise.
void parallelRanges(int count, const std::function<void(int begin, int end)>& work);

}  // namespace vestige
