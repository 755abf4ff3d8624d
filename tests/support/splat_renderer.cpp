// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/splat_renderer.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>
#include <glm/matrix.hpp>

namespace vestige::test {
namespace {

constexpr double kReach = 3.5;  ///< deviations of a footprint that are drawn

/// One pixel of a sheet: sums over kernels, and what the sheets before it left.
struct Pixel {
  double weight = 0.0, extinction = 0.0;
  glm::dvec3 emission{0.0};
};

/// A kernel's projection: exp(-x' inverse x / 2) in pixels, drawn within a box of half sizes.
struct Footprint {
  glm::dmat2 inverse;
  glm::dvec2 reach;
};

Footprint footprintOf(const Camera& camera, ImageSize size, const glm::dvec3& spacing,
                      double deviation) {
  const double pixels = size.height / camera.viewHeight;
  glm::dmat2 covariance(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 along(0.0);
    along[axis] = deviation * spacing[axis] * pixels;
    const glm::dvec2 seen(glm::dot(along, camera.right()), -glm::dot(along, camera.up));
    covariance += glm::outerProduct(seen, seen);
  }
  // A pixel sees its own width of the kernel.
  covariance += glm::dmat2(1.0 / 12.0);
  return {glm::inverse(covariance),
          kReach * glm::dvec2(std::sqrt(covariance[0][0]), std::sqrt(covariance[1][1]))};
}

class Sheets {
 public:
  Sheets(ImageSize size, const Footprint& footprint)
      : size_(size),
        footprint_(footprint),
        sheet_(size.pixels()),
        color_(size.pixels()),
        transmittance_(size.pixels(), 1.0) {}

  void splat(const glm::dvec2& center, double extinction, const glm::dvec3& emission) {
    const auto first = glm::max(glm::ivec2(glm::ceil(center - footprint_.reach - 0.5)), 0);
    const auto last = glm::min(glm::ivec2(glm::floor(center + footprint_.reach - 0.5)),
                               glm::ivec2(size_.width, size_.height) - 1);
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x) {
        const glm::dvec2 away = glm::dvec2(x + 0.5, y + 0.5) - center;
        const double weight = std::exp(-0.5 * glm::dot(away, footprint_.inverse * away));
        Pixel& pixel = sheet_[std::size_t(y) * std::size_t(size_.width) + std::size_t(x)];
        pixel.weight += weight;
        pixel.extinction += weight * extinction;
        pixel.emission += weight * emission;
      }
    }
  }

  /// Puts the sheet behind those before; lengthAt(pixel index) is a ray's way through its layer.
  template <typename Length>
  void composite(const Length& lengthAt) {
    for (std::size_t i = 0; i < sheet_.size(); ++i) {
      Pixel& pixel = sheet_[i];
      const double length = pixel.weight > 0.0 ? lengthAt(i) : 0.0;
      if (length > 0.0) {
        const double extinction = pixel.extinction / pixel.weight;
        const double alpha = -std::expm1(-extinction * length);
        const double seen = extinction > 0.0 ? alpha / extinction : length;
        color_[i] += transmittance_[i] * seen / pixel.weight * pixel.emission;
        transmittance_[i] *= 1.0 - alpha;
      }
      pixel = Pixel{};
    }
  }

  RgbPicture picture() const {
    RgbPicture picture{size_, std::vector<float>(3 * size_.pixels())};
    for (std::size_t i = 0; i < color_.size(); ++i)
      for (int c = 0; c < 3; ++c) picture.rgb[3 * i + std::size_t(c)] = float(color_[i][c]);
    return picture;
  }

 private:
  ImageSize size_;
  Footprint footprint_;
  std::vector<Pixel> sheet_;
  std::vector<glm::dvec3> color_;
  std::vector<double> transmittance_;
};

/// The length of a ray between two planes across an axis, inside the box.
double lengthBetween(const Ray& ray, const Box& box, int axis, double low, double high) {
  double enter = 0.0, leave = HUGE_VAL;
  for (int a = 0; a < 3; ++a) {
    const double from = a == axis ? low : box.low[a], to = a == axis ? high : box.high[a];
    const double o = ray.origin[a], d = ray.direction[a];
    if (std::abs(d) < 1e-14) {
      if (o < from || o > to) return 0.0;
      continue;
    }
    enter = std::max(enter, std::min((from - o) / d, (to - o) / d));
    leave = std::min(leave, std::max((from - o) / d, (to - o) / d));
  }
  return leave - enter;
}

}  // namespace

RgbPicture renderSplats(const FieldScenes& scenes, const Classifier& classifier,
                        std::span<const ChannelOptics> look, const ClassifiedView& view,
                        double deviation) {
  const Scene& grid = scenes.fields[0];
  const Camera& camera = view.camera;
  const Box box = grid.domain();
  // Layers are across the axis along which the view runs most.
  int across = 0;
  for (int axis = 1; axis < 3; ++axis)
    if (std::abs(camera.forward[axis]) > std::abs(camera.forward[across])) across = axis;
  const int u = (across + 1) % 3, v = (across + 2) % 3;
  const int layers = grid.size[std::size_t(across)];
  Sheets sheets(view.size, footprintOf(camera, view.size, grid.spacing, deviation));
  std::vector<double> weights(classifier.channels().size());
  for (int order = 0; order < layers; ++order) {
    const int layer = camera.forward[across] > 0.0 ? order : layers - 1 - order;
    for (int j = 0; j < grid.size[std::size_t(v)]; ++j) {
      for (int i = 0; i < grid.size[std::size_t(u)]; ++i) {
        glm::dvec3 index(0.0);
        index[across] = layer;
        index[u] = i;
        index[v] = j;
        const glm::dvec3 world = grid.origin + grid.spacing * index;
        const FieldSample at = scenes.sample(world, classifier.needsGradient());
        classifier.weights(at, at, weights);
        double extinction = 0.0;
        glm::dvec3 emission(0.0);
        for (std::size_t k = 0; k < weights.size(); ++k) {
          extinction += weights[k] * look[k].extinction;
          emission += weights[k] * look[k].emission;
        }
        sheets.splat(glm::dvec2(camera.project(world, view.size)), extinction, emission);
      }
    }
    const double middle = grid.origin[across] + layer * grid.spacing[across];
    const double low = middle - 0.5 * grid.spacing[across],
                 high = middle + 0.5 * grid.spacing[across];
    sheets.composite([&](std::size_t pixel) {
      const double x = double(pixel % std::size_t(view.size.width)) + 0.5;
      const double y = double(pixel / std::size_t(view.size.width)) + 0.5;
      return lengthBetween(camera.rayThrough({x, y}, view.size), box, across,
                           std::max(low, box.low[across]), std::min(high, box.high[across]));
    });
  }
  return sheets.picture();
}

}  // namespace vestige::test
