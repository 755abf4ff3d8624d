// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/volume/look_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>

#include "proxy/base/error.h"
#include "proxy/base/parallel.h"

namespace vestige {
namespace {

std::string text(glm::ivec3 size) {
  return std::to_string(size.x) + " x " + std::to_string(size.y) + " x " + std::to_string(size.z);
}

gl::Texture texture3D(GLenum internalFormat, glm::ivec3 size, GLenum filter) {
  const gl::Functions& gl = gl::functions();
  GLint largest = 0;
  gl.GetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &largest);
  if (std::min({size.x, size.y, size.z}) < 1 || std::max({size.x, size.y, size.z}) > largest) {
    throw Error(ErrorCode::Gl, "a grid of " + text(size) + " cells: this OpenGL has 1 to " +
                                   std::to_string(largest) + " a side");
  }
  gl::Texture texture(GL_TEXTURE_3D);
  texture.bind(0);
  for (const GLenum name : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER}) {
    gl.TexParameteri(GL_TEXTURE_3D, name, GLint(filter));
  }
  for (const GLenum name : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R}) {
    gl.TexParameteri(GL_TEXTURE_3D, name, GL_CLAMP_TO_EDGE);
  }
  gl.TexStorage3D(GL_TEXTURE_3D, 1, internalFormat, size.x, size.y, size.z);
  gl::checkErrors("making a 3-D texture");
  return texture;
}

void uploadSlab(const gl::Texture& texture, glm::ivec3 size, int z, int depth, GLenum format,
                GLenum type, const void* data) {
  const gl::Functions& gl = gl::functions();
  texture.bind(0);
  gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
  gl.TexSubImage3D(GL_TEXTURE_3D, 0, 0, 0, z, size.x, size.y, depth, format, type, data);
  gl::checkErrors("uploading a 3-D texture");
}

/// A half of x in [0, 65504], to nearest. Multiplying by 2^-112 moves the exponent's bias.
inline std::uint16_t halfOf(float x) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(x * 0x1p-112f);
  return std::uint16_t((bits + 0x0fffu + ((bits >> 13) & 1u)) >> 13);
}

/// The mask of a grid of which `hasData(cell)`; none where all cells have.
template <typename HasData>
std::optional<gl::Texture> maskOf(glm::ivec3 size, const HasData& hasData) {
  constexpr std::uint16_t kOne = 0x3c00;
  const std::size_t cells = std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z);
  std::vector<std::uint16_t> mask(cells);
  bool all = true;
  for (std::size_t i = 0; i < cells; ++i) {
    const bool has = hasData(i);
    mask[i] = has ? kOne : 0;
    all = all && has;
  }
  if (all) return std::nullopt;
  gl::Texture texture = texture3D(GL_R16F, size, GL_LINEAR);
  uploadSlab(texture, size, 0, size.z, GL_RED, GL_HALF_FLOAT, mask.data());
  return texture;
}

glm::ivec3 bricksOf(glm::ivec3 size) { return (size + (kBrickCells - 1)) / kBrickCells; }

/// Calls brick(index, x, y, z) for all bricks, shared out among all cores.
template <typename Brick>
void forEachBrick(glm::ivec3 bricks, const Brick& brick) {
  parallelRanges(bricks.z, [&](int begin, int end) {
    for (int z = begin; z < end; ++z) {
      for (int y = 0; y < bricks.y; ++y) {
        for (int x = 0; x < bricks.x; ++x) {
          brick((std::size_t(z) * std::size_t(bricks.y) + std::size_t(y)) * std::size_t(bricks.x) +
                    std::size_t(x),
                glm::ivec3(x, y, z));
        }
      }
    }
  });
}

/// Calls row(first cell) of the `count` cells in x that weigh in a brick: its own and one more on
/// each side.
template <typename Row>
void forBrickRows(glm::ivec3 size, glm::ivec3 brick, const Row& row) {
  const glm::ivec3 low = glm::max(brick * kBrickCells - 1, glm::ivec3(0));
  const glm::ivec3 high = glm::min(brick * kBrickCells + kBrickCells + 1, size);
  for (int z = low.z; z < high.z; ++z) {
    for (int y = low.y; y < high.y; ++y) {
      row((std::size_t(z) * std::size_t(size.y) + std::size_t(y)) * std::size_t(size.x) +
              std::size_t(low.x),
          high.x - low.x);
    }
  }
}

void checkCount(glm::ivec3 size, std::size_t have, std::size_t perCell) {
  const bool positive = std::min({size.x, size.y, size.z}) >= 1;
  const std::size_t need =
      positive ? perCell * std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z) : 0;
  if (!positive || need != have) {
    throw Error(ErrorCode::InvalidArgument, "a grid of " + text(size) + " cells needs " +
                                                std::to_string(need) + " numbers, not " +
                                                std::to_string(have));
  }
}

}  // namespace

LookGrid LookGrid::emptyOptics(glm::ivec3 size, const glm::dmat4& worldFromGrid, double scale,
                               OpticsFormat format) {
  LookGrid grid;
  grid.size = size;
  grid.worldFromGrid = worldFromGrid;
  grid.scale = scale;
  grid.values = texture3D(format == OpticsFormat::Half ? GL_RGBA16F : GL_RGBA8, size, GL_LINEAR);
  grid.bricks = bricksOf(size);
  return grid;
}

LookGrid LookGrid::optics(glm::ivec3 size, const glm::dmat4& worldFromGrid,
                          std::span<const float> rgba, OpticsFormat format) {
  checkCount(size, rgba.size(), 4);
  const std::size_t plane = 4 * std::size_t(size.x) * std::size_t(size.y);
  std::vector<float> greatest(std::size_t(size.z), 0.0f);
  parallelRanges(size.z, [&](int begin, int end) {
    for (int z = begin; z < end; ++z) {
      const float* from = rgba.data() + plane * std::size_t(z);
      float most = 0.0f;
      for (std::size_t i = 0; i < plane; ++i) most = std::max(most, from[i]);
      greatest[std::size_t(z)] = most;
    }
  });
  const float most = *std::max_element(greatest.begin(), greatest.end());
  LookGrid grid = emptyOptics(size, worldFromGrid, most > 0.0f ? double(most) : 1.0, format);
  const float factor = most > 0.0f ? 1.0f / most : 0.0f;
  // Slab by slab, so that the copy stays small.
  const int depth = std::min(size.z, 16);
  std::vector<std::uint16_t> halves(format == OpticsFormat::Half ? plane * std::size_t(depth) : 0);
  std::vector<std::uint8_t> bytes(format == OpticsFormat::Byte ? plane * std::size_t(depth) : 0);
  for (int z = 0; z < size.z; z += depth) {
    const int slab = std::min(depth, size.z - z);
    parallelRanges(slab, [&](int begin, int end) {
      const float* from = rgba.data() + plane * std::size_t(z);
      for (std::size_t i = plane * std::size_t(begin); i < plane * std::size_t(end); ++i) {
        if (format == OpticsFormat::Half) {
          halves[i] = halfOf(from[i] * factor);
        } else {
          bytes[i] = std::uint8_t(from[i] * factor * 255.0f + 0.5f);
        }
      }
    });
    if (format == OpticsFormat::Half) {
      uploadSlab(grid.values, size, z, slab, GL_RGBA, GL_HALF_FLOAT, halves.data());
    } else {
      uploadSlab(grid.values, size, z, slab, GL_RGBA, GL_UNSIGNED_BYTE, bytes.data());
    }
  }
  std::vector<std::uint8_t> occupied(std::size_t(grid.bricks.x) * std::size_t(grid.bricks.y) *
                                     std::size_t(grid.bricks.z));
  forEachBrick(grid.bricks, [&](std::size_t index, glm::ivec3 brick) {
    float any = 0.0f;
    forBrickRows(size, brick, [&](std::size_t first, int count) {
      for (int i = 0; i < count; ++i) any = std::max(any, rgba[4 * (first + std::size_t(i)) + 3]);
    });
    occupied[index] = any > 0.0f;
  });
  grid.setOccupied(occupied);
  return grid;
}

LookGrid LookGrid::scalar(glm::ivec3 size, const glm::dmat4& worldFromGrid,
                          std::span<const float> values, GridAxes axes) {
  checkCount(size, values.size(), 1);
  LookGrid grid;
  grid.content = GridContent::Scalar;
  grid.axes = std::move(axes);
  grid.size = size;
  grid.worldFromGrid = worldFromGrid;
  grid.bricks = bricksOf(size);
  float least = HUGE_VALF, most = -HUGE_VALF;
  for (const float value : values) {
    if (!std::isfinite(value)) continue;
    least = std::min(least, value);
    most = std::max(most, value);
  }
  if (!(least <= most)) least = most = 0.0f;
  // Normalised in double, so that 101325 +- 0.01 survives (method §1).
  grid.valueZero = least;
  grid.valueUnit = most > least ? double(most) - double(least) : 1.0;
  grid.values = texture3D(GL_R32F, size, GL_LINEAR);
  const std::size_t plane = std::size_t(size.x) * std::size_t(size.y);
  std::vector<float> texels(values.size());
  parallelRanges(size.z, [&](int begin, int end) {
    for (std::size_t i = plane * std::size_t(begin); i < plane * std::size_t(end); ++i) {
      texels[i] = std::isfinite(values[i])
                      ? float((double(values[i]) - grid.valueZero) / grid.valueUnit)
                      : 0.0f;
    }
  });
  uploadSlab(grid.values, size, 0, size.z, GL_RED, GL_FLOAT, texels.data());
  grid.mask = maskOf(size, [&](std::size_t i) { return std::isfinite(values[i]); });
  grid.brickRange.resize(std::size_t(grid.bricks.x) * std::size_t(grid.bricks.y) *
                         std::size_t(grid.bricks.z));
  forEachBrick(grid.bricks, [&](std::size_t index, glm::ivec3 brick) {
    glm::vec2 range(HUGE_VALF, -HUGE_VALF);
    forBrickRows(size, brick, [&](std::size_t first, int count) {
      for (int i = 0; i < count; ++i) {
        const float texel = texels[first + std::size_t(i)];
        if (!std::isfinite(values[first + std::size_t(i)])) continue;
        range.x = std::min(range.x, texel);
        range.y = std::max(range.y, texel);
      }
    });
    grid.brickRange[index] = range;
  });
  return grid;
}

LookGrid LookGrid::fields(glm::ivec3 size, const glm::dmat4& worldFromGrid,
                          std::span<const float> values, std::span<const float> gradients,
                          GridAxes axes) {
  checkCount(size, values.size(), 4);
  if (!gradients.empty()) checkCount(size, gradients.size(), 1);
  LookGrid grid;
  grid.content = GridContent::Fields;
  grid.axes = std::move(axes);
  grid.size = size;
  grid.worldFromGrid = worldFromGrid;
  grid.bricks = bricksOf(size);
  std::vector<float> texels(values.begin(), values.end());
  const auto hasData = [&](std::size_t i) { return std::isfinite(values[4 * i]); };
  for (std::size_t i = 0; i < texels.size(); i += 4) {
    if (!hasData(i / 4)) std::fill_n(texels.begin() + std::ptrdiff_t(i), 4, 0.0f);
  }
  grid.mask = maskOf(size, hasData);
  grid.values = texture3D(GL_RGBA32F, size, GL_LINEAR);
  uploadSlab(grid.values, size, 0, size.z, GL_RGBA, GL_FLOAT, texels.data());
  if (!gradients.empty()) {
    // Where a value is missing the gradient is never asked for.
    std::vector<float> norms(gradients.begin(), gradients.end());
    for (float& norm : norms) norm = std::isfinite(norm) ? norm : 0.0f;
    grid.gradients = texture3D(GL_R32F, size, GL_LINEAR);
    uploadSlab(*grid.gradients, size, 0, size.z, GL_RED, GL_FLOAT, norms.data());
  }
  grid.brickBox.resize(std::size_t(grid.bricks.x) * std::size_t(grid.bricks.y) *
                       std::size_t(grid.bricks.z));
  forEachBrick(grid.bricks, [&](std::size_t index, glm::ivec3 brick) {
    std::array<FieldSample, 2> box;
    box[0].values.fill(HUGE_VAL);
    box[1].values.fill(-HUGE_VAL);
    box[0].gradient = HUGE_VAL;
    box[1].gradient = 0.0;
    forBrickRows(size, brick, [&](std::size_t first, int count) {
      for (std::size_t i = first; i < first + std::size_t(count); ++i) {
        if (!hasData(i)) continue;
        for (std::size_t j = 0; j < 4; ++j) {
          box[0].values[j] = std::min(box[0].values[j], double(texels[4 * i + j]));
          box[1].values[j] = std::max(box[1].values[j], double(texels[4 * i + j]));
        }
        if (gradients.empty() || !std::isfinite(gradients[i])) continue;
        box[0].gradient = std::min(box[0].gradient, double(gradients[i]));
        box[1].gradient = std::max(box[1].gradient, double(gradients[i]));
      }
    });
    grid.brickBox[index] = box;
  });
  return grid;
}

void LookGrid::setGuess(glm::ivec3 guessSize, std::span<const std::uint8_t> share) {
  checkCount(guessSize, share.size(), 1);
  guess = texture3D(GL_R8, guessSize, GL_LINEAR);
  uploadSlab(*guess, guessSize, 0, guessSize.z, GL_RED, GL_UNSIGNED_BYTE, share.data());
}

void LookGrid::setWrong(std::span<const std::uint8_t> far, double unit) {
  checkCount(size, far.size(), 1);
  wrong = texture3D(GL_R8, size, GL_LINEAR);
  uploadSlab(*wrong, size, 0, size.z, GL_RED, GL_UNSIGNED_BYTE, far.data());
  wrongUnit = 255.0 * unit;
}

void LookGrid::setWrong(double texels) {
  constexpr std::uint8_t kAll = 255;
  wrong = texture3D(GL_R8, glm::ivec3(1), GL_LINEAR);
  uploadSlab(*wrong, glm::ivec3(1), 0, 1, GL_RED, GL_UNSIGNED_BYTE, &kAll);
  wrongUnit = texels;
}

void LookGrid::setOccupied(std::span<const std::uint8_t> occupied) {
  const std::size_t count = std::size_t(bricks.x) * std::size_t(bricks.y) * std::size_t(bricks.z);
  if (occupied.size() != count) {
    throw Error(ErrorCode::InvalidArgument, "a grid of " + text(bricks) + " bricks cannot take " +
                                                std::to_string(occupied.size()));
  }
  // Distances by the greatest axis to the nearest brick with something: two sweeps (chamfer), exact
  // for this metric. Outside of the grid there is nothing.
  std::vector<std::uint8_t> leap(count);
  for (std::size_t i = 0; i < count; ++i) leap[i] = occupied[i] ? 0 : 255;
  const auto sweep = [&](int way) {
    const glm::ivec3 last = bricks - 1;
    for (int kz = 0; kz < bricks.z; ++kz) {
      for (int ky = 0; ky < bricks.y; ++ky) {
        for (int kx = 0; kx < bricks.x; ++kx) {
          const glm::ivec3 at = way > 0 ? glm::ivec3(kx, ky, kz) : last - glm::ivec3(kx, ky, kz);
          std::uint8_t& here =
              leap[(std::size_t(at.z) * std::size_t(bricks.y) + std::size_t(at.y)) *
                       std::size_t(bricks.x) +
                   std::size_t(at.x)];
          if (here == 0) continue;
          int nearest = here;
          // The 13 neighbours that this sweep has passed.
          for (int n = 0; n < 13; ++n) {
            const glm::ivec3 to = at + way * (glm::ivec3(n % 3, n / 3 % 3, n / 9) - 1);
            if (glm::any(glm::lessThan(to, glm::ivec3(0))) ||
                glm::any(glm::greaterThanEqual(to, bricks))) {
              continue;
            }
            nearest = std::min(
                nearest, 1 + leap[(std::size_t(to.z) * std::size_t(bricks.y) + std::size_t(to.y)) *
                                      std::size_t(bricks.x) +
                                  std::size_t(to.x)]);
          }
          here = std::uint8_t(std::min(nearest, 255));
        }
      }
    }
  };
  sweep(1);
  sweep(-1);
  leaps = texture3D(GL_R8UI, bricks, GL_NEAREST);
  uploadSlab(leaps, bricks, 0, bricks.z, GL_RED_INTEGER, GL_UNSIGNED_BYTE, leap.data());
}

OpticsTable::OpticsTable(const Optics& optics, double low, double high)
    : low_(low),
      high_(high > low ? high : low + std::max(1.0, std::abs(low))),
      occupied_(std::size_t(kEntries) + 1, 0),
      texture_(GL_TEXTURE_2D) {
  std::vector<glm::vec4> texels(2 * std::size_t(kEntries));
  glm::dvec4 integral(0.0);
  constexpr int kSamples = 4;
  for (int i = 0; i < kEntries; ++i) {
    glm::dvec4 mean(0.0);
    for (int j = 0; j < kSamples; ++j) {
      const double share = (i + (j + 0.5) / kSamples) / kEntries;
      mean += optics(low_ + share * (high_ - low_)) / double(kSamples);
    }
    texels[std::size_t(i)] = glm::vec4(integral);
    texels[std::size_t(kEntries + i)] = glm::vec4(mean);
    integral += mean;
    occupied_[std::size_t(i) + 1] = occupied_[std::size_t(i)] + (mean.a > 0.0);
  }
  texture_ = gpu::texture2D(GL_RGBA32F, {kEntries, 2}, GL_RGBA, GL_FLOAT, texels.data());
}

bool OpticsTable::transparent(double first, double last) const {
  const auto entry = [&](double value) {
    return std::clamp((value - low_) / (high_ - low_) * kEntries, 0.0, double(kEntries));
  };
  // One entry more on each side: the shader's arithmetic is single.
  const int from = std::clamp(int(entry(first)) - 1, 0, kEntries);
  const int to = std::clamp(int(entry(last)) + 2, 0, kEntries);
  return occupied_[std::size_t(to)] == occupied_[std::size_t(from)];
}

}  // namespace vestige
