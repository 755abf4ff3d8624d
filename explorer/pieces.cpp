// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/pieces.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <mutex>

#include "explorer/parallel.h"
#include "explorer/run_order.h"

namespace vestige {
namespace {

/// The lists of a range of rows, as one thread builds them.
struct Chunk {
  int firstRow = 0, endRow = 0;
  std::vector<std::uint32_t> entries;
};

/// Builds lists with `fill(pixel, pieces)`, which gets an empty vector, on all cores.
template <typename Fill>
PieceLists buildLists(ImageSize size, double unit, const Fill& fill) {
  PieceLists lists;
  lists.size = size;
  lists.unit = unit;
  lists.first.resize(size.pixels());
  std::vector<Chunk> chunks;
  std::mutex mutex;
  const float scale = float(1.0 / unit);
  parallelRanges(size.height, [&](int begin, int end) {
    Chunk chunk{begin, end, {}};
    chunk.entries.reserve(std::size_t(end - begin) * std::size_t(size.width) * 6);
    std::vector<Piece> pieces;
    for (std::size_t i = std::size_t(begin) * std::size_t(size.width);
         i < std::size_t(end) * std::size_t(size.width); ++i) {
      pieces.clear();
      fill(i, pieces);
      lists.first[i] = pieces.empty() ? PieceLists::kNone : std::uint32_t(chunk.entries.size());
      for (const Piece& piece : pieces) {
        chunk.entries.push_back(halfBits(piece.amount * scale) |
                                std::uint32_t(piece.channel) << 16 |
                                (piece.mixed ? PieceLists::kMixed : 0u) |
                                (piece.ambiguous ? PieceLists::kAmbiguous : 0u));
      }
      if (!pieces.empty()) chunk.entries.back() |= PieceLists::kLast;
    }
    const std::lock_guard lock(mutex);
    chunks.push_back(std::move(chunk));
  });
  std::sort(chunks.begin(), chunks.end(),
            [](const Chunk& a, const Chunk& b) { return a.firstRow < b.firstRow; });
  for (Chunk& chunk : chunks) {
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

}  // namespace

Order resolvedOrder(Order order, ImageSize size) {
  if (order != Order::Auto) return order;
  return size.pixels() <= kRunsPixels ? Order::Runs : Order::Mean;
}

std::uint16_t halfBits(float value) {
  if (!(value > 0.0f)) return 0;
  if (value >= 65504.0f) return 0x7bff;
  if (value < 6.103515625e-5f) return std::uint16_t(std::lround(value * 16777216.0f));
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t rounded = bits + 0xfffu + ((bits >> 13) & 1u);  // to nearest, ties to even
  return std::uint16_t((rounded >> 13) - (112u << 10));
}

float halfValue(std::uint16_t bits) {
  const std::uint32_t exponent = bits >> 10, mantissa = bits & 0x3ffu;
  if (exponent == 0) return float(mantissa) / 16777216.0f;
  return std::bit_cast<float>((exponent + 112u) << 23 | mantissa << 13);
}

std::vector<Piece> PieceLists::at(std::size_t pixel) const {
  std::vector<Piece> pieces;
  if (first[pixel] == kNone) return pieces;
  for (std::size_t i = first[pixel];; ++i) {
    const std::uint32_t entry = entries[i];
    pieces.push_back({int(entry >> 16 & 0xffu),
                      float(halfValue(std::uint16_t(entry & 0xffffu)) * unit),
                      (entry & kAmbiguous) != 0, (entry & kMixed) != 0});
    if (entry & kLast) return pieces;
  }
}

PieceLists piecesFromLength(const LengthPlanes& planes, Order wanted) {
  const Order order = resolvedOrder(wanted, planes.header.size);
  const IntervalPartition& partition = planes.partition();
  const ImageSize size = planes.header.size;
  const Camera& camera = planes.header.camera;
  const bool ends = order == Order::Runs && !planes.first.empty() && !planes.last.empty();
  const bool perspective = camera.projection == Projection::Perspective;
  // In diagonals amounts are between 0 and 1, where a half is precise to 2^-11 of any of them.
  const double diagonal = planes.header.domain.diagonal();
  const double unit = diagonal > 0.0 ? diagonal : 1.0;
  return buildLists(size, unit, [&](std::size_t i, std::vector<Piece>& out) {
    RayInterval ray[IntervalPartition::kMaxIntervals + 3];
    int count = 0;
    for (int k = 0; k < partition.channels(); ++k) {
      // No data is transparent: never a piece, but it takes its place along the ray.
      if (k == partition.noData() && order == Order::Mean) continue;
      const auto c = std::size_t(k);
      if (planes.length[c].empty()) continue;
      const float length = planes.length[c][i];
      if (!(length > 0.0f)) continue;
      const float runs = planes.runs[c].empty() ? 1.0f : planes.runs[c][i];
      const float depth = planes.depth[c].empty() ? 0.0f : planes.depth[c][i];
      ray[count++] = {k, length, depth, std::max(1, int(std::lround(runs)))};
    }
    if (order == Order::Mean) {
      orderByMeanDepth({ray, std::size_t(count)}, out);
      return;
    }
    RayEnds rayEnds;
    if (ends) {
      rayEnds.first = int(planes.first[i]) - 1;
      rayEnds.last = int(planes.last[i]) - 1;
    }
    if (perspective && count > 0) {
      const auto x = double(i % std::size_t(size.width)), y = double(i / std::size_t(size.width));
      rayEnds.depthPerLength = float(camera.rayThrough({x + 0.5, y + 0.5}, size).depthPerLength);
    }
    orderByRuns({ray, std::size_t(count)}, rayEnds, partition, out);
  });
}

std::vector<int> nestedOrder(const IntervalPartition& partition) {
  std::vector<int> order{partition.below()};
  for (int k = 0; k < partition.intervals(); ++k) order.push_back(k);
  order.push_back(partition.above());
  return order;
}

PieceLists piecesFromAttenuation(const AttenuationPlanes& planes, std::span<const int> order) {
  constexpr double kDeepest = 60.0;  // 1 - A below 1e-26 is opaque whatever the factor
  return buildLists(planes.header.size, 1.0, [&](std::size_t i, std::vector<Piece>& out) {
    double left = 1.0;
    for (int k : order) {
      const Plane& plane = planes.attenuation[std::size_t(k)];
      const double a = plane.empty() ? 0.0 : double(plane[i]);
      if (!(a > 0.0) || left <= 0.0) continue;
      const double after = std::max(left - a, 0.0);
      const double depth = after > 0.0 ? std::min(std::log(left / after), kDeepest) : kDeepest;
      out.push_back({k, float(depth), true});
      left = after;
    }
    if (out.size() == 1) out.front().ambiguous = false;
  });
}

}  // namespace vestige
