// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "proxy/format/exr/exr_file.h"
#include "proxy/format/image/proxy_image.h"

namespace vestige {

/// What one slab holds on one ray, in whole levels, of which the ray's stretch in the slab has
/// SlicedStack::levels. Channels are counted by rank (IntervalPartition::rankOf).
struct StackCell {
  std::uint32_t begin = 0;             ///< of its lengths in StackSlab::levels
  std::uint8_t lowest = 0, count = 0;  ///< ranks lowest .. lowest + count - 1, of no data apart
  std::uint8_t noData = 0;             ///< levels without data
  std::uint8_t turns = 0;

  /// Where the ray turns at its lowest and highest rank: 1 + the place of that rank's mean depth in
  /// kTurns equal parts of the slab from its near face; 0 = it does not, the rank is met by a face.
  int low() const { return turns & 15; }
  int high() const { return turns >> 4; }
  void setTurns(int low, int high) { turns = std::uint8_t(low | high << 4); }
};

struct StackSlab {
  std::vector<StackCell> cells;      ///< [pixel], row by row from the top
  std::vector<std::uint8_t> levels;  ///< a cell's add up, with noData, to all levels, or to 0

  std::span<const std::uint8_t> levelsOf(const StackCell& cell) const {
    return {levels.data() + cell.begin, cell.count};
  }
};

/// Sliced opacity lengths (method §5): slab s lies between the planar depths header.slabDepths[s]
/// and [s + 1] of an orthographic view; for every pixel and slab it is known how long the ray is in
/// each channel. A continuous field passes from a rank to its neighbours only; so the ranks at the
/// slabs' faces, and where the ray turns in between, give the order inside a slab.
struct SlicedStack {
  static constexpr int kTurns = 8;
  static constexpr int kMostSlabs = 64;
  static constexpr std::uint8_t kOutside = 255;

  /// 16, 32, 64 or 128: the middles of eighths must be whole levels.
  static bool allowsLevels(int levels) {
    return levels == 16 || levels == 32 || levels == 64 || levels == 128;
  }

  ProxyHeader header;
  int levels = 32;  ///< as allowsLevels() has it
  std::vector<StackSlab> slabs;
  /// [slab + 1][pixel] rank in which the ray passes the face in front of slab s, or enters the
  /// domain behind it; [slabs]: in which it leaves the last one. kOutside: it does neither.
  std::vector<std::vector<std::uint8_t>> faces;
};

/// The file of a stack (proxy_image.h has the table); parts are made one after another. Throws
/// InvalidArgument naming what of the stack makes no sense.
std::vector<std::byte> encodeStack(const SlicedStack& stack);
/// Reads part after part. Throws Format naming file, part, pixel and value where they do not add
/// up, NotFound naming a part that is missing.
SlicedStack readStack(const ExrFile& file);

/// World length of the rays of an orthographic view in each slab of a stack; 0 = the ray misses it.
class SlabChords {
 public:
  /// Uses camera, size, domain and slabDepths.
  explicit SlabChords(const ProxyHeader& header);
  double chord(int slab, std::size_t pixel) const {
    const auto& [enters, leaves] = inDomain_[pixel];
    return std::max(0.0, std::min(leaves, depths_[std::size_t(slab) + 1]) -
                             std::max(enters, depths_[std::size_t(slab)]));
  }
  /// A chord that counts as none: 1e-6 of the thickest slab.
  double least() const;

 private:
  std::vector<double> depths_;
  std::vector<std::pair<double, double>>
      inDomain_;  ///< [pixel] planar depths, enters > leaves: misses
};

}  // namespace vestige
