// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "proxy/format/layout/sliced_stack.h"

namespace vestige {

/// For every pixel of a stack the runs of its ray, front to back: stretches inside one channel, as
/// SlabPath finds them in each slab, joined across slabs. Those of pixel i are [first[i],
/// first[i + 1]).
struct RunLists {
  static constexpr std::uint8_t kUncertain = 128;

  ImageSize size;
  std::vector<std::uint32_t> first;  ///< [pixel + 1]
  std::vector<float> length;         ///< world
  std::vector<std::uint8_t> mark;    ///< rank | kUncertain where a slab's order does not follow
  std::vector<float> enter;          ///< [pixel] planar depth of the first run, from slabDepths[0]

  int rankAt(std::size_t run) const { return mark[run] & (kUncertain - 1); }
  bool uncertainAt(std::size_t run) const { return (mark[run] & kUncertain) != 0; }
};

/// Which way slabs whose order does not follow from their faces are passed: reversed is as far from
/// the likely order as an order can be, and shows what depends on it.
enum class Uncertain { Likely, Reversed };

/// All runs of a stack, on all cores.
RunLists runsOfStack(const SlicedStack& stack, Uncertain way = Uncertain::Likely);

}  // namespace vestige
