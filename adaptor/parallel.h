// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

namespace vestige {

/// Calls work(i) for every i in [0, tasks), on up to `threads` threads, the caller's among them.
/// The order is not defined; the first exception is rethrown here after all have stopped. Threads
/// inherit the caller's floating-point environment, affinity and signal mask.
void parallelFor(int tasks, int threads, const std::function<void(int)>& work);

}  // namespace vestige
