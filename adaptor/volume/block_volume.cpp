// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/volume/block_volume.h"

#include <algorithm>
#include <string>
#include <utility>

#include "adaptor/common/stopwatch.h"
#include "proxy/base/error.h"
#include "proxy/gl/functions.h"

namespace vestige {
namespace {

constexpr std::size_t kStagingBytes = 8u << 20;  ///< of a slab on its way to the texture

/// Texels are read as they are: what lies between samples is the shader's to interpolate.
void setNearest(GLenum target) {
  const gl::Functions& f = gl::functions();
  f.TexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  f.TexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  for (GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R}) {
    f.TexParameteri(target, wrap, GL_CLAMP_TO_EDGE);
  }
}

}  // namespace

BufferTable::BufferTable(int unit, const std::vector<glm::vec4>& texels) {
  const gl::Functions& f = gl::functions();
  f.BindBuffer(GL_TEXTURE_BUFFER, buffer_.id());
  f.BufferData(GL_TEXTURE_BUFFER, GLsizeiptr(texels.size() * sizeof(glm::vec4)), texels.data(),
               GL_STREAM_DRAW);
  texture_.bind(unit);
  f.TexBuffer(GL_TEXTURE_BUFFER, GL_RGBA32F, buffer_.id());
}

gl::Texture makeTable(int unit, int width, const std::vector<glm::vec4>& texels) {
  const gl::Functions& f = gl::functions();
  gl::Texture table(GL_TEXTURE_2D);
  table.bind(unit);
  const int height = int(texels.size()) / width;
  f.TexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA32F, width, height);
  setNearest(GL_TEXTURE_2D);
  f.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, GL_RGBA, GL_FLOAT, texels.data());
  return table;
}

BrickTexture::BrickTexture(const BrickGrid& bricks, const std::vector<glm::vec4>& texels) {
  const gl::Functions& f = gl::functions();
  const auto [x, y, z] = bricks.size();
  texture_.bind(kBricksUnit);
  f.TexStorage3D(GL_TEXTURE_3D, 1, GL_RGBA32F, x, y, z);
  setNearest(GL_TEXTURE_3D);
  f.TexSubImage3D(GL_TEXTURE_3D, 0, 0, 0, 0, x, y, z, GL_RGBA, GL_FLOAT, texels.data());
}

void BlockVolume::upload(const BlockGrid& grid, const FillSlab& fill, int most, int threads,
                         MarchTimes& times) {
  grid_ = BlockGrid{};
  if (!grid.empty()) {
    const Stopwatch watch;
    allocate(grid.size(), most);
    times.upload += watch.seconds();
    fillTexture(fill, threads, times);
  }
  grid_ = grid;
}

void BlockVolume::clear() { *this = BlockVolume(); }

void BlockVolume::bind(int unit) const { texture_->bind(unit); }

void BlockVolume::allocate(std::array<int, 3> size, int most) {
  if (std::max({size[0], size[1], size[2]}) > most) {
    throw Error(ErrorCode::Gl, "a block of " + std::to_string(size[0]) + " x " +
                                   std::to_string(size[1]) + " x " + std::to_string(size[2]) +
                                   " samples does not fit: OpenGL takes " + std::to_string(most) +
                                   " a side; publish it as several blocks");
  }
  if (texture_ && size == size_) return;
  const gl::Functions& f = gl::functions();
  texture_.reset();
  texture_.emplace(GL_TEXTURE_2D_ARRAY);
  bind();
  f.TexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_R32F, size[0], size[1], size[2]);
  setNearest(GL_TEXTURE_2D_ARRAY);
  try {
    gl::checkErrors("the allocation of a block's texture");
  } catch (...) {
    texture_.reset();
    throw;
  }
  size_ = size;
}

void BlockVolume::fillTexture(const FillSlab& fill, int threads, MarchTimes& times) {
  const gl::Functions& f = gl::functions();
  const auto [nx, ny, nz] = size_;
  const std::size_t layer = std::size_t(nx) * std::size_t(ny);
  const int depth =
      int(std::clamp<std::size_t>(kStagingBytes / (layer * sizeof(float)), 1, std::size_t(nz)));
  std::vector<float> staging(layer * std::size_t(depth));
  BrickGrid bricks(size_);
  bind();
  f.PixelStorei(GL_UNPACK_ALIGNMENT, 4);
  for (int z = 0; z < nz; z += depth) {
    const int end = std::min(nz, z + depth);
    const Stopwatch filling;
    fill(z, end, staging.data());
    bricks.add(z, end, staging.data(), threads);
    times.fill += filling.seconds();
    const Stopwatch uploading;
    f.TexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, z, nx, ny, end - z, GL_RED, GL_FLOAT,
                    staging.data());
    times.upload += uploading.seconds();
  }
  gl::checkErrors("the upload of a block");
  hasGaps_ = bricks.hasGaps();
  bricks_ = std::move(bricks);
}

}  // namespace vestige
