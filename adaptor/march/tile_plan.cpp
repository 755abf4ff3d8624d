// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/march/tile_plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

namespace vestige {
namespace {

constexpr float kMipTolerance = 1e-7f;  ///< of the partition's range; as in march.glsl

/// What makes two bricks the same kind: the channel, the base function's integral up to them, the
/// number of isovalues below them, and for a MIP their value. Texels with a negative channel are of
/// no kind.
using Kind = std::tuple<float, float, long, float>;

class Kinds {
 public:
  explicit Kinds(const MarchRequest& request) : mip_(request.mip) {
    for (double v : request.isovalues) isovalues_.push_back(float(request.partition.normalised(v)));
    std::sort(isovalues_.begin(), isovalues_.end());
  }
  std::optional<Kind> of(const glm::vec4& texel) const {
    const bool noData = texel.y > texel.z;
    if (texel.x < 0.0f) return {};
    if (noData) return Kind{texel.x, texel.w, -1, 0.0f};
    if (below(texel.y) != below(texel.z)) return {};
    if (mip_ && texel.z - texel.y > kMipTolerance) return {};
    return Kind{texel.x, texel.w, below(texel.y),
                mip_ ? std::round(texel.y / kMipTolerance) : 0.0f};
  }

 private:
  long below(float value) const {
    return std::upper_bound(isovalues_.begin(), isovalues_.end(), value) - isovalues_.begin();
  }
  std::vector<float> isovalues_;
  bool mip_;
};

std::optional<Kind> commonest(const Kinds& kinds, std::span<const glm::vec4> texels) {
  std::map<Kind, std::size_t> counts;
  for (const auto& texel : texels) {
    if (const auto kind = kinds.of(texel)) ++counts[*kind];
  }
  const auto most =
      std::max_element(counts.begin(), counts.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == counts.end() || most->second * 20 < texels.size()) return {};
  return most->first;
}

/// Where a multi-perspective camera sees the points of a box of eye space, `low` to `high`, in the
/// coordinate `axis` (0, 1) on the camera plane: x + x/ρ Z/κ, and x/ρ, the cosine toward the axis,
/// is bounded by the box. A box around the pole line is seen on all sides.
glm::dvec2 distortedBounds(const glm::dvec3& low, const glm::dvec3& high, int axis, double lean) {
  const auto across = glm::dvec2(low[1 - axis], high[1 - axis]);
  const double far = std::max(std::abs(across.x), std::abs(across.y));
  const double near =
      across.x <= 0.0 && across.y >= 0.0 ? 0.0 : std::min(std::abs(across.x), std::abs(across.y));
  const auto cosine = [](double x, double other) {
    return x == 0.0 ? 0.0 : x / std::hypot(x, other);
  };
  const double a = low[axis], b = high[axis];
  double least = cosine(a, a > 0.0 ? far : near), most = cosine(b, b < 0.0 ? far : near);
  if (near == 0.0 && a <= 0.0 && b >= 0.0) least = -1.0, most = 1.0;
  const double front = std::max(low.z, 0.0), back = std::max(high.z, 0.0);
  return {a + lean * least * (least < 0.0 ? back : front),
          b + lean * most * (most > 0.0 ? back : front)};
}

/// Pixel and depth z of the frame, of every corner of every brick; of multi-perspective cameras,
/// place on the camera plane instead of pixel. The outermost bricks reach to the faces of the
/// domain at least, as their samples do.
class Corners {
 public:
  Corners(const BrickGrid& bricks, const BlockGrid& grid, const MarchFrame& frame,
          const MarchRequest& request)
      : size_(bricks.size()), frame_(frame), request_(request) {
    Camera parallel = request.camera;
    if (distorted()) parallel.projection = Projection::Orthographic;
    std::array<std::vector<double>, 3> planes;
    for (int axis = 0; axis < 3; ++axis) {
      const auto& nodes = grid.nodes[std::size_t(axis)];
      auto& at = planes[std::size_t(axis)];
      for (int i = 0; i < size_[std::size_t(axis)]; ++i) {
        at.push_back(nodes[std::size_t(i * BrickGrid::kCells)]);
      }
      at.push_back(std::max(nodes.back(), request.domain.high[axis]));
      at.front() = std::min(at.front(), request.domain.low[axis]);
    }
    for (double z : planes[2]) {
      for (double y : planes[1]) {
        for (double x : planes[0]) {
          auto at = parallel.project({x, y, z}, request.size);
          behind_ =
              behind_ || (request.camera.projection == Projection::Perspective && !(at.z > 0.0));
          at.z = (at.z - frame.depthOrigin) / frame.scale;
          at_.push_back(at);
        }
      }
    }
  }

  /// Some corner is not in front of the camera: projections mean nothing then.
  bool behind() const { return behind_; }

  /// Least and largest of the corners of a brick.
  std::pair<glm::dvec3, glm::dvec3> bounds(int x, int y, int z) const {
    glm::dvec3 low(kInfinity), high(-kInfinity);
    for (int corner = 0; corner < 8; ++corner) {
      const auto row = std::size_t(z + (corner >> 2)) * std::size_t(size_[1] + 1) +
                       std::size_t(y + ((corner >> 1) & 1));
      const auto& at = at_[row * std::size_t(size_[0] + 1) + std::size_t(x + (corner & 1))];
      low = glm::min(low, at);
      high = glm::max(high, at);
    }
    if (distorted()) distort(low, high);
    return {low, high};
  }

 private:
  bool distorted() const { return request_.camera.projection == Projection::MultiPerspective; }

  void distort(glm::dvec3& low, glm::dvec3& high) const {
    const ImageSize size = request_.size;
    const double side = request_.camera.viewHeight / size.height;
    const glm::dvec2 pixel(side * request_.camera.pixelAspect, side);
    const glm::dvec3 middle(0.5 * size.width, 0.5 * size.height, 0.0);
    const auto eye = [&](glm::dvec3 p) {
      return glm::dvec3(pixel * glm::dvec2(p - middle), p.z * frame_.scale + frame_.depthOrigin);
    };
    const glm::dvec3 from = eye(low), to = eye(high);
    for (int axis = 0; axis < 2; ++axis) {
      const auto bounds = distortedBounds(from, to, axis, 1.0 / request_.camera.convergence);
      low[axis] = middle[axis] + bounds.x / pixel[axis];
      high[axis] = middle[axis] + bounds.y / pixel[axis];
    }
  }

  std::array<int, 3> size_;
  const MarchFrame& frame_;
  const MarchRequest& request_;
  std::vector<glm::dvec3> at_;
  bool behind_ = false;
};

}  // namespace

int TilePlan::bandRows(int height, std::size_t rowBytes) {
  constexpr std::size_t kBandBytes = 16u << 20;
  const int fitting = int(std::max<std::size_t>(1, kBandBytes / rowBytes / kTile)) * kTile;
  return std::min(fitting, (height + kTile - 1) / kTile * kTile);
}

TilePlan::TilePlan(const BrickGrid& bricks, std::span<const glm::vec4> texels,
                   const BlockGrid& grid, const MarchFrame& frame, const MarchRequest& request) {
  const int columns = (request.size.width + kTile - 1) / kTile;
  const int rows = (request.size.height + kTile - 1) / kTile;
  const Kinds kinds(request);
  auto kind = commonest(kinds, texels);
  if (kind) {
    background = {int(std::get<0>(*kind)), -kInfinity};
    for (const auto& texel : texels) {
      if (kinds.of(texel) == kind) background->high = std::max(background->high, texel.z);
    }
  }

  // Per tile, the depths between which a ray may meet something else: none to begin with.
  std::vector<glm::vec2> ranges(
      std::size_t(columns) * std::size_t(rows),
      background ? glm::vec2(kInfinity, -kInfinity) : glm::vec2(-kInfinity, kInfinity));
  const std::optional<Corners> corners =
      background ? std::optional<Corners>(std::in_place, bricks, grid, frame, request)
                 : std::nullopt;
  if (corners && corners->behind()) {
    background.reset();
    std::fill(ranges.begin(), ranges.end(), glm::vec2(-kInfinity, kInfinity));
  }
  const auto [nx, ny, nz] = bricks.size();
  const double step = marchStep(request, grid) / frame.scale;
  for (std::size_t i = 0; background && i < texels.size(); ++i) {
    if (kinds.of(texels[i]) == kind) continue;
    const auto x = int(i) % nx, y = int(i) / nx % ny, z = int(i) / nx / ny;
    const auto [low, high] = corners->bounds(x, y, z);
    // A pixel and a step to spare, against rounding.
    const auto tile = [](double pixel, int most) {
      return int(std::clamp(std::floor(pixel / kTile), -1.0, double(most)));
    };
    for (int ty = std::max(0, tile(low.y - 1.0, rows));
         ty <= std::min(rows - 1, tile(high.y + 1.0, rows)); ++ty) {
      for (int tx = std::max(0, tile(low.x - 1.0, columns));
           tx <= std::min(columns - 1, tile(high.x + 1.0, columns)); ++tx) {
        auto& range = ranges[std::size_t(ty) * std::size_t(columns) + std::size_t(tx)];
        range.x = std::min(range.x, float(low.z - step));
        range.y = std::max(range.y, float(high.z + step));
      }
    }
  }
  for (int ty = 0; ty < rows; ++ty) {
    for (int tx = 0; tx < columns; ++tx) {
      const auto range = ranges[std::size_t(ty) * std::size_t(columns) + std::size_t(tx)];
      (range.x > range.y ? empty : marched).emplace_back(float(tx), float(ty), range.x, range.y);
    }
  }
}

}  // namespace vestige
