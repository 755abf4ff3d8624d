// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/volume/brick_grid.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "proxy/base/parallel.h"

namespace vestige {
namespace {

constexpr int kCells = BrickGrid::kCells;

/// The samples of brick `b` along an axis of `samples`, [first, end).
std::pair<int, int> samplesOf(int b, int samples) {
  return {b * kCells, std::min(samples, (b + 1) * kCells + 1)};
}

}  // namespace

BrickGrid::BrickGrid(std::array<int, 3> samples) : samples_(samples) {
  for (std::size_t i = 0; i < 3; ++i) {
    size_[i] = samples[i] == 0 ? 0 : std::max(1, (samples[i] - 1 + kCells - 1) / kCells);
  }
  bricks_.assign(at(0, 0, size_[2]), {kInfinity, -kInfinity, false});
}

void BrickGrid::add(int z0, int z1, const float* samples, int threads) {
  const auto [nx, ny, nz] = samples_;
  const int firstLayer = std::max(0, (z0 - 1) / kCells);
  const int layers = std::min(size_[2], (z1 - 1) / kCells + 1) - firstLayer;
  // Every brick is one task's: a row of bricks, whose rows of samples are folded into one first.
  parallelFor(layers * size_[1], threads, [&, nx = nx, ny = ny, nz = nz](int task) {
    const int by = task % size_[1], bz = firstLayer + task / size_[1];
    const auto [y0, y1] = samplesOf(by, ny);
    const auto [zLow, zHigh] = samplesOf(bz, nz);
    const auto count = std::size_t(nx);
    std::vector<float> low(count, kInfinity), high(count, -kInfinity), gap(count, 0.0f);
    for (int z = std::max(z0, zLow); z < std::min(z1, zHigh); ++z) {
      for (int y = y0; y < y1; ++y) {
        const float* row =
            samples + (std::size_t(z - z0) * std::size_t(ny) + std::size_t(y)) * count;
        for (std::size_t x = 0; x < count; ++x) {
          const float v = row[x], none = v - v;  // NaN where there is no data
          low[x] = v + none < low[x] ? v : low[x];
          high[x] = v + none > high[x] ? v : high[x];
          gap[x] += none;
        }
      }
    }
    for (int bx = 0; bx < size_[0]; ++bx) {
      Brick& brick = bricks_[at(bx, by, bz)];
      const auto [x0, x1] = samplesOf(bx, nx);
      for (auto x = std::size_t(x0); x < std::size_t(x1); ++x) {
        brick.low = std::min(brick.low, low[x]);
        brick.high = std::max(brick.high, high[x]);
        brick.gaps = brick.gaps || gap[x] != 0.0f;
      }
    }
  });
}

bool BrickGrid::hasGaps() const {
  return std::any_of(bricks_.begin(), bricks_.end(), [](const Brick& b) { return b.gaps; });
}

std::vector<glm::vec2> BrickGrid::ranges() const {
  std::vector<glm::vec2> ranges;
  for (const Brick& brick : bricks_) ranges.emplace_back(brick.low, brick.high);
  return ranges;
}

bool BrickGrid::nearGaps(int x, int y, int z) const {
  for (int k = std::max(0, z - 1); k < std::min(size_[2], z + 2); ++k) {
    for (int j = std::max(0, y - 1); j < std::min(size_[1], y + 2); ++j) {
      for (int i = std::max(0, x - 1); i < std::min(size_[0], x + 2); ++i) {
        if (bricks_[at(i, j, k)].gaps) return true;
      }
    }
  }
  return false;
}

std::vector<glm::vec4> BrickGrid::texels(std::span<const glm::vec2> edges,
                                         const PreintegratedTable* base) const {
  const bool gaps = hasGaps();
  const auto channelOf = [&](float value) {
    const auto above = std::upper_bound(edges.begin(), edges.end(), value,
                                        [](float v, glm::vec2 edge) { return v < edge.x; });
    return int(above - edges.begin()) - 1;
  };
  const auto transparent = [&](const Brick& brick) {
    return !base || base->transparent(brick.low, brick.high);
  };
  std::vector<glm::vec4> texels;
  texels.reserve(bricks_.size());
  for (int z = 0; z < size_[2]; ++z) {
    for (int y = 0; y < size_[1]; ++y) {
      for (int x = 0; x < size_[0]; ++x) {
        const Brick& brick = bricks_[at(x, y, z)];
        int channel = -1;
        if (brick.low > brick.high) {
          channel = int(edges.size()) - 2;  // no data
        } else if (!(gaps && nearGaps(x, y, z)) && transparent(brick) &&
                   channelOf(brick.low) == channelOf(brick.high)) {
          channel = channelOf(brick.low);
        }
        texels.emplace_back(float(channel), brick.low, brick.high,
                            base && channel >= 0 ? base->integral(brick.low) : 0.0f);
      }
    }
  }
  return texels;
}

}  // namespace vestige
