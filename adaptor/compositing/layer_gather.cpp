// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/compositing/layer_gather.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vestige {
namespace {}  // namespace

LightDepth::LightDepth(const Box& domain, glm::dvec3 direction)
    : depth(std::size_t(kSlices) * kSize.pixels()) {
  // Any up that is not along the light.
  const glm::dvec3 size = glm::abs(direction);
  const glm::dvec3 up =
      size.z <= size.x || size.z <= size.y ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0);
  camera = frameBox(domain, direction, up, kSize.aspect());
}

LayerGatherer::LayerGatherer(int layers, std::vector<float> transmittance)
    : layers_(layers),
      end_(std::move(transmittance)),
      front_(end_.size(), 1.0f),
      boundary_(std::size_t(layers + 1) * end_.size(), kInfinity),
      light_(3 * std::size_t(layers) * end_.size()) {}

LayerRequest LayerGatherer::request(const LightDepth* shadows) const {
  return {layers_, front_, end_, shadows};
}

void LayerGatherer::add(const LayerRays& block) {
  for (std::size_t i = 0; i < boundary_.size(); ++i)
    boundary_[i] = std::min(boundary_[i], block.boundary[i]);
  for (std::size_t i = 0; i < light_.size(); ++i) light_[i] += block.light[i];
  for (std::size_t i = 0; i < front_.size(); ++i) front_[i] *= std::exp(-block.tau[i]);
}

std::vector<float> LayerGatherer::light() const {
  const std::size_t pixels = end_.size();
  std::vector<float> sum(3 * pixels);
  for (std::size_t i = 0; i < light_.size(); ++i) sum[i % sum.size()] += light_[i];
  return sum;
}

AnalyticLayerPlanes LayerGatherer::planes(std::span<const float> exit) const {
  const std::size_t pixels = end_.size(), layers = std::size_t(layers_);
  AnalyticLayerPlanes planes{
      layers_, std::vector<float>((layers + 1) * pixels), std::vector<float>(3 * layers * pixels),
      std::vector<float>(layers * pixels), std::vector<AnalyticLayerState>(pixels)};
  for (std::size_t p = 0; p < pixels; ++p) {
    const bool saturated = end_[p] <= kSaturatedTransmittance;
    const double taken = 1.0 - std::max(double(end_[p]), kSaturatedTransmittance);
    // Without a first boundary nothing is known to be there.
    if (taken < kEmptyOpacity || boundary_[p] == kInfinity) continue;
    planes.state[p] = saturated ? AnalyticLayerState::Saturated : AnalyticLayerState::Whole;
    const auto transmittance = [&](std::size_t i) { return 1.0 - taken * double(i) / layers_; };
    float depth = boundary_[p];
    for (std::size_t i = 0; i <= layers; ++i) {
      // What rounding kept from being reached is at the far end.
      const float own = boundary_[i * pixels + p];
      depth = std::max(depth, own == kInfinity ? exit[p] : own);
      planes.boundary[i * pixels + p] = depth;
    }
    for (std::size_t i = 0; i < layers; ++i) {
      const double front = transmittance(i);
      planes.tau[i * pixels + p] = float(std::log(front / transmittance(i + 1)));
      for (std::size_t c = 3 * i; c < 3 * i + 3; ++c)
        planes.color[c * pixels + p] = float(double(light_[c * pixels + p]) / front);
    }
  }
  return planes;
}

}  // namespace vestige
