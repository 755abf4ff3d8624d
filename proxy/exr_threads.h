// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

namespace vestige {

/// Calls work(0) .. work(count - 1), on OpenEXR's global pool when it has threads, and waits.
/// The first exception is rethrown. See setExrThreads().
void forEachOnExrThreads(int count, const std::function<void(int)>& work);

/// Starts the default pool unless setExrThreads() was called or the process already has one.
void ensureExrThreads();

}  // namespace vestige
