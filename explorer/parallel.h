// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

namespace vestige {

/// Splits [0, count) into contiguous ranges and runs `work(begin, end)` on each, on as many threads
/// as there are cores; the first exception passes to the caller. Which range runs where does not
/// change results that depend on the index alone.
void parallelRanges(int count, const std::function<void(int begin, int end)>& work);

}  // namespace vestige
