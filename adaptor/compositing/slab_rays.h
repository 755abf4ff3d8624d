// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "proxy/format/layout/sliced_stack.h"

namespace vestige {

/// What one slab holds on one ray, as it was marched (method §5). Channels by rank
/// (IntervalPartition::rankOf).
struct SlabCell {
  static constexpr std::uint8_t kNone = 255;
  std::uint32_t begin = 0;       ///< of its lengths in SlabRays::lengths
  std::uint8_t lowest = kNone;   ///< ranks that have a length, of no data apart;
  std::uint8_t highest = kNone;  ///< kNone: none has
  std::uint8_t first = kNone;    ///< rank in which the ray enters the slab's part of the block,
  std::uint8_t last = kNone;     ///< and leaves it; kNone: it misses
  float noData = 0.0f;           ///< world length without data
  float lowMoment = 0.0f;        ///< ∫ Z ds over `lowest`,
  float highMoment = 0.0f;       ///< over `highest`; world units
};

/// One slab of all rays of a view, in world units; sparse.
struct SlabRays {
  std::vector<SlabCell> cells;  ///< [pixel], row by row from the top
  std::vector<float> lengths;   ///< of each cell's ranks lowest .. highest

  std::span<const float> lengthsOf(const SlabCell& cell) const {
    if (cell.lowest == SlabCell::kNone) return {};
    return {lengths.data() + cell.begin, std::size_t(cell.highest - cell.lowest) + 1};
  }
};

/// Receives the slabs of a march, nearest first.
using TakeSlab = std::function<void(int slab, SlabRays rays)>;

/// `front` over `back`, parts of the same slab, `front` nearer to the viewer on every ray: lengths
/// and moments add (method §5). Associative.
void compositeSlabs(SlabRays& front, const SlabRays& back);

/// Rounds slabs to levels, one after another, so that but one need be held as it was marched. The
/// levels of a cell add up exactly (largest remainders); what of a ray's way through the domain no
/// block covers is without data.
class StackBuilder {
 public:
  /// header: camera, size, domain, partition and slabDepths. Throws InvalidArgument naming what
  /// makes no sense: perspective cameras, slabs other than 1 .. SlicedStack::kMostSlabs, levels.
  StackBuilder(ProxyHeader header, int levels);
  /// The next slab, nearest first. Throws InvalidArgument for one too many or of another size.
  void add(const SlabRays& rays);
  /// Throws InvalidArgument while slabs are missing.
  SlicedStack take();

 private:
  SlicedStack stack_;
  std::optional<SlabChords> chords_;
};

}  // namespace vestige
