// SPDX-License-Identifier: BSD-3-Clause
// What stands in for light, against the raw field [Tikhonova 2010, Figs. 9 and 14]:
//   ao_SCENE_{proxy,mask}: correlation of proxy ambient occlusion, and of the best unsharp mask of
//     depth, with the share of the hemisphere that the raw isosurface covers;
//   enhance_SCENE_{attenuation,image}: rank correlation of depth-aware enhancement (eq. 11), and of
//   the
//     gradient of the picture itself, with how much darker a headlight makes the picture.
// With VESTIGE_PICTURES=FOLDER the compared pictures are written there.
// usage: bench_effects --seeds A..B LINE...   (nothing is random)
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <glm/vector_relational.hpp>
#include <numbers>

#include "explorer/layers/layers.h"
#include "explorer/picture/picture.h"
#include "explorer/recomposition/edit_pass.h"
#include "proxy/base/parallel.h"
#include "proxy/format/layout/proxy_layout.h"
#include "proxy/gl/functions.h"
#include "tests/bench/bench_run.h"
#include "tests/bench/layered_scenes.h"

namespace vestige::test {
namespace {

constexpr ImageSize kSize{256, 256};
constexpr double kRadius = 0.05;  // of the domain's diagonal, as looks have it by default

/// Values of some pixels; the others are NaN.
using Values = std::vector<double>;

double correlation(const Values& a, const Values& b) {
  double n = 0, sa = 0, sb = 0, aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::isnan(a[i]) || std::isnan(b[i])) continue;
    ++n, sa += a[i], sb += b[i], aa += a[i] * a[i], bb += b[i] * b[i], ab += a[i] * b[i];
  }
  return (n * ab - sa * sb) / std::sqrt((n * aa - sa * sa) * (n * bb - sb * sb));
}

/// The same of ranks: what correlation does not owe to contrast, which an effect is free to choose
/// (eq. 11 has lambda and gamma).
double rankCorrelation(const Values& a, const Values& b) {
  const auto ranks = [&](const Values& of) {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < of.size(); ++i)
      if (!std::isnan(a[i]) && !std::isnan(b[i])) order.push_back(i);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t i, std::size_t j) { return of[i] < of[j]; });
    Values rank(of.size(), NAN);
    for (std::size_t first = 0; first < order.size();) {
      std::size_t last = first;
      while (last + 1 < order.size() && of[order[last + 1]] == of[order[first]]) ++last;
      for (std::size_t i = first; i <= last; ++i) rank[order[i]] = 0.5 * double(first + last);
      first = last + 1;
    }
    return rank;
  };
  return correlation(ranks(a), ranks(b));
}

/// 1 - value / largest of the values, in grey.
void writeValues(const std::string& name, const Values& values) {
  const char* folder = std::getenv("VESTIGE_PICTURES");
  if (!folder) return;
  std::vector<double> sorted;
  for (const double v : values)
    if (!std::isnan(v)) sorted.push_back(v);
  std::sort(sorted.begin(), sorted.end());
  const double most = sorted.empty() ? 1.0 : std::max(sorted[sorted.size() * 99 / 100], 1e-9);
  Picture picture = Picture::blank(kSize);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double shown = std::isnan(values[i]) ? 0.0 : 1.0 - std::clamp(values[i] / most, 0.0, 1.0);
    for (std::size_t c = 0; c < 3; ++c) picture.rgba[4 * i + c] = float(shown * shown);
    picture.rgba[4 * i + 3] = 1.0f;
  }
  writePicture(std::string(folder) + "/" + name + ".png", picture);
}

void print(const std::string& line, double value) {
  std::printf("%s\t%.4f\n", line.c_str(), value);
  std::fflush(stdout);
}

// --- ambient occlusion ---------------------------------------------------------------------------

/// The share of the hemisphere around each hit's normal, by the cosine rule, in which the raw field
/// passes the isovalue within the radius.
Values coveredShare(const Scene& scene, const DepthLayers& layers, double radius) {
  constexpr int kRays = 96;
  const Camera& camera = layers.header.camera;
  const Box domain = scene.domain();
  const double isovalue = layers.header.isovalues[0], step = 0.5 * scene.minimumSpacing();
  Values covered(kSize.pixels(), NAN);
  parallelRanges(kSize.height, [&](int from, int to) {
    for (auto i = std::size_t(from * kSize.width); i < std::size_t(to * kSize.width); ++i) {
      if (!std::isfinite(layers.depth[0][i])) continue;
      const int x = int(i) % kSize.width, y = int(i) / kSize.width;
      const Ray ray = camera.rayThrough({x + 0.5, y + 0.5}, kSize);
      const glm::dvec3 p = ray.origin + double(layers.depth[0][i]) /
                                            glm::dot(ray.direction, camera.forward) * ray.direction;
      const float* e = layers.normal[0].data() + 3 * i;
      const glm::dvec3 n =
          double(e[0]) * camera.right() + double(e[1]) * camera.up - double(e[2]) * camera.forward;
      const glm::dvec3 other = std::abs(n.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
      const glm::dvec3 u = glm::normalize(glm::cross(n, other)), v = glm::cross(n, u);
      // The side that the normal looks to; the surface is where the other one begins.
      const bool above = scene.sample(p + 3.0 * step * n) >= isovalue;
      int hits = 0;
      for (int r = 0; r < kRays; ++r) {
        const double share = (r + 0.5) / kRays, angle = 2.0 * std::numbers::pi * 0.61803398875 * r;
        const glm::dvec3 d = std::sqrt(share) * (std::cos(angle) * u + std::sin(angle) * v) +
                             std::sqrt(1.0 - share) * n;
        // The first steps leave the cell that the surface passes through.
        for (double t = 3.0 * step; t < radius; t += step) {
          const glm::dvec3 q = p + t * d;
          if (glm::any(glm::lessThan(q, domain.low)) || glm::any(glm::greaterThan(q, domain.high)))
            break;
          if ((scene.sample(q) >= isovalue) == above) continue;
          ++hits;
          break;
        }
      }
      covered[i] = double(hits) / kRays;
    }
  });
  return covered;
}

Values proxyOcclusion(gl::Device& device, DepthLayers layers, double radius) {
  std::vector<float> open(4 * kSize.pixels());
  const std::vector<float> depth = layers.depth[0];
  device.run([&] {
    DepthLayerPass pass;
    const LayerTextures textures(completedLayers(std::move(layers), nullptr, {}));
    LightSetup setup;
    setup.shade = false;
    setup.ao = {true, 1.0, 0.0};
    setup.aoRadiusWorld = radius;
    const gl::Texture light = pass.light(textures, setup);
    light.bind(0);
    gl::functions().GetTexImage(GL_TEXTURE_2D_ARRAY, 0, GL_RGBA, GL_FLOAT, open.data());
  });
  Values values(kSize.pixels(), NAN);
  for (std::size_t i = 0; i < values.size(); ++i)
    if (std::isfinite(depth[i])) values[i] = 1.0 - double(open[4 * i]);
  return values;
}

/// How much nearer the neighbourhood is, by a Gaussian over the pixels that have a surface.
Values unsharpMask(const std::vector<float>& depth, double width) {
  const int reach = int(std::ceil(3.0 * width));
  Values values(kSize.pixels(), NAN);
  parallelRanges(kSize.height, [&](int from, int to) {
    for (int y = from; y < to; ++y) {
      for (int x = 0; x < kSize.width; ++x) {
        const auto at = [&](int i, int j) {
          return double(depth[std::size_t(j) * std::size_t(kSize.width) + std::size_t(i)]);
        };
        if (!std::isfinite(at(x, y))) continue;
        double sum = 0.0, weights = 0.0;
        for (int j = std::max(0, y - reach); j <= std::min(kSize.height - 1, y + reach); ++j) {
          for (int i = std::max(0, x - reach); i <= std::min(kSize.width - 1, x + reach); ++i) {
            if (!std::isfinite(at(i, j))) continue;
            const double weight =
                std::exp(-((i - x) * (i - x) + (j - y) * (j - y)) / (2.0 * width * width));
            sum += weight * (at(x, y) - at(i, j));
            weights += weight;
          }
        }
        values[std::size_t(y) * std::size_t(kSize.width) + std::size_t(x)] =
            std::max(0.0, sum / weights);
      }
    }
  });
  return values;
}

void measureOcclusion(const std::shared_ptr<gl::Device>& device, const std::string& name, int size,
                      double isovalue) {
  const Scene scene = namedScene(name, size, sceneCache());
  MarchRequest request{.camera = frameBox(scene.domain(), {0, 1, 0}, {0, 0, 1}, 1.0),
                       .size = kSize,
                       .partition = IntervalPartition::uniform(scene.low, scene.high, 16),
                       .base = TransferFunction::ramp(scene.low, scene.high, 1.0),
                       .domain = scene.domain(),
                       .isovalues = {isovalue}};
  request.attenuation = request.length = false;
  Marcher marcher(device);
  const RayImage rays = marchOnGpu(marcher, scene, request);
  ProxyHeader header;
  header.camera = request.camera;
  header.size = kSize;
  header.domain = request.domain;
  header.isovalues = request.isovalues;
  const DepthLayers layers = depthLayers(depthImage(header, rays.depth, rays.normal));
  const double radius = kRadius * scene.domain().diagonal();
  const Values truth = coveredShare(scene, layers, radius);
  const Values proxy = proxyOcclusion(*device, layers, radius);
  double best = -1.0;
  Values mask;
  for (const double width : {1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0}) {
    Values values = unsharpMask(layers.depth[0], width);
    if (const double c = correlation(values, truth); c > best) {
      best = c;
      mask = std::move(values);
    }
  }
  print("ao_" + name + "_proxy", correlation(proxy, truth));
  print("ao_" + name + "_mask", best);
  writeValues("ao_" + name + "_truth", truth);
  writeValues("ao_" + name + "_proxy", proxy);
  writeValues("ao_" + name + "_mask", mask);
}

// --- enhancement ---------------------------------------------------------------------------------

/// Σ over planes of the length of the gradient, by the same differences as enhance.frag.
Values gradientSum(const std::vector<float>& planes) {
  Values sum(kSize.pixels(), 0.0);
  const int width = kSize.width, height = kSize.height;
  for (std::size_t first = 0; first < planes.size(); first += kSize.pixels()) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const auto at = [&](int i, int j) {
          return double(planes[first + std::size_t(j) * std::size_t(width) + std::size_t(i)]);
        };
        const int left = std::max(x - 1, 0), right = std::min(x + 1, width - 1),
                  up = std::max(y - 1, 0), down = std::min(y + 1, height - 1);
        const double dx = (at(right, y) - at(left, y)) / (right - left),
                     dy = (at(x, down) - at(x, up)) / (down - up);
        sum[std::size_t(y) * std::size_t(width) + std::size_t(x)] += std::hypot(dx, dy);
      }
    }
  }
  return sum;
}

/// r of eq. 11 by the explorer's own pass, so weak that nothing is clamped.
Values enhancementOf(gl::Device& device, const std::vector<float>& attenuation, int channels) {
  const std::size_t pixels = kSize.pixels();
  std::vector<float> r(4 * pixels);
  device.run([&] {
    const gl::Texture texture = gpu::textureArray(GL_RGBA32F, kSize, (channels + 3) / 4);
    for (int group = 0; 4 * group < channels; ++group) {
      std::vector<float> texels(4 * pixels, 0.0f);
      for (int k = 4 * group; k < std::min(channels, 4 * group + 4); ++k)
        for (std::size_t i = 0; i < pixels; ++i)
          texels[4 * i + std::size_t(k % 4)] = attenuation[std::size_t(k) * pixels + i];
      gpu::uploadLayer(texture, kSize, group, GL_RGBA, GL_FLOAT, texels.data());
    }
    EditPass pass;
    const gl::Texture made = pass.enhancement(texture, kSize, channels, 1e-3, 1.0);
    made.bind(0);
    gl::functions().GetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, r.data());
  });
  Values values(pixels);
  for (std::size_t i = 0; i < pixels; ++i) values[i] = double(r[4 * i]);
  return values;
}

void measureEnhancement(const std::shared_ptr<gl::Device>& device, const LayeredScene& subject) {
  const std::string name = subject.name;
  const Scene scene = namedScene(name, subject.size, sceneCache());
  MarchRequest request = subject.request(scene, kSize);
  request.attenuation = true;
  Marcher marcher(device);
  const RayImage plain = marchOnGpu(marcher, scene, request);
  // Light alone: what a white medium gives back of the headlight, 1.2 where it faces the viewer.
  request.attenuation = false;
  request.phong = true;
  request.base.setColormap(Colormap::fromSrgb("white", {glm::dvec3(1.0)}));
  const RayImage lit = marcher.march(request);

  const std::size_t pixels = kSize.pixels();
  Values truth(pixels, NAN);
  Values attenuation = enhancementOf(*device, plain.attenuation, plain.channels);
  Values image = gradientSum(plain.reference);
  for (std::size_t i = 0; i < pixels; ++i) {
    const double opacity = 1.0 - double(plain.transmittance[i]);
    if (opacity > 0.1) {
      truth[i] = 1.0 - double(lit.reference[i]) / (1.2 * opacity);
    } else {
      attenuation[i] = image[i] = NAN;
    }
  }
  print("enhance_" + name + "_attenuation", rankCorrelation(attenuation, truth));
  print("enhance_" + name + "_image", rankCorrelation(image, truth));
  writeValues("enhance_" + name + "_truth", truth);
  writeValues("enhance_" + name + "_attenuation", attenuation);
  writeValues("enhance_" + name + "_image", image);
}

}  // namespace
}  // namespace vestige::test

int main(int argc, char** argv) {
  using namespace vestige::test;
  return runBench("bench_effects", argc, argv, [](const auto& options, const auto& device) {
    if (options.wantsAny("ao_ct_")) measureOcclusion(device, "ct", 256, 300.0);
    if (options.wantsAny("ao_smooth_")) measureOcclusion(device, "smooth", 256, 0.6);
    for (const LayeredScene& scene : kLayeredScenes) {
      if (options.wantsAny(std::string("enhance_") + scene.name + "_"))
        measureEnhancement(device, scene);
    }
  });
}
