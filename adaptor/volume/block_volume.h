// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "adaptor/volume/brick_grid.h"
#include "adaptor/volume/march_setup.h"
#include "adaptor/compositing/march_types.h"
#include "proxy/gl/objects.h"

namespace vestige {

/// Texture units of the march.
enum MarchUnit { kVolumeUnit, kBricksUnit, kBaseUnit, kBaseColorUnit, kNodesUnit };  // + axis

/// A table of texels that shaders read by index, for as long as it lives.
class BufferTable {
 public:
  BufferTable(int unit, const std::vector<glm::vec4>& texels);

 private:
  gl::Buffer buffer_;
  gl::Texture texture_{GL_TEXTURE_BUFFER};
};

/// A 2-D table of texels, `width` a row.
gl::Texture makeTable(int unit, int width, const std::vector<glm::vec4>& texels);

/// The samples of one block as a texture, and their bricks. On the device's thread only.
class BlockVolume {
 public:
  /// Replaces the block; adds the seconds. Throws Gl when it has more than `most` samples a side
  /// or does not fit, and passes on what `fill` throws; there is no block then.
  void upload(const BlockGrid& grid, const FillSlab& fill, int most, int threads,
              MarchTimes& times);
  void clear();

  const BlockGrid& grid() const { return grid_; }
  bool hasGaps() const { return hasGaps_; }
  const BrickGrid& bricks() const { return bricks_; }
  void bind(int unit = kVolumeUnit) const;

 private:
  void allocate(std::array<int, 3> size, int most);
  void fillTexture(const FillSlab& fill, int threads, MarchTimes& times);

  BlockGrid grid_;
  BrickGrid bricks_;
  bool hasGaps_ = false;
  std::array<int, 3> size_{0, 0, 0};
  std::optional<gl::Texture> texture_;
};

/// The bricks of a block as march.glsl reads them, for as long as it lives.
class BrickTexture {
 public:
  BrickTexture(const BrickGrid& bricks, const std::vector<glm::vec4>& texels);

 private:
  gl::Texture texture_{GL_TEXTURE_3D};
};

}  // namespace vestige
