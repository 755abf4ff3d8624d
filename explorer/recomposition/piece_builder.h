// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

#include "explorer/recomposition/pieces.h"
#include "proxy/base/parallel.h"

namespace vestige {

/// The lists of a range of rows, as one thread builds them.
struct PieceChunk {
  int firstRow = 0, endRow = 0;
  std::vector<std::uint32_t> entries;
};

/// Builds lists with `fill(pixel, pieces)`, which gets an empty vector, on all cores. Each thread
/// has a copy of `fill` and asks for its pixels in order.
template <typename Fill>
PieceLists buildPieceLists(ImageSize size, double unit, const Fill& fill) {
  PieceLists lists;
  lists.size = size;
  lists.unit = unit;
  lists.first.resize(size.pixels());
  std::vector<PieceChunk> chunks;
  std::mutex mutex;
  const float scale = float(1.0 / unit);
  parallelRanges(size.height, [&](int begin, int end) {
    Fill mine = fill;
    PieceChunk chunk{begin, end, {}};
    chunk.entries.reserve(std::size_t(end - begin) * std::size_t(size.width) * 6);
    std::vector<Piece> pieces;
    for (std::size_t i = std::size_t(begin) * std::size_t(size.width);
         i < std::size_t(end) * std::size_t(size.width); ++i) {
      pieces.clear();
      mine(i, pieces);
      const std::size_t start = chunk.entries.size();
      lists.first[i] = pieces.empty() ? PieceLists::kNone : std::uint32_t(start);
      if (pieces.empty()) continue;
      chunk.entries.resize(start + pieces.size());
      std::uint32_t* entry = chunk.entries.data() + start;
      for (const Piece& piece : pieces) {
        *entry++ = amountBits(piece.amount * scale) | std::uint32_t(piece.channel) << 16 |
                   (piece.mixed ? PieceLists::kMixed : 0u) |
                   (piece.ambiguous ? PieceLists::kAmbiguous : 0u);
      }
      entry[-1] |= PieceLists::kLast;
    }
    const std::lock_guard lock(mutex);
    chunks.push_back(std::move(chunk));
  });
  std::sort(chunks.begin(), chunks.end(),
            [](const PieceChunk& a, const PieceChunk& b) { return a.firstRow < b.firstRow; });
  for (PieceChunk& chunk : chunks) {
    const auto offset = std::uint32_t(lists.entries.size());
    if (offset == 0) {
      lists.entries = std::move(chunk.entries);
      continue;
    }
    for (std::size_t i = std::size_t(chunk.firstRow) * std::size_t(size.width);
         i < std::size_t(chunk.endRow) * std::size_t(size.width); ++i) {
      if (lists.first[i] != PieceLists::kNone) lists.first[i] += offset;
    }
    lists.entries.insert(lists.entries.end(), chunk.entries.begin(), chunk.entries.end());
  }
  return lists;
}

}  // namespace vestige
