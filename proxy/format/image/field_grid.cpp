// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/image/field_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "proxy/base/error.h"

namespace vestige {
namespace {

using nlohmann::json;

constexpr int kMostSamples = 1 << 16;  ///< along an axis

[[noreturn]] void refuseGrid(const std::string& reason) {
  throw Error(ErrorCode::Format, "attribute 'vestige:grid': " + reason);
}

double finite(const json& object, const char* key) {
  const double value = object.at(key).get<double>();
  if (!std::isfinite(value)) refuseGrid(fmt::format("{} is {}", key, value));
  return value;
}

FieldAxis axisFrom(const json& object) {
  FieldAxis axis;
  if (object.contains("nodes")) {
    axis.nodes = object.at("nodes").get<std::vector<double>>();
    axis.count = int(std::min<std::size_t>(axis.nodes.size(), kMostSamples + 1));
    const auto falls = std::adjacent_find(axis.nodes.begin(), axis.nodes.end(),
                                          [](double a, double b) { return !(a < b); });
    if (falls != axis.nodes.end())
      refuseGrid(fmt::format("its nodes do not rise after {}", *falls));
    for (const double node : axis.nodes)
      if (!std::isfinite(node)) refuseGrid(fmt::format("a node is at {}", node));
  } else {
    axis.count = object.at("count").get<int>();
    axis.first = finite(object, "first");
    axis.spacing = finite(object, "spacing");
    if (!(axis.spacing > 0.0)) refuseGrid(fmt::format("the spacing is {}", axis.spacing));
  }
  if (axis.count < 1 || axis.count > kMostSamples)
    refuseGrid(fmt::format("an axis has {} samples, not 1 to {}", axis.count, kMostSamples));
  return axis;
}

}  // namespace

json toJson(const FieldGrid& grid) {
  json axes = json::array();
  for (const FieldAxis& axis : grid.axes) {
    if (axis.nodes.empty())
      axes.push_back({{"count", axis.count}, {"first", axis.first}, {"spacing", axis.spacing}});
    else
      axes.push_back({{"nodes", axis.nodes}});
  }
  return {{"axes", axes},
          {"bytes", grid.bytes},
          {"codec", "zfp"},
          {"high", grid.high},
          {"low", grid.low},
          {"reduction", grid.reduction},
          {"tolerance", grid.tolerance}};
}

FieldGrid fieldGridFromJson(const json& object) try {
  FieldGrid grid;
  if (object.at("codec").get<std::string>() != "zfp")
    refuseGrid("its codec is '" + object.at("codec").get<std::string>() + "', not zfp");
  const json& axes = object.at("axes");
  if (!axes.is_array() || axes.size() != 3) refuseGrid("it does not have three axes");
  for (std::size_t a = 0; a < 3; ++a) grid.axes[a] = axisFrom(axes[a]);
  grid.reduction = object.at("reduction").get<int>();
  grid.low = finite(object, "low");
  grid.high = finite(object, "high");
  grid.tolerance = finite(object, "tolerance");
  if (!(grid.low < grid.high))
    refuseGrid(fmt::format("its range is {} .. {}", grid.low, grid.high));
  if (!(grid.tolerance > 0.0)) refuseGrid(fmt::format("its tolerance is {}", grid.tolerance));
  if (grid.reduction < 1) refuseGrid(fmt::format("its reduction is {}", grid.reduction));
  if (!object.at("bytes").is_number_unsigned()) refuseGrid("its bytes are no whole number >= 0");
  grid.bytes = object.at("bytes").get<std::size_t>();
  return grid;
} catch (const json::exception& e) {
  refuseGrid(e.what());
}

}  // namespace vestige
