// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/features/feature_recomposition.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "proxy/base/parallel.h"

namespace vestige {
namespace {

/// Parts that a slab is composited in; colours are mixed inside a part.
constexpr int kParts = 4;

/// Light gathered front to back.
struct Gathered {
  glm::dvec3 light{0.0};
  double left = 1.0;

  /// A homogeneous mixture: σ ds and σ c ds summed over its channels.
  void add(double depth, glm::dvec3 emission) {
    if (!(depth > 0.0)) {
      light += left * emission;
      return;
    }
    const double alpha = -std::expm1(-depth);
    light += left * (alpha / depth) * emission;
    left *= 1.0 - alpha;
  }
};

/// How much more of its mean a channel's density is at the far end of slab s than in its middle,
/// -1 .. 1: half the slope to its neighbours, the lesser of both, none at a peak.
double leaning(double before, double own, double after) {
  const double up = after - own, down = own - before;
  if (!(up * down > 0.0) || !(own > 0.0)) return 0.0;
  const double slope = std::abs(up) < std::abs(down) ? up : down;
  return std::clamp(0.5 * slope / own, -1.0, 1.0);
}

class StackRays {
 public:
  StackRays(const FeatureStack& stack, std::span<const ChannelOptics> optics)
      : stack_(stack), optics_(optics), pixels_(stack.header.size.pixels()) {}

  /// `turned`: the parts of each slab back to front.
  Gathered at(std::size_t pixel, bool turned) const {
    Gathered ray;
    for (std::size_t s = 0; s < stack_.slabs.size(); ++s) addSlab(s, pixel, turned, ray);
    return ray;
  }

 private:
  double integral(std::size_t slab, std::size_t channel, std::size_t pixel) const {
    return double(stack_.slabs[slab][channel * pixels_ + pixel]);
  }

  void addSlab(std::size_t s, std::size_t pixel, bool turned, Gathered& ray) const {
    std::array<double, kParts> depth{};
    std::array<glm::dvec3, kParts> emission{};
    int present = 0;
    for (std::size_t i = 0; i < optics_.size(); ++i) {
      const double own = integral(s, i, pixel);
      if (!(own > 0.0)) continue;
      ++present;
      const double before = s > 0 ? integral(s - 1, i, pixel) : own;
      const double after = s + 1 < stack_.slabs.size() ? integral(s + 1, i, pixel) : own;
      const double lean = leaning(before, own, after);
      for (int p = 0; p < kParts; ++p) {
        // The line's mean over the part.
        const double share = (1.0 + lean * (2.0 * (p + 0.5) / kParts - 1.0)) / kParts;
        depth[std::size_t(p)] += optics_[i].extinction * own * share;
        emission[std::size_t(p)] += optics_[i].emission * (own * share);
      }
    }
    if (present == 0) return;
    for (int p = 0; p < kParts; ++p) {
      const auto part = std::size_t(turned ? kParts - 1 - p : p);
      ray.add(depth[part], emission[part]);
    }
  }

  const FeatureStack& stack_;
  std::span<const ChannelOptics> optics_;
  std::size_t pixels_;
};

template <typename RayAt>
RecomposedFeatures picture(ImageSize size, bool doubt, const RayAt& rayAt) {
  RecomposedFeatures result{Picture::blank(size), {}};
  if (doubt) result.doubt.resize(size.pixels());
  parallelRanges(size.height, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const std::size_t pixel = std::size_t(y) * std::size_t(size.width) + std::size_t(x);
        const Gathered ray = rayAt(pixel, false);
        float* rgba = result.picture.pixel(x, y);
        for (int c = 0; c < 3; ++c) rgba[c] = float(ray.light[c]);
        rgba[3] = float(1.0 - ray.left);
        if (!doubt) continue;
        const glm::dvec3 change = glm::abs(rayAt(pixel, true).light - ray.light);
        result.doubt[pixel] = float(std::max({change.r, change.g, change.b}));
      }
    }
  });
  return result;
}

}  // namespace

RecomposedFeatures recomposed(const FeatureStack& stack, std::span<const ChannelOptics> optics,
                              bool doubt) {
  const StackRays rays(stack, optics);
  return picture(stack.header.size, doubt,
                 [&](std::size_t pixel, bool turned) { return rays.at(pixel, turned); });
}

RecomposedFeatures recomposed(const FeatureImage& image, std::span<const ChannelOptics> optics,
                              bool doubt) {
  const std::size_t pixels = image.header.size.pixels();
  return picture(image.header.size, doubt, [&](std::size_t pixel, bool turned) {
    std::array<std::size_t, Classifier::kMaxFeatures> order{};
    std::size_t count = 0;
    for (std::size_t i = 0; i < optics.size(); ++i) {
      if (image.integral[i * pixels + pixel] > 0.0f) order[count++] = i;
    }
    std::sort(order.begin(), order.begin() + std::ptrdiff_t(count), [&](auto a, auto b) {
      const float za = image.depth[a * pixels + pixel], zb = image.depth[b * pixels + pixel];
      return turned ? za > zb : za < zb;
    });
    Gathered ray;
    for (std::size_t k = 0; k < count; ++k) {
      const double length = double(image.integral[order[k] * pixels + pixel]);
      ray.add(optics[order[k]].extinction * length, optics[order[k]].emission * length);
    }
    return ray;
  });
}

}  // namespace vestige
