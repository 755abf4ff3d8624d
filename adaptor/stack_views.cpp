// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/stack_views.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "adaptor/adaptor_error.h"
#include "proxy/proxy_layout.h"

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

/// The smallest distance between neighbouring samples along the axes across `forward`; 0 = there
/// are none.
double spacingAcross(const BlockSet& blocks, Location location, glm::dvec3 forward) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const auto& [index, block] : blocks.blocks()) {
    if (block.grid.empty()) continue;
    const BlockGrid grid = blocks.marchGrid(index, location);
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(forward[axis]) > 0.5) continue;
      const auto& nodes = grid.nodes[std::size_t(axis)];
      for (std::size_t i = 1; i < nodes.size(); ++i)
        smallest = std::min(smallest, nodes[i] - nodes[i - 1]);
    }
  }
  return std::isfinite(smallest) ? smallest : 0.0;
}

StackView ownView(const SlicedConfig& sliced, View view, const BlockSet& blocks,
                  Location location) {
  const Box domain = blocks.domain();
  const glm::dvec3 extent = domain.size();
  const double width = std::abs(glm::dot(extent, glm::abs(view.camera.right())));
  const double height = std::abs(glm::dot(extent, glm::abs(view.camera.up)));
  const bool onFaces = location == Location::Point;
  const double spacing = spacingAcross(blocks, location, view.camera.forward);
  double pitch = spacing > 0.0 ? spacing : std::max(width, height);
  const auto count = [&](double side) {
    return int(std::min(std::nearbyint(side / pitch) + (onFaces ? 1.0 : 0.0), 1e6));
  };
  ImageSize size{std::max(1, count(width)), std::max(1, count(height))};
  double shrink = onFaces ? 1.0 - kInside : 1.0;
  if (std::max(size.width, size.height) > sliced.pixels) {
    pitch = std::max(width, height) / sliced.pixels;
    // Less than a pixel too many where the other side is no whole number of them.
    const auto fitting = [&](double side) {
      return std::clamp(int(std::ceil(side / pitch - 1e-6)), 1, sliced.pixels);
    };
    size = {fitting(width), fitting(height)};
    shrink = 1.0;
  }
  view.name = "stack-" + view.name;
  view.camera.viewHeight = size.height * pitch * shrink;
  return {std::move(view), size, {}};
}

}  // namespace

std::vector<StackView> stackViews(const Config& config, const std::vector<View>& views,
                                  const BlockSet& blocks, Location location) {
  if (!config.sliced) return {};
  const SlicedConfig& sliced = *config.sliced;
  std::vector<StackView> stacks;
  if (sliced.stacks == "views") {
    for (const View& view : views) stacks.push_back({view, config.size, {}});
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
                         fmt::format("[sliced] stacks: view '{}' is perspective; slabs need an "
                                     "orthographic one",
                                     stack.view.name));
    }
    stack.depths = evenDepths(stack.view.camera, blocks.domain(), sliced.slabs);
  }
  return stacks;
}

}  // namespace vestige
