// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/run_order.h"

#include <algorithm>

namespace vestige {

void orderByMeanDepth(std::span<RayInterval> ray, std::vector<Piece>& pieces) {
  // Insertion sort: the lists are short, and neighbours in value are often neighbours in depth.
  for (std::size_t i = 1; i < ray.size(); ++i) {
    const RayInterval moving = ray[i];
    std::size_t j = i;
    for (; j > 0 && ray[j - 1].depth > moving.depth; --j) ray[j] = ray[j - 1];
    ray[j] = moving;
  }
  for (const RayInterval& interval : ray) {
    pieces.push_back({interval.channel, interval.length, interval.runs > 1});
  }
}

void orderByRuns(std::span<RayInterval> ray, const IntervalPartition& partition,
                 std::vector<Piece>& pieces) {
  (void)partition;
  orderByMeanDepth(ray, pieces);
}

}  // namespace vestige
