// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "adaptor/volume/march_setup.h"

namespace vestige {

/// The least and largest sample of every brick of a block: what lets a march skip space in
/// which nothing happens. A brick is kCells cells a side; samples on a face belong to both sides.
class BrickGrid {
 public:
  static constexpr int kCells = 8;

  /// For a block of so many samples an axis (x, y, z); none is taken in yet.
  explicit BrickGrid(std::array<int, 3> samples = {0, 0, 0});
  /// Takes in samples [z0, z1) x all y x all x (x fastest); no data = NaN or infinity.
  void add(int z0, int z1, const float* samples, int threads);

  /// Bricks per axis.
  std::array<int, 3> size() const { return size_; }
  bool hasGaps() const;
  /// Of every brick, x fastest: its least and largest sample with data; the first is larger where
  /// there is none.
  std::vector<glm::vec2> ranges() const;

  /// What march.glsl asks of a brick: (channel, least, largest value, integral of the base function
  /// up to the least or 0). The channel is the one that every sample in the brick is in, by `edges`
  /// (channelEdges()); negative where there are several, where a sample without data is near, or
  /// where `base` is given and not transparent throughout. A brick all without data has an empty
  /// range, +infinity to -infinity.
  std::vector<glm::vec4> texels(std::span<const glm::vec2> edges,
                                const PreintegratedTable* base) const;

 private:
  struct Brick {
    float low, high;
    bool gaps;
  };
  std::size_t at(int x, int y, int z) const {
    return (std::size_t(z) * std::size_t(size_[1]) + std::size_t(y)) * std::size_t(size_[0]) +
           std::size_t(x);
  }
  bool nearGaps(int x, int y, int z) const;

  std::array<int, 3> samples_, size_;
  std::vector<Brick> bricks_;
};

}  // namespace vestige
