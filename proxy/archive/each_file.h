// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

namespace vestige {

/// Runs work(i) for each i in [0, count) on as many threads as there are cores, 8 at most: files
/// are read one a thread. `progress(done, count)` may be empty; one call at a time, by any thread.
/// The first exception passes to the caller.
void forEachFile(int count, const std::function<void(int)>& work,
                 const std::function<void(int, int)>& progress);

}  // namespace vestige
