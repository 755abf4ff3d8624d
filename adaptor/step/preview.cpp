// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/step/preview.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "proxy/base/parallel.h"
#include "proxy/format/image/proxy_image.h"
#include "proxy/format/layout/proxy_layout.h"

namespace vestige {
namespace {

/// Premultiplied linear RGB and opacity.
struct Light {
  glm::dvec3 color{0.0};
  double alpha = 0.0;
};

std::uint8_t quantised(double value) {
  return std::uint8_t(std::lround(std::clamp(value, 0.0, 1.0) * 255.0));
}

/// 8-bit sRGB of a linear value in 0..1, from a table fine enough to be off by rounding only.
std::uint8_t srgbByte(double linear) {
  constexpr int kSteps = 1 << 16;
  static const std::vector<std::uint8_t> table = [] {
    std::vector<std::uint8_t> bytes(kSteps + 1);
    for (int i = 0; i <= kSteps; ++i) {
      bytes[std::size_t(i)] = quantised(srgbFromLinear(glm::dvec3(double(i) / kSteps)).x);
    }
    return bytes;
  }();
  if (!(linear > 0.0)) return 0;
  return table[std::size_t(std::min(linear, 1.0) * kSteps + 0.5)];
}

template <class Pixel>
Raster draw(ImageSize stored, const PreviewStyle& style, const Pixel& pixel) {
  const ImageSize size = squarePixels(stored, style.pixelAspect);
  Raster raster{size, std::vector<std::uint8_t>(size.pixels() * 4)};
  const glm::dvec3 background = linearFromSrgb(style.background);
  parallelFor(size.height, style.threads, [&](int y) {
    const auto row = std::size_t(y) * std::size_t(stored.height) / std::size_t(size.height);
    for (int x = 0; x < size.width; ++x) {
      const auto p = std::size_t(y) * std::size_t(size.width) + std::size_t(x);
      const auto column = std::size_t(x) * std::size_t(stored.width) / std::size_t(size.width);
      const Light light = pixel(row * std::size_t(stored.width) + column);
      const double alpha = light.alpha > 0.0 ? std::min(light.alpha, 1.0) : 0.0;
      const glm::dvec3 linear = !style.transparent ? light.color + (1.0 - alpha) * background
                                : alpha > 0.0      ? light.color / alpha
                                                   : glm::dvec3(0.0);
      auto* out = &raster.rgba[4 * p];
      for (int c = 0; c < 3; ++c) out[c] = srgbByte(linear[c]);
      out[3] = style.transparent ? quantised(alpha) : 255;
    }
  });
  return raster;
}

auto attenuationPixel(const RayImage& rays, const IntervalLook& look) {
  return [&](std::size_t p) {
    Light light;
    for (int k = 0; k < rays.channels; ++k) {
      const double a = rays.attenuation[std::size_t(k) * rays.size.pixels() + p];
      light.color += a * look.color[std::size_t(k)];
      light.alpha += a;
    }
    return light;
  };
}

auto lengthPixel(const RayImage& rays, const IntervalLook& look) {
  return [&](std::size_t p) {
    std::array<std::pair<float, int>, IntervalPartition::kMaxIntervals + 3> order;
    auto last = order.begin();
    const auto pixels = rays.size.pixels();
    for (int k = 0; k < rays.channels; ++k) {
      const auto at = std::size_t(k) * pixels + p;
      if (rays.length[at] > 0.0f) *last++ = {rays.moment[at] / rays.length[at], k};
    }
    std::sort(order.begin(), last);
    Light light;
    for (auto next = order.begin(); next != last; ++next) {
      const int k = next->second;
      const double opacity = -std::expm1(-look.extinction[std::size_t(k)] *
                                         double(rays.length[std::size_t(k) * pixels + p]));
      light.color += (1.0 - light.alpha) * opacity * look.color[std::size_t(k)];
      light.alpha += (1.0 - light.alpha) * opacity;
    }
    return light;
  };
}

auto depthPixel(const RayImage& rays) {
  float near = std::numeric_limits<float>::infinity(), far = -near;
  for (const float z : rays.depth) {
    if (std::isfinite(z)) {
      near = std::min(near, z);
      far = std::max(far, z);
    }
  }
  const double range = far > near ? double(far) - double(near) : 1.0;
  return [&rays, near, range](std::size_t p) -> Light {
    float nearest = std::numeric_limits<float>::infinity();
    for (std::size_t at = p; at < rays.depth.size(); at += rays.size.pixels()) {
      nearest = std::min(nearest, rays.depth[at]);
    }
    if (!std::isfinite(nearest)) return {};
    const double grey = 1.0 - 0.8 * (double(nearest) - double(near)) / range;
    return {linearFromSrgb(glm::dvec3(grey)), 1.0};
  };
}

auto mipPixel(const RayImage& rays, const TransferFunction& base, const StorageScale& scale) {
  // As many colours as a byte a component can tell apart along a map.
  constexpr int kColors = 2048;
  const double low = base.colorLow(), width = base.colorHigh() - base.colorLow();
  std::vector<glm::dvec3> colors;
  for (int i = 0; i <= kColors; ++i) colors.push_back(base.color(low + i * width / kColors));
  return [&rays, &base, colors = std::move(colors), low, width, scale](std::size_t p) -> Light {
    const double value = double(rays.mip[p]) * scale.unit + scale.zero;
    if (std::isnan(value)) return {};
    if (!(width > 0.0)) return {base.color(value), 1.0};
    const double at = std::clamp((value - low) / width, 0.0, 1.0);
    return {colors[std::size_t(at * kColors + 0.5)], 1.0};
  };
}

auto referencePixel(const RayImage& rays) {
  return [&](std::size_t p) -> Light {
    const auto pixels = rays.size.pixels();
    return {{rays.reference[p], rays.reference[pixels + p], rays.reference[2 * pixels + p]},
            1.0 - double(rays.transmittance[p])};
  };
}

}  // namespace

Raster preview(std::string_view kind, const RayImage& rays, const Classification& classification,
               const PreviewStyle& style) {
  const IntervalLook look = classification.base.onIntervals(classification.partition);
  if (kind == kind::kAttenuation) return draw(rays.size, style, attenuationPixel(rays, look));
  if (kind == kind::kLength) return draw(rays.size, style, lengthPixel(rays, look));
  if (kind == kind::kDepth) return draw(rays.size, style, depthPixel(rays));
  if (kind == kind::kMip)
    return draw(rays.size, style,
                mipPixel(rays, classification.base, mipScale(classification.partition)));
  return draw(rays.size, style, referencePixel(rays));
}

Raster preview(const SlicedStack& stack, const Classification& classification,
               const PreviewStyle& style) {
  const IntervalLook look = classification.base.onIntervals(classification.partition);
  const SlabChords chords(stack.header);
  return draw(stack.header.size, style, [&](std::size_t p) {
    Light light;
    for (std::size_t s = 0; s < stack.slabs.size() && light.alpha < 0.999; ++s) {
      const StackCell& cell = stack.slabs[s].cells[p];
      const auto levels = stack.slabs[s].levelsOf(cell);
      if (levels.empty()) continue;
      double depth = 0.0;
      glm::dvec3 glow(0.0);
      for (std::size_t i = 0; i < levels.size(); ++i) {
        const auto k = std::size_t(classification.partition.channelAt(int(cell.lowest + i)));
        depth += levels[i] * look.extinction[k];
        glow += levels[i] * look.extinction[k] * look.color[k];
      }
      if (!(depth > 0.0)) continue;
      const double opacity = -std::expm1(-depth * chords.chord(int(s), p) / stack.levels);
      light.color += (1.0 - light.alpha) * opacity * glow / depth;
      light.alpha += (1.0 - light.alpha) * opacity;
    }
    return light;
  });
}

Raster preview(const FeatureImage& image, const PreviewStyle& style) {
  const FeatureOrigin& features = featuresOf(image.header);
  const auto optics = features.classifier->optics(features.referenceLength);
  const std::size_t pixels = image.header.size.pixels();
  return draw(image.header.size, style, [&](std::size_t p) {
    Light light{glm::dvec3(0.0), 1.0 - double(image.transmittance[p])};
    for (std::size_t c = 0; c < optics.size(); ++c) {
      const double rate = attenuationRate(optics[c]);
      if (rate > 0.0)
        light.color += double(image.attenuation[c * pixels + p]) / rate * optics[c].emission;
    }
    return light;
  });
}

Raster preview(const FeatureStack& stack, const PreviewStyle& style) {
  const FeatureOrigin& features = featuresOf(stack.header);
  const auto optics = features.classifier->optics(features.referenceLength);
  const std::size_t pixels = stack.header.size.pixels();
  return draw(stack.header.size, style, [&](std::size_t p) {
    Light light;
    for (std::size_t s = 0; s < stack.slabs.size() && light.alpha < 0.999; ++s) {
      double depth = 0.0;
      glm::dvec3 glow(0.0);
      for (std::size_t c = 0; c < optics.size(); ++c) {
        const double integral = stack.slabs[s][c * pixels + p];
        depth += integral * optics[c].extinction;
        glow += integral * optics[c].emission;
      }
      const double left = 1.0 - light.alpha;
      const double opacity = -std::expm1(-depth);
      light.color += left * (depth > 0.0 ? opacity / depth : 1.0) * glow;
      light.alpha += left * opacity;
    }
    return light;
  });
}

}  // namespace vestige
