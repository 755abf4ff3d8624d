// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

#include "explorer/recomposition/segments.h"
#include "proxy/base/parallel.h"

namespace vestige {

/// The lists of a range of rows, as one thread builds them.
struct SegmentChunk {
  int firstRow = 0, endRow = 0;
  std::vector<std::uint32_t> entries;
};

/// Builds lists with `fill(pixel, segments)`, which gets an empty vector, on all cores. Each thread
/// has a copy of `fill` and asks for its pixels in order.
template <typename Fill>
SegmentLists buildSegmentLists(ImageSize size, double unit, const Fill& fill) {
  SegmentLists lists;
  lists.size = size;
  lists.unit = unit;
  lists.first.resize(size.pixels());
  std::vector<SegmentChunk> chunks;
  std::mutex mutex;
  const float scale = float(1.0 / unit);
  parallelRanges(size.height, [&](int begin, int end) {
    Fill mine = fill;
    SegmentChunk chunk{begin, end, {}};
    chunk.entries.reserve(std::size_t(end - begin) * std::size_t(size.width) * 6);
    std::vector<Segment> segments;
    for (std::size_t i = std::size_t(begin) * std::size_t(size.width);
         i < std::size_t(end) * std::size_t(size.width); ++i) {
      segments.clear();
      mine(i, segments);
      const std::size_t start = chunk.entries.size();
      lists.first[i] = segments.empty() ? SegmentLists::kNone : std::uint32_t(start);
      if (segments.empty()) continue;
      chunk.entries.resize(start + segments.size());
      std::uint32_t* entry = chunk.entries.data() + start;
      for (const Segment& segment : segments) {
        *entry++ = amountBits(segment.amount * scale) | std::uint32_t(segment.channel) << 16 |
                   (segment.mixed ? SegmentLists::kMixed : 0u) |
                   (segment.ambiguous ? SegmentLists::kAmbiguous : 0u);
      }
      entry[-1] |= SegmentLists::kLast;
    }
    const std::lock_guard lock(mutex);
    chunks.push_back(std::move(chunk));
  });
  std::sort(chunks.begin(), chunks.end(),
            [](const SegmentChunk& a, const SegmentChunk& b) { return a.firstRow < b.firstRow; });
  for (SegmentChunk& chunk : chunks) {
    const auto offset = std::uint32_t(lists.entries.size());
    if (offset == 0) {
      lists.entries = std::move(chunk.entries);
      continue;
    }
    for (std::size_t i = std::size_t(chunk.firstRow) * std::size_t(size.width);
         i < std::size_t(chunk.endRow) * std::size_t(size.width); ++i) {
      if (lists.first[i] != SegmentLists::kNone) lists.first[i] += offset;
    }
    lists.entries.insert(lists.entries.end(), chunk.entries.begin(), chunk.entries.end());
  }
  return lists;
}

}  // namespace vestige
