// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/stacks/stack_runs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>

#include "explorer/stacks/slab_path.h"
#include "proxy/base/parallel.h"

namespace vestige {
namespace {

/// Planar depths at which rays of an orthographic view enter and leave the domain.
class DomainSpan {
 public:
  explicit DomainSpan(const ProxyHeader& header) {
    const Camera& camera = header.camera;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int a = int(axis);
      const Ray corner = camera.rayThrough({0.5, 0.5}, header.size);
      const Ray right = camera.rayThrough({1.5, 0.5}, header.size);
      const Ray down = camera.rayThrough({0.5, 1.5}, header.size);
      origin_[axis] = corner.origin[a];
      perX_[axis] = right.origin[a] - corner.origin[a];
      perY_[axis] = down.origin[a] - corner.origin[a];
      way_[axis] = corner.direction[a];
      low_[axis] = header.domain.low[a];
      high_[axis] = header.domain.high[a];
    }
  }

  /// As SlabChords cuts them: orthographic rays start on the camera plane.
  std::array<double, 2> at(int x, int y) const {
    double from = -HUGE_VAL, to = HUGE_VAL;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (std::abs(way_[axis]) < 1e-12) continue;  // whether it misses is for the cells to say
      const double o = origin_[axis] + x * perX_[axis] + y * perY_[axis];
      const double a = (low_[axis] - o) / way_[axis], b = (high_[axis] - o) / way_[axis];
      from = std::max(from, std::min(a, b));
      to = std::min(to, std::max(a, b));
    }
    return {from, to};
  }

 private:
  std::array<double, 3> origin_{}, perX_{}, perY_{}, way_{}, low_{}, high_{};
};

struct Chunk {
  int firstRow = 0, endRow = 0;
  std::vector<float> length;
  std::vector<std::uint8_t> mark;
};

}  // namespace

RunLists runsOfStack(const SlicedStack& stack, Uncertain way) {
  const ImageSize size = stack.header.size;
  const int noData = stack.header.partition->rankOf(stack.header.partition->noData());
  const std::size_t slabs = stack.slabs.size();
  const std::vector<double>& depths = stack.header.slabDepths;
  const DomainSpan domain(stack.header);
  RunLists lists;
  lists.size = size;
  lists.first.resize(size.pixels() + 1);
  lists.enter.resize(size.pixels());
  std::vector<Chunk> chunks;
  std::mutex mutex;
  parallelRanges(size.height, [&](int begin, int end) {
    Chunk chunk{begin, end, {}, {}};
    const auto pixels = std::size_t(end - begin) * std::size_t(size.width);
    chunk.length.reserve(pixels * slabs);
    chunk.mark.reserve(pixels * slabs);
    SlabPath path;
    std::size_t i = std::size_t(begin) * std::size_t(size.width);
    for (int y = begin; y < end; ++y) {
      for (int x = 0; x < size.width; ++x, ++i) {
        const auto [enter, leave] = domain.at(x, y);
        const std::size_t start = chunk.length.size();
        double entered = depths[0];
        for (std::size_t s = 0; s < slabs; ++s) {
          const StackCell& cell = stack.slabs[s].cells[i];
          if (cell.count == 0 && cell.noData == 0) continue;
          const double from = std::max(depths[s], enter), to = std::min(depths[s + 1], leave);
          const double chord = std::max(to - from, 0.0);
          if (chunk.length.size() == start) entered = from;
          const float unit = float(chord / stack.levels);
          path.follow(stack.slabs[s], cell, stack.faces[s][i], stack.faces[s + 1][i], noData,
                      stack.levels);
          const bool uncertain = !path.certain();
          const bool reversed = uncertain && way == Uncertain::Reversed;
          const auto visits = path.visits();
          for (std::size_t v = 0; v < visits.size(); ++v) {
            const Visit& visit = visits[reversed ? visits.size() - 1 - v : v];
            const auto mark = std::uint8_t(visit.rank | (uncertain ? RunLists::kUncertain : 0));
            const float length = visit.levels * unit;
            if (chunk.length.size() > start &&
                ((chunk.mark.back() ^ mark) & (RunLists::kUncertain - 1)) == 0) {
              chunk.length.back() += length;
              chunk.mark.back() |= mark;
              continue;
            }
            chunk.length.push_back(length);
            chunk.mark.push_back(mark);
          }
        }
        lists.enter[i] = float(entered - depths[0]);
        lists.first[i] = std::uint32_t(chunk.length.size());  // the end, for now
      }
    }
    const std::lock_guard lock(mutex);
    chunks.push_back(std::move(chunk));
  });
  std::sort(chunks.begin(), chunks.end(),
            [](const Chunk& a, const Chunk& b) { return a.firstRow < b.firstRow; });
  std::size_t total = 0;
  for (const Chunk& chunk : chunks) total += chunk.length.size();
  lists.length.reserve(total);
  lists.mark.reserve(total);
  for (const Chunk& chunk : chunks) {
    const auto offset = std::uint32_t(lists.length.size());
    for (std::size_t i = std::size_t(chunk.firstRow) * std::size_t(size.width);
         i < std::size_t(chunk.endRow) * std::size_t(size.width); ++i) {
      lists.first[i] += offset;
    }
    lists.length.insert(lists.length.end(), chunk.length.begin(), chunk.length.end());
    lists.mark.insert(lists.mark.end(), chunk.mark.begin(), chunk.mark.end());
  }
  // Ends to beginnings.
  std::copy_backward(lists.first.begin(), lists.first.end() - 1, lists.first.end());
  lists.first[0] = 0;
  return lists;
}

}  // namespace vestige
