// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/volume/march_setup.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "proxy/base/error.h"

namespace vestige {
namespace {

constexpr float kGapEdge = 2e38f;  // as in march_field.glsl
constexpr int kMostGuesses = 4096;

/// A camera that looks along an axis up to rounding looks along it.
glm::dvec3 withoutDust(glm::dvec3 v) {
  for (int i = 0; i < 3; ++i) {
    if (std::abs(v[i]) < 1e-12) v[i] = 0.0;
  }
  return v;
}

}  // namespace

MarchFrame::MarchFrame(const Box& domain, const Camera& camera) : centre(domain.center()) {
  if (domain.diagonal() > 0.0) scale = domain.diagonal();
  depthOrigin = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 fromCamera = domain.corner(i) - camera.position;
    depthOrigin = std::min(depthOrigin, glm::dot(fromCamera, camera.forward));
  }
}

MarchRays::MarchRays(const MarchFrame& frame, const Camera& camera, ImageSize size) {
  const glm::dvec3 forward = withoutDust(camera.forward);
  const glm::dvec3 right = withoutDust(camera.right()), up = withoutDust(camera.up);
  const glm::dvec3 start = (camera.position - frame.centre) / frame.scale;
  const double z0 = frame.depthOrigin / frame.scale;
  firstDepth = float(-z0);
  if (camera.projection != Projection::Perspective) {
    if (camera.projection == Projection::MultiPerspective) lean = float(1.0 / camera.convergence);
    const double height = camera.viewHeight / frame.scale;
    origin = {start + z0 * forward, right * (height * camera.aspect(size)), up * -height};
    direction = {forward, glm::vec3(0.0f), glm::vec3(0.0f)};
  } else {
    const double height = 2.0 * std::tan(0.5 * camera.fieldOfView);
    const glm::dvec3 x = right * (height * camera.aspect(size)), y = up * -height;
    origin = {start + z0 * forward, z0 * x, z0 * y};
    direction = {forward, x, y};
  }
}

std::vector<glm::vec2> channelEdges(const IntervalPartition& partition,
                                    const PreintegratedTable* base) {
  std::vector<glm::vec2> edges = {{-kInfinity, 0.0f}};
  for (double bound : partition.bounds()) {
    const float value = float(partition.normalised(bound));
    edges.push_back({value, base ? base->integral(value) : 0.0f});
  }
  // The last interval is closed.
  edges.back().x = std::nextafter(edges.back().x, 2.0f);
  edges.push_back({kGapEdge, 0.0f});
  edges.push_back({kInfinity, 0.0f});
  return edges;
}

MarchAxis::MarchAxis(const std::vector<double>& nodes, double centre, double scale,
                     double domainLow) {
  const int count = int(nodes.size());
  if (count < 2) return;
  const double mean = (nodes.back() - nodes.front()) / (count - 1);
  double narrowest = mean;
  for (int i = 0; i + 1 < count; ++i) {
    const double place = nodes.front() + i * mean;
    even = even && std::abs(nodes[std::size_t(i)] - place) <= 1e-6 * mean;
    narrowest = std::min(narrowest, nodes[std::size_t(i) + 1] - nodes[std::size_t(i)]);
  }
  if (even) {
    // Blocks differ in a whole number, whatever the rounding of their nodes.
    const double offset = (nodes.front() - domainLow) / mean, whole = std::floor(offset + 1e-6);
    nodesFromLocal = float(scale / mean);
    nodesOrigin = float((centre - domainLow) / mean - (offset - whole));
    firstNode = float(whole);
    first = float((nodes.front() - centre) / scale);
    spacing = float(mean / scale);
    return;
  }
  const double range = nodes.back() - nodes.front();
  const int guesses = int(std::clamp(std::ceil(range / narrowest), 1.0, double(kMostGuesses)));
  const auto local = [&](double x) { return float((x - centre) / scale); };
  width = std::max(count, guesses);
  texels.assign(2 * std::size_t(width), glm::vec4(0.0f));
  for (int i = 0; i + 1 < count; ++i) {
    const double a = nodes[std::size_t(i)], b = nodes[std::size_t(i) + 1];
    texels[std::size_t(i)] = {local(a), float(scale / (b - a)), local(b), 0.0f};
  }
  int node = 0;
  for (int i = 0; i < guesses; ++i) {
    const double x = nodes.front() + range * i / guesses;
    while (node < count - 2 && nodes[std::size_t(node) + 1] <= x) ++node;
    texels[std::size_t(width + i)].x = float(node);
  }
  guess = {local(nodes.front()), float(guesses * scale / range), float(guesses)};
}

double marchStep(const MarchRequest& request, const BlockGrid& grid) {
  double step = request.stepLength;
  if (step == 0.0) {
    step = std::numeric_limits<double>::infinity();
    for (const auto& nodes : grid.nodes) {
      for (std::size_t i = 1; i < nodes.size(); ++i) step = std::min(step, nodes[i] - nodes[i - 1]);
    }
    if (!std::isfinite(step)) step = std::max(request.domain.diagonal(), 1e-300);
  }
  if (!(step > 0.0) || !std::isfinite(step) || request.domain.diagonal() > 1e6 * step) {
    throw Error(ErrorCode::InvalidArgument,
                "a step of " + std::to_string(step) + " along rays does not suit a domain of " +
                    std::to_string(request.domain.diagonal()) + " across");
  }
  return step;
}

}  // namespace vestige
