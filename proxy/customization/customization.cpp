// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/customization/customization.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <map>
#include <tuple>

#include "proxy/base/error.h"

namespace vestige {
namespace {

constexpr int kCoarse = 32;

bool isNeutral(const SeedParameters& p) {
  return p.opacity == 1.0 && p.gamma == 1.0 && p.shift == glm::dvec3(0.0) && p.blend == 0.0;
}

/// All that may count somewhere: of the corners and the enabled seeds.
std::vector<const SeedParameters*> used(const Customization& customization) {
  std::vector<const SeedParameters*> result;
  for (const SeedParameters& corner : customization.corners) result.push_back(&corner);
  for (const SeedPrimitive& seed : customization.seeds)
    if (seed.enabled) result.push_back(&seed.parameters);
  return result;
}

NodeValues nodeValues(const SeedParameters& p, const std::vector<BlendFunction>& functions) {
  NodeValues values{float(p.opacity), float(p.shift.r), float(p.shift.g), float(p.shift.b),
                    float(p.gamma)};
  if (p.blend > 0.0 && p.function) {
    const auto at = std::find(functions.begin(), functions.end(), *p.function);
    values[std::size_t(5 + (at - functions.begin()))] = float(p.blend);
  }
  return values;
}

glm::ivec3 gridNodes(int resolution, const Box& box) {
  const glm::dvec3 size = box.size();
  const double longest = std::max({size.x, size.y, size.z});
  if (!(longest > 0.0 && std::isfinite(longest))) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("a box of {} x {} x {} has no room for seeds", size.x, size.y, size.z));
  }
  glm::ivec3 nodes;
  for (int axis = 0; axis < 3; ++axis) {
    const int cells = int(std::lround((resolution - 1) * size[axis] / longest));
    nodes[axis] = size[axis] > 0.0 ? std::max(cells, 1) + 1 : 1;
  }
  return nodes;
}

/// In units of nodes, within the grid.
glm::dvec3 nodeFromWorld(const Box& box, glm::ivec3 nodes, glm::dvec3 world) {
  glm::dvec3 at{0.0};
  for (int axis = 0; axis < 3; ++axis) {
    const double size = box.size()[axis];
    if (size > 0.0) at[axis] = (world[axis] - box.low[axis]) / size * (nodes[axis] - 1);
  }
  return glm::clamp(at, glm::dvec3(0.0), glm::dvec3(nodes - 1));
}

}  // namespace

TransferFunction BlendFunction::over(const TransferFunction& base) const {
  return TransferFunction(opacity.value_or(base.opacityPoints()),
                          referenceLength.value_or(base.referenceLength()),
                          colormap.empty() ? base.colormap() : Colormap::named(colormap),
                          colorRange ? colorRange->first : base.colorLow(),
                          colorRange ? colorRange->second : base.colorHigh());
}

bool Customization::isNeutral() const {
  const auto all = used(*this);
  return std::all_of(all.begin(), all.end(),
                     [](const SeedParameters* p) { return vestige::isNeutral(*p); });
}

bool Customization::hasGamma() const {
  const auto all = used(*this);
  return std::any_of(all.begin(), all.end(),
                     [](const SeedParameters* p) { return p->gamma != 1.0; });
}

std::vector<BlendFunction> Customization::functions() const {
  std::vector<BlendFunction> result;
  for (const SeedParameters* p : used(*this)) {
    if (!p->function || p->blend == 0.0) continue;
    if (std::find(result.begin(), result.end(), *p->function) == result.end())
      result.push_back(*p->function);
  }
  return result;
}

std::vector<SeedPoint> Customization::points(const Box& box) const {
  std::vector<SeedPoint> result;
  for (int i = 0; i < 8; ++i) result.push_back({box.corner(i), -1, corners[std::size_t(i)]});
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const SeedPrimitive& seed = seeds[i];
    if (!seed.enabled) continue;
    if (glm::clamp(seed.position, box.low, box.high) != seed.position) {
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("seed {}{} stands at {}, {}, {}, outside the domain from {}, {}, {} "
                              "to {}, {}, {}",
                              i, seed.name.empty() ? "" : " '" + seed.name + "'", seed.position.x,
                              seed.position.y, seed.position.z, box.low.x, box.low.y, box.low.z,
                              box.high.x, box.high.y, box.high.z));
    }
    const Box primitive{seed.position - 0.5 * seed.extent, seed.position + 0.5 * seed.extent};
    for (int corner = 0; corner < 8; ++corner) {
      // Along a side of length 0, both ends are one.
      bool again = false;
      for (int axis = 0; axis < 3; ++axis)
        again = again || ((corner >> axis & 1) && seed.extent[axis] == 0.0);
      if (again) continue;
      result.push_back(
          {glm::clamp(primitive.corner(corner), box.low, box.high), int(i), seed.parameters});
    }
  }
  return result;
}

Customization Customization::coarse() const {
  Customization result = *this;
  result.resolution = std::min(resolution, kCoarse);
  return result;
}

SeedGrid seedGrid(const Customization& customization, const Box& box) {
  SeedGrid grid;
  grid.nodes = gridNodes(customization.resolution, box);
  grid.metric = customization.metric;
  const std::vector<BlendFunction> functions = customization.functions();
  std::map<std::tuple<int, int, int>, std::size_t> taken;
  for (const SeedPoint& point : customization.points(box)) {
    const glm::ivec3 node(glm::round(nodeFromWorld(box, grid.nodes, point.position)));
    const NodeValues values = nodeValues(point.parameters, functions);
    auto row = std::find(grid.rows.begin(), grid.rows.end(), values);
    if (row == grid.rows.end()) row = grid.rows.insert(row, values);
    const GridSeed seed{node, int(row - grid.rows.begin())};
    const auto [at, isNew] = taken.try_emplace({node.x, node.y, node.z}, grid.seeds.size());
    if (isNew) {
      grid.seeds.push_back(seed);
    } else {
      grid.seeds[at->second] = seed;
    }
  }
  return grid;
}

CustomVolume::CustomVolume(const Box& box_, const SeedGrid& grid,
                           const std::vector<NodeValues>& nodeValues)
    : box(box_), nodes(grid.nodes) {
  for (const NodeValues& v : nodeValues) {
    optics.emplace_back(v[0], v[1], v[2], v[3]);
    values.emplace_back(v[4], v[5], v[6], v[7]);
  }
}

LocalParameters CustomVolume::at(glm::dvec3 world) const {
  const glm::dvec3 place = nodeFromWorld(box, nodes, world);
  const glm::ivec3 before = glm::clamp(glm::ivec3(place), glm::ivec3(0), glm::max(nodes - 2, 0));
  const glm::dvec3 share = place - glm::dvec3(before);
  glm::dvec4 sums[2] = {glm::dvec4(0.0), glm::dvec4(0.0)};
  for (int corner = 0; corner < 8; ++corner) {
    const glm::ivec3 side(corner & 1, corner >> 1 & 1, corner >> 2);
    const glm::ivec3 node = glm::min(before + side, nodes - 1);
    double weight = 1.0;
    for (int axis = 0; axis < 3; ++axis) weight *= side[axis] ? share[axis] : 1.0 - share[axis];
    const auto i = std::size_t((node.z * nodes.y + node.y) * nodes.x + node.x);
    sums[0] += weight * glm::dvec4(optics[i]);
    sums[1] += weight * glm::dvec4(values[i]);
  }
  const glm::vec4 o(sums[0]), v(sums[1]);
  return {o.x, {o.y, o.z, o.w}, v.x, {v.y, v.z, v.w}};
}

CustomVolume customVolume(const Customization& customization, const Box& box, int threads) {
  const SeedGrid grid = seedGrid(customization, box);
  return {box, grid, naturalNeighbours(grid.nodes, grid.seeds, grid.rows, grid.metric, threads)};
}

}  // namespace vestige
