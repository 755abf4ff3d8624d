// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/layout/analytic_layers_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "proxy/base/error.h"
#include "proxy/format/exr/exr_threads.h"
#include "proxy/format/image/storage_quantiser.h"
#include "proxy/format/layout/proxy_layout.h"
#include "proxy/format/layout/stored_planes.h"

namespace vestige {
namespace {

constexpr double kColorStep = 0x1p-12;
constexpr double kTauStep = 0x1p-12;
constexpr double kLayerDepthLevels = kHalfLevels - 1.0;  ///< level 0 stands for "empty"
constexpr double kMostTau = 15.0;  ///< more is as good as opaque; a half holds 2^-12 * 65504

const std::array<const char*, 3> kColors{"R", "G", "B"};

std::string layerName(int layer) { return fmt::format("layer{:02d}", layer); }
std::string tauName(int layer) { return fmt::format("t{:02d}", layer); }
std::string boundaryName(int boundary) { return fmt::format("z{:02d}", boundary); }

Channel halfChannel(std::string name, std::size_t pixels) {
  return {std::move(name), ChannelStorage::Half, std::vector<float>(pixels)};
}

/// Levels 1 .. kHalfLevels, rising by one at least.
void riseInLevels(std::array<double, kMostLayers + 1>& levels, int count) {
  double least = 1.0;
  for (int i = 0; i < count; ++i) {
    const double level = levels[std::size_t(i)];
    const double most = kHalfLevels - double(count - 1 - i);
    levels[std::size_t(i)] = least = std::clamp(std::nearbyint(level), least, most);
    least += 1.0;
  }
}

ProxyPart boundaryPart(const ProxyHeader& header, const AnalyticLayerPlanes& planes) {
  const std::size_t pixels = header.size.pixels();
  const int count = planes.layers + 1;
  const DepthRange range = depthRange(header.camera, header.domain);
  const double diagonal = header.domain.diagonal();
  const double extent = std::max({range.high - range.low, diagonal / 1e6, 1e-300});
  const double step = extent / kLayerDepthLevels, zero = range.low - step;
  const Quantiser depths(step, zero);
  // A boundary that is kept apart from its neighbours is off by a step for each of them.
  const double floatError = std::max(std::abs(range.low), std::abs(range.high)) * 0x1p-24;
  ProxyPart part{"boundaries", depths.unit(), zero, (0.5 + planes.layers) * step + floatError, {}};
  for (int i = 0; i < count; ++i) part.channels.push_back(halfChannel(boundaryName(i), pixels));
  std::array<double, kMostLayers + 1> levels{};
  for (std::size_t p = 0; p < pixels; ++p) {
    if (planes.state[p] == AnalyticLayerState::Empty) continue;
    for (int i = 0; i < count; ++i) {
      levels[std::size_t(i)] = (double(planes.boundary[std::size_t(i) * pixels + p]) - zero) / step;
    }
    riseInLevels(levels, count);
    for (int i = 0; i < count; ++i) {
      part.channels[std::size_t(i)].values[p] = depths.level(levels[std::size_t(i)]);
    }
  }
  return part;
}

/// Values >= 0 of pixels that are not empty.
Channel quantised(std::string name, const float* plane, const AnalyticLayerPlanes& planes,
                  double step, double most) {
  Channel channel = halfChannel(std::move(name), planes.state.size());
  const Quantiser quantise(step);
  for (std::size_t i = 0; i < planes.state.size(); ++i) {
    const double value = plane[i];
    if (value > 0.0 && planes.state[i] != AnalyticLayerState::Empty)
      channel.values[i] = quantise(std::min(value, most));
  }
  return channel;
}

}  // namespace

ProxyImage layeredImage(ProxyHeader header, const AnalyticLayerPlanes& planes) {
  header.kind = kind::kLayered;
  const ImageSize size = header.size;
  const int layers = planes.layers;
  if (layers < 1 || layers > kMostLayers)
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("the layered proxy of field '{}' has {} layers, not 1 to {}",
                            header.field, layers, kMostLayers));
  const auto k = std::size_t(layers);
  requirePlanes("boundary", planes.boundary.size(), k + 1, size);
  requirePlanes("color", planes.color.size(), 3 * k, size);
  requirePlanes("tau", planes.tau.size(), k, size);
  requirePlanes("state", planes.state.size(), 1, size);

  const std::size_t pixels = size.pixels();
  ProxyImage image;
  image.parts.resize(k);
  ProxyPart tau{"tau", kTauStep / kHalfQuantum, 0.0, 0x1p-8, std::vector<Channel>(k)};
  // Light beyond white, as highlights may have it, is kept up to a half's range.
  constexpr double kMostLight = 60000.0 * kColorStep;
  for (std::size_t i = 0; i < k; ++i)
    image.parts[i] = {layerName(int(i)), kColorStep / kHalfQuantum, 0.0, 2.0 * kColorStep,
                      std::vector<Channel>(3)};
  forEachOnExrThreads(int(4 * k), [&](int task) {
    const auto layer = std::size_t(task) / 4, c = std::size_t(task) % 4;
    if (c == 3) {
      tau.channels[layer] = quantised(tauName(int(layer)), planes.tau.data() + layer * pixels,
                                      planes, kTauStep, kMostTau);
    } else {
      image.parts[layer].channels[c] =
          quantised(kColors[c], planes.color.data() + (3 * layer + c) * pixels, planes, kColorStep,
                    kMostLight);
    }
  });
  image.parts.push_back(std::move(tau));
  image.parts.push_back(boundaryPart(header, planes));
  ProxyPart state{"state", 1.0 / kHalfQuantum, 0.0, 0.0, {halfChannel("state", pixels)}};
  for (std::size_t i = 0; i < pixels; ++i)
    state.channels[0].values[i] = float(int(planes.state[i]));
  image.parts.push_back(std::move(state));
  image.header = std::move(header);
  return image;
}

int layersOf(const ProxyImage& image) {
  const ProxyPart* tau = image.find("tau");
  return tau ? int(tau->channels.size()) : 0;
}

AnalyticLayerPlanes layeredPlanes(const ProxyImage& image) {
  AnalyticLayerPlanes planes;
  planes.layers = layersOf(image);
  if (planes.layers < 1 || planes.layers > kMostLayers)
    throw Error(ErrorCode::Format,
                fmt::format("the {} proxy of field '{}' has {} layers, not 1 "
                            "to {}",
                            image.header.kind, image.header.field, planes.layers, kMostLayers));
  if (image.header.camera.projection == Projection::MultiPerspective)
    throw Error(ErrorCode::Format, fmt::format("the {} proxy of field '{}' is multi-perspective",
                                               image.header.kind, image.header.field));
  const auto append = [&](std::vector<float>& to, const std::string& part,
                          const std::string& channel) {
    const std::vector<float>& values = image.channel(part, channel).values;
    to.insert(to.end(), values.begin(), values.end());
  };
  for (int i = 0; i < planes.layers; ++i) {
    for (const char* color : kColors) append(planes.color, layerName(i), color);
    append(planes.tau, "tau", tauName(i));
  }
  for (int i = 0; i <= planes.layers; ++i) append(planes.boundary, "boundaries", boundaryName(i));
  for (const float state : image.channel("state", "state").values)
    planes.state.push_back(AnalyticLayerState(int(state)));
  return planes;
}

}  // namespace vestige
