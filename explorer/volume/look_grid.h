// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <functional>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <optional>
#include <span>
#include <vector>

#include "explorer/gpu/gpu.h"
#include "explorer/volume/grid_axes.h"
#include "proxy/classifier/classifier.h"

namespace vestige {

/// Optics: texels are (σ·c, σ) / scale of the current look. Scalar: texels are values, classified
/// after interpolation by an OpticsTable. Fields: texels are up to four values, classified after
/// interpolation by a Classifier.
enum class GridContent { Optics, Scalar, Fields };

/// How optics are stored. Half: 11 bits of each texel's own magnitude. Byte: 8 bits of `scale`.
enum class OpticsFormat { Half, Byte };

/// Cells a side of a brick of the grid that says where nothing is to be seen.
inline constexpr int kBrickCells = 8;

/// A 3-D grid that VolumePass draws. Cell i, j, k of `size` has its centre at
/// (i + 1/2, j + 1/2, k + 1/2) / size in grid coordinates, x fastest; `worldFromGrid` takes
/// [0, 1]^3 to world: any invertible affine map, so cells may be stretched, axes permuted or
/// mirrored; along axes that GridAxes says are uneven, centres are where it says. The medium fills
/// [low, high] of grid coordinates: for a field on points, whose domain ends at its outermost
/// samples, half a cell less on each side. Made, used and destroyed in Device::run.
struct LookGrid {
  GridContent content = GridContent::Optics;
  glm::ivec3 size{0};
  glm::dmat4 worldFromGrid{1.0};
  glm::dvec3 low{0.0}, high{1.0};
  gl::Texture values{GL_TEXTURE_3D};  ///< 3-D, filtered: RGBA16F or RGBA8, R32F for scalars
  /// R16F, 3-D, filtered: 1 where a cell has data, 0 where it has none, and its texel of `values`
  /// is 0; none: all cells have. Cells with data weigh by their shares, there is no data where the
  /// nearest cell has none (method §1).
  std::optional<gl::Texture> mask;
  GridAxes axes;
  double scale = 1.0;      ///< optics: extinction of a texel of 1, 1 / world unit
  double valueUnit = 1.0;  ///< scalar: value = texel * unit + zero
  double valueZero = 0.0;
  /// Scalar: R8, 3-D, filtered: how far each value may be wrong, 1 = `wrongUnit` texels.
  std::optional<gl::Texture> wrong;
  double wrongUnit = 0.0;
  std::optional<gl::Texture> guess;  ///< R8, 3-D, filtered, any size: share of guess of a cell
  /// RGBA16F, 3-D, filtered, VolumePass::findGradients: the slope a cell along each axis, and its
  /// length.
  std::optional<gl::Texture> gradient;
  /// R8UI, one texel a brick: 0 = has something to show; n = so many bricks around it, itself
  /// counted as the first, have nothing, in every direction.
  gl::Texture leaps{GL_TEXTURE_3D};
  glm::ivec3 bricks{0};
  std::vector<glm::vec2> brickRange;     ///< scalar: [brick] least and greatest texel that weighs
  std::optional<gl::Texture> gradients;  ///< fields: R32F, 3-D, filtered: FieldSample::gradient
  /// Fields: [brick] the corners of the box of samples that weigh in it; empty: low > high.
  std::vector<std::array<FieldSample, 2>> brickBox;

  /// Uploads (σ·c, σ) of each cell in 1 / world unit, 4 floats a cell, all finite and >= 0. Throws
  /// InvalidArgument for sizes that do not fit, Gl for grids that OpenGL cannot hold.
  static LookGrid optics(glm::ivec3 size, const glm::dmat4& worldFromGrid,
                         std::span<const float> rgba, OpticsFormat format = OpticsFormat::Half);
  /// Optics to be filled by the caller: a pass that draws into layers of `values` (RGBA16F, or
  /// RGBA8) what is (σ·c, σ) / scale. Call VolumePass::findBricks when they are.
  static LookGrid emptyOptics(glm::ivec3 size, const glm::dmat4& worldFromGrid, double scale,
                              OpticsFormat format = OpticsFormat::Half);
  /// Uploads values; what is not finite is no data.
  static LookGrid scalar(glm::ivec3 size, const glm::dmat4& worldFromGrid,
                         std::span<const float> values, GridAxes axes = {});

  /// Uploads four normalised values a cell, of which the first is not finite in a cell without
  /// data, and one gradient norm a cell, or none at all.
  static LookGrid fields(glm::ivec3 size, const glm::dmat4& worldFromGrid,
                         std::span<const float> values, std::span<const float> gradients,
                         GridAxes axes = {});

  /// Uploads how far each value may be wrong, in `unit` texels.
  void setWrong(std::span<const std::uint8_t> wrong, double unit);
  /// The same for each: so many texels.
  void setWrong(double texels);
  /// Uploads which share of each cell is a guess, 255 = all of it; `guessSize` may be coarser.
  void setGuess(glm::ivec3 guessSize, std::span<const std::uint8_t> share);
  /// Rebuilds `leaps` from which bricks show something.
  void setOccupied(std::span<const std::uint8_t> occupied);
  std::size_t cells() const {
    return std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z);
  }
};

/// Optics of values for scalar grids: kEntries equal cells over the grid's range, each with its
/// mean and the integral up to it, so that a stretch of field is integrated exactly for that table
/// however fast the field changes along a ray.
class OpticsTable {
 public:
  static constexpr int kEntries = 4096;
  /// (σ·c, σ) of a value in the field's units, σ in 1 / world unit.
  using Optics = std::function<glm::dvec4(double value)>;

  /// Over [low, high] of values, both ends clamped. Samples each entry four times.
  OpticsTable(const Optics& optics, double low, double high);
  /// Whether σ is 0 on all of [first, last].
  bool transparent(double first, double last) const;
  double low() const { return low_; }
  double high() const { return high_; }
  const gl::Texture& texture() const { return texture_; }

 private:
  double low_, high_;
  std::vector<int> occupied_;  ///< [entry + 1] how many entries before it are not transparent
  gl::Texture texture_;        ///< RGBA32F, kEntries x 2: integral in entries, mean
};

}  // namespace vestige
