// SPDX-License-Identifier: BSD-3-Clause
#include "tests/fidelity/novel_view_peers.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "proxy/format/layout/proxy_layout.h"
#include "tests/support/ray_walk.h"

namespace vestige::test {
namespace {

using Vertex = std::pair<glm::dvec3, std::array<double, 4>>;  // pixel and depth; premultiplied RGBA

/// Draws a triangle, the nearest surface in each pixel.
void drawTriangle(const std::array<Vertex, 3>& v, Picture& picture, std::vector<double>& nearest) {
  const auto edge = [](const glm::dvec3& a, const glm::dvec3& b, double x, double y) {
    return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
  };
  const double area = edge(v[0].first, v[1].first, v[2].first.x, v[2].first.y);
  if (!(std::abs(area) > 1e-12)) return;
  const auto bounds = [&](int axis, int most) {
    const auto [low, high] = std::minmax({v[0].first[axis], v[1].first[axis], v[2].first[axis]});
    return std::pair{std::max(0, int(std::ceil(low - 0.5))),
                     std::min(most - 1, int(std::floor(high - 0.5)))};
  };
  const auto [x0, x1] = bounds(0, picture.size.width);
  const auto [y0, y1] = bounds(1, picture.size.height);
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      std::array<double, 3> w{};
      bool inside = true;
      for (std::size_t i = 0; i < 3; ++i) {
        w[i] = edge(v[(i + 1) % 3].first, v[(i + 2) % 3].first, x + 0.5, y + 0.5) / area;
        inside = inside && w[i] >= 0.0;
      }
      if (!inside) continue;
      const double z = w[0] * v[0].first.z + w[1] * v[1].first.z + w[2] * v[2].first.z;
      auto& front = nearest[std::size_t(y) * std::size_t(picture.size.width) + std::size_t(x)];
      if (z >= front) continue;
      front = z;
      for (std::size_t c = 0; c < 4; ++c)
        picture.pixel(x, y)[c] =
            float(w[0] * v[0].second[c] + w[1] * v[1].second[c] + w[2] * v[2].second[c]);
    }
  }
}

/// Mean depths of the corners of coarse cells, from the pixels within a cell of them; where there
/// are none, the slab's own middle.
class HeightField {
 public:
  HeightField(const SlabPictures& slabs, int slab, int cell, double middle)
      : cell_(cell), columns_(slabs.size.width / cell + 2) {
    const int rows = slabs.size.height / cell + 2;
    std::vector<double> sum(std::size_t(columns_ * rows)), weight(sum.size());
    const std::size_t pixels = slabs.size.pixels();
    for (int y = 0; y < slabs.size.height; ++y) {
      for (int x = 0; x < slabs.size.width; ++x) {
        const std::size_t p = std::size_t(slab) * pixels +
                              std::size_t(y) * std::size_t(slabs.size.width) + std::size_t(x);
        const double alpha = slabs.rgba[4 * p + 3];
        if (!(alpha > 0.0)) continue;
        for (const auto& [at, share] : cornersOf(x + 0.5, y + 0.5)) {
          sum[at] += alpha * share * double(slabs.depth[p]);
          weight[at] += alpha * share;
        }
      }
    }
    for (std::size_t i = 0; i < sum.size(); ++i)
      heights_.push_back(weight[i] > 1e-6 ? sum[i] / weight[i] : middle);
  }
  double at(double x, double y) const {
    double height = 0.0;
    for (const auto& [corner, share] : cornersOf(x, y)) height += share * heights_[corner];
    return height;
  }

 private:
  std::array<std::pair<std::size_t, double>, 4> cornersOf(double x, double y) const {
    const int i = int(x / cell_), j = int(y / cell_);
    const double u = x / cell_ - i, v = y / cell_ - j;
    const auto corner = [&](int a, int b) { return std::size_t((j + b) * columns_ + i + a); };
    return {{{corner(0, 0), (1 - u) * (1 - v)},
             {corner(1, 0), u * (1 - v)},
             {corner(0, 1), (1 - u) * v},
             {corner(1, 1), u * v}}};
  }
  int cell_, columns_;
  std::vector<double> heights_;
};

}  // namespace

SlabPictures renderSlabs(const Scene& scene, const Camera& camera, ImageSize size,
                         const Medium& medium, int slabs, int samplesPerVoxel) {
  const std::size_t pixels = size.pixels(), count = std::size_t(slabs);
  SlabPictures out{camera, size, slabs, std::vector<float>(4 * count * pixels),
                   std::vector<float>(count * pixels)};
  const DepthRange range = depthRange(camera, scene.domain());
  forEachRay(camera, size, [&](std::size_t p, const Ray& ray) {
    struct Gathered {
      glm::dvec3 color{0.0};
      double left = 1.0, moment = 0.0;
    };
    std::vector<Gathered> gathered(count);
    walkRay(scene, ray, samplesPerVoxel, [&](double s0, double s1, double f0, double f1) {
      if (!std::isfinite(f0 + f1)) return;
      const Optics optics = medium(0.5 * (f0 + f1));
      if (!(optics.extinction > 0.0)) return;
      const double z = 0.5 * (s0 + s1) * ray.depthPerLength;
      const double at = (z - range.low) / (range.high - range.low) * slabs;
      Gathered& slab = gathered[std::size_t(std::clamp(int(at), 0, slabs - 1))];
      const double alpha = slab.left * -std::expm1(-optics.extinction * (s1 - s0));
      slab.color += alpha * optics.color;
      slab.moment += alpha * z;
      slab.left -= alpha;
    });
    for (std::size_t i = 0; i < count; ++i) {
      const double alpha = 1.0 - gathered[i].left;
      float* rgba = out.rgba.data() + 4 * (i * pixels + p);
      for (int c = 0; c < 3; ++c) rgba[c] = float(gathered[i].color[c]);
      rgba[3] = float(alpha);
      out.depth[i * pixels + p] = alpha > 0.0 ? float(gathered[i].moment / alpha) : 0.0f;
    }
  });
  return out;
}

Picture warpPoints(const SlabPictures& slabs, const Camera& target) {
  Picture picture = Picture::blank(slabs.size);
  std::vector<double> nearest(slabs.size.pixels(), HUGE_VAL);
  for (int y = 0; y < slabs.size.height; ++y) {
    for (int x = 0; x < slabs.size.width; ++x) {
      const std::size_t p = std::size_t(y) * std::size_t(slabs.size.width) + std::size_t(x);
      if (!(slabs.rgba[4 * p + 3] > 0.0f)) continue;
      const glm::dvec3 world =
          slabs.camera.unproject({x + 0.5, y + 0.5, double(slabs.depth[p])}, slabs.size);
      const glm::dvec3 at = target.project(world, slabs.size);
      const int tx = int(std::floor(at.x)), ty = int(std::floor(at.y));
      if (tx < 0 || ty < 0 || tx >= slabs.size.width || ty >= slabs.size.height) continue;
      auto& front = nearest[std::size_t(ty) * std::size_t(slabs.size.width) + std::size_t(tx)];
      if (at.z >= front) continue;
      front = at.z;
      std::copy_n(slabs.rgba.data() + 4 * p, 4, picture.pixel(tx, ty));
    }
  }
  return picture;
}

Picture warpHeightFields(const SlabPictures& slabs, const Camera& target, int cell) {
  Picture all = Picture::blank(slabs.size);
  const std::size_t pixels = slabs.size.pixels();
  float low = HUGE_VALF, high = -HUGE_VALF;
  for (std::size_t i = 0; i < slabs.depth.size(); ++i) {
    if (slabs.rgba[4 * i + 3] <= 0.0f) continue;
    low = std::min(low, slabs.depth[i]);
    high = std::max(high, slabs.depth[i]);
  }
  for (int slab = 0; slab < slabs.slabs; ++slab) {
    const double middle = low + (double(high) - low) * (slab + 0.5) / slabs.slabs;
    const HeightField heights(slabs, slab, cell, middle);
    Picture picture = Picture::blank(slabs.size);
    std::vector<double> nearest(pixels, HUGE_VAL);
    const auto vertex = [&](int x, int y) {
      const std::size_t p = std::size_t(slab) * pixels +
                            std::size_t(y) * std::size_t(slabs.size.width) + std::size_t(x);
      Vertex v;
      for (std::size_t c = 0; c < 4; ++c) v.second[c] = slabs.rgba[4 * p + c];
      v.first = target.project(
          slabs.camera.unproject({x + 0.5, y + 0.5, heights.at(x + 0.5, y + 0.5)}, slabs.size),
          slabs.size);
      return v;
    };
    for (int y = 0; y + 1 < slabs.size.height; ++y) {
      for (int x = 0; x + 1 < slabs.size.width; ++x) {
        const Vertex a = vertex(x, y), b = vertex(x + 1, y), c = vertex(x, y + 1),
                     d = vertex(x + 1, y + 1);
        if (a.second[3] + b.second[3] + c.second[3] + d.second[3] == 0.0) continue;
        drawTriangle({a, b, c}, picture, nearest);
        drawTriangle({b, d, c}, picture, nearest);
      }
    }
    placeOver(all, picture);
  }
  return all;
}

}  // namespace vestige::test
