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

/// The smallest distance between neighbouring samples along an axis; 0 = there are none.
double spacingAlong(const BlockSet& blocks, Location location, int axis) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const auto& [index, block] : blocks.blocks()) {
    if (block.grid.empty()) continue;
    const BlockGrid grid = blocks.marchGrid(index, location);
    const auto& nodes = grid.nodes[std::size_t(axis)];
    for (std::size_t i = 1; i < nodes.size(); ++i)
      smallest = std::min(smallest, nodes[i] - nodes[i - 1]);
  }
  return std::isfinite(smallest) ? smallest : 0.0;
}

/// The side of a pixel that covers as much as a sample does across the view; 0 = there are none.
double pixelOf(const BlockSet& blocks, Location location, glm::dvec3 forward) {
  double product = 1.0;
  int across = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double spacing =
        std::abs(forward[axis]) > 0.5 ? 0.0 : spacingAlong(blocks, location, axis);
    if (!(spacing > 0.0)) continue;
    product *= spacing;
    ++across;
  }
  return across == 0 ? 0.0 : std::pow(product, 1.0 / across);
}

StackView ownView(const SlicedConfig& sliced, View view, const BlockSet& blocks,
                  Location location) {
  const Box domain = blocks.domain();
  const glm::dvec3 extent = domain.size();
  const double width = std::abs(glm::dot(extent, glm::abs(view.camera.right())));
  const double height = std::abs(glm::dot(extent, glm::abs(view.camera.up)));
  // Pixels per side: a sample on each face makes one more than there are distances. The longer side
  // fits; the outermost pixels of the other may stand inside, or past the last cell.
  const int onFaces = location == Location::Point ? 1 : 0;
  const double longer = std::max(width, height);
  double pixel = pixelOf(blocks, location, view.camera.forward);
  if (!(pixel > 0.0)) pixel = longer;
  const double most = double(sliced.pixels - onFaces);
  const double along = std::clamp(std::nearbyint(longer / pixel), 1.0, std::max(most, 1.0));
  pixel = longer / along;
  const auto count = [&](double side) {
    const double pixels = side / pixel;
    return std::max(1,
                    onFaces ? int(std::floor(pixels + 1e-6)) + 1 : int(std::ceil(pixels - 1e-6)));
  };
  const ImageSize size{std::min(count(width), sliced.pixels),
                       std::min(count(height), sliced.pixels)};
  view.name = "stack-" + view.name;
  view.camera.viewHeight = size.height * pixel * (onFaces ? 1.0 - kInside : 1.0);
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
