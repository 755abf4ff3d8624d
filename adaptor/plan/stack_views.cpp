// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/plan/stack_views.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "adaptor/common/adaptor_error.h"
#include "proxy/format/layout/proxy_layout.h"

namespace vestige {
namespace {

/// Point data have a sample on every face of the domain: the outermost rays stay inside by so much.
constexpr double kInside = 1e-5;

std::vector<double> evenDepths(const Camera& camera, const Box& domain, int slabs) {
  const DepthRange range = depthRange(camera, domain);
  std::vector<double> depths;
  for (int s = 0; s <= slabs; ++s)
    depths.push_back(std::lerp(range.low, range.high, double(s) / slabs));
  return depths;
}

/// The smallest distance between neighbouring samples along a coordinate axis; 0 = there are none.
double spacingAlong(const BlockSet& blocks, Location location, glm::dvec3 way) {
  const int axis = std::abs(way.x) > 0.5 ? 0 : std::abs(way.y) > 0.5 ? 1 : 2;
  double smallest = std::numeric_limits<double>::infinity();
  for (const auto& [index, block] : blocks.blocks()) {
    if (block.grid.empty()) continue;
    const auto nodes = block.nodes(location)[std::size_t(axis)];
    for (std::size_t i = 1; i < nodes.size(); ++i)
      smallest = std::min(smallest, nodes[i] - nodes[i - 1]);
  }
  return std::isfinite(smallest) ? smallest : 0.0;
}

StackView ownView(const SlicedConfig& sliced, View view, const BlockSet& blocks,
                  Location location) {
  const Box domain = blocks.domain();
  // A sample on each face makes one pixel more than there are distances between samples.
  const int onFaces = location == Location::Point ? 1 : 0;
  struct Side {
    int pixels;
    double pixel;  ///< world
  };
  const auto sideAlong = [&](glm::dvec3 way) -> Side {
    const double extent = glm::dot(domain.size(), glm::abs(way));
    const double spacing = spacingAlong(blocks, location, way);
    if (!(extent > 0.0) || !(spacing > 0.0)) return {1, 0.0};
    const double most = std::max(sliced.pixels - onFaces, 1);
    const double distances = std::clamp(std::nearbyint(extent / spacing), 1.0, most);
    return {std::min(int(distances) + onFaces, sliced.pixels), extent / distances};
  };
  Side across = sideAlong(view.camera.right()), upward = sideAlong(view.camera.up);
  // A domain that is flat that way has one pixel there, as wide as the other's.
  const double other = std::max({across.pixel, upward.pixel, 1e-6 * domain.diagonal()});
  if (across.pixel == 0.0) across.pixel = other;
  if (upward.pixel == 0.0) upward.pixel = other;
  const ImageSize size{across.pixels, upward.pixels};
  view.name = "stack-" + view.name;
  view.camera.viewHeight = size.height * upward.pixel * (onFaces ? 1.0 - kInside : 1.0);
  view.camera.pixelAspect = across.pixel / upward.pixel;
  return {std::move(view), size, {}};
}

}  // namespace

std::vector<StackView> stackViews(const SlicedConfig& sliced, ImageSize size,
                                  const std::vector<View>& views, const BlockSet& blocks,
                                  Location location) {
  std::vector<StackView> stacks;
  if (sliced.stacks == "views") {
    for (const View& view : views) stacks.push_back({view, size, {}});
  } else {
    // Opposite views of an axis hold the same.
    for (View& view : viewSet(sliced.stacks, blocks.domain(), 1.0)) {
      const bool opposite = std::any_of(stacks.begin(), stacks.end(), [&](const StackView& other) {
        return glm::dot(other.view.camera.forward, view.camera.forward) < -0.999;
      });
      if (!opposite) stacks.push_back(ownView(sliced, std::move(view), blocks, location));
    }
  }
  for (StackView& stack : stacks) {
    if (stack.view.camera.projection != Projection::Orthographic) {
      throw AdaptorError(VESTIGE_ERROR_CONFIG,
                         fmt::format("[sliced] stacks: view '{}' is not orthographic; slabs "
                                     "need a view that is",
                                     stack.view.name));
    }
    stack.depths = evenDepths(stack.view.camera, blocks.domain(), sliced.slabs);
  }
  return stacks;
}

}  // namespace vestige
