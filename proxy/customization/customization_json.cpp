// SPDX-License-Identifier: BSD-3-Clause
// Customisations as JSON: in looks, and of TOML tables in situ.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "proxy/customization/customization.h"
#include "proxy/base/json_object.h"

namespace vestige {
namespace {

using nlohmann::json;

const std::vector<std::pair<const char*, SeedMetric>> kMetrics{
    {"euclidean", SeedMetric::Euclidean}, {"manhattan", SeedMetric::Manhattan}};

void requireRange(const JsonObject& object, const char* key, double value, double low,
                  double high) {
  if (std::isfinite(value) && value >= low && value <= high) return;
  object.fail(key, fmt::format("is {}, it must be in [{}, {}]", value, low, high));
}

glm::dvec3 readVector(JsonObject& object, const char* key, glm::dvec3 value) {
  if (!object.find(key)) return value;
  std::vector<double> numbers;
  object.read(key, numbers);
  if (numbers.size() != 3)
    object.fail(key, fmt::format("must hold 3 numbers, not {}", numbers.size()));
  for (const double number : numbers)
    if (!std::isfinite(number)) object.fail(key, "must hold finite numbers");
  return {numbers[0], numbers[1], numbers[2]};
}

std::vector<OpacityPoint> readOpacity(JsonObject& object) {
  std::vector<OpacityPoint> points;
  const json& list = *object.find("opacity");
  if (!list.is_array()) object.fail("opacity", "must be a list of [value, opacity] pairs");
  for (const json& pair : list) {
    if (!pair.is_array() || pair.size() != 2 || !pair[0].is_number() || !pair[1].is_number())
      object.fail("opacity", "holds " + pair.dump() + ", not a [value, opacity] pair");
    points.push_back({pair[0].get<double>(), pair[1].get<double>()});
    requireRange(object, "opacity", points.back().opacity, 0.0, 1.0);
  }
  return points;
}

BlendFunction readFunction(JsonObject object) {
  BlendFunction function;
  if (object.find("opacity")) function.opacity = readOpacity(object);
  if (object.find("referenceLength")) {
    object.read("referenceLength", function.referenceLength.emplace());
    if (!(*function.referenceLength > 0.0 && std::isfinite(*function.referenceLength))) {
      object.fail("referenceLength",
                  fmt::format("is {}, it must be above 0", *function.referenceLength));
    }
  }
  object.read("colormap", function.colormap);
  if (object.find("colorRange")) {
    std::vector<double> range;
    object.read("colorRange", range);
    if (range.size() != 2 || !(range[0] < range[1]))
      object.fail("colorRange", "must be two numbers, the first below the second");
    function.colorRange = {range[0], range[1]};
  }
  object.finish();
  try {
    function.over(TransferFunction({}, 1.0, Colormap::named("viridis"), 0.0, 1.0));
  } catch (const Error& error) {
    object.fail(function.opacity ? "opacity" : "colormap",
                std::string("makes no function: ") + error.what());
  }
  return function;
}

/// `owner`: as in customizationFromJson.
SeedParameters readParameters(JsonObject& object, const std::string& owner) {
  SeedParameters p;
  object.read("opacity", p.opacity);
  requireRange(object, "opacity", p.opacity, 0.0, 1000.0);
  object.read("gamma", p.gamma);
  requireRange(object, "gamma", p.gamma, 0.01, 100.0);
  p.shift = readVector(object, "shift", p.shift);
  for (int c = 0; c < 3; ++c) requireRange(object, "shift", p.shift[c], -1.0, 1.0);
  if (const json* function = object.find("function")) {
    p.function = readFunction(JsonObject(*function, object.pathOf("function"), owner));
    p.blend = 1.0;
  }
  object.read("blend", p.blend);
  requireRange(object, "blend", p.blend, 0.0, 1.0);
  if (p.blend > 0.0 && !p.function) object.fail("blend", "needs a 'function' to blend to");
  return p;
}

void readCorners(JsonObject& object, Customization& result, const std::string& owner) {
  const json* corners = object.find("corners");
  if (!corners) return;
  const std::string path = object.pathOf("corners");
  if (corners->is_array() && corners->size() != result.corners.size()) {
    object.fail("corners", fmt::format("lists {} corners, not 8: x low and high, then y, then z",
                                       corners->size()));
  }
  for (std::size_t i = 0; i < result.corners.size(); ++i) {
    const bool each = corners->is_array();
    JsonObject corner(each ? (*corners)[i] : *corners, each ? fmt::format("{}[{}]", path, i) : path,
                      owner);
    result.corners[i] = readParameters(corner, owner);
    corner.finish();
  }
}

json jsonOf(const BlendFunction& function) {
  json result = json::object();
  if (function.opacity) {
    result["opacity"] = json::array();
    for (const OpacityPoint& p : *function.opacity)
      result["opacity"].push_back({p.value, p.opacity});
  }
  if (function.referenceLength) result["referenceLength"] = *function.referenceLength;
  if (!function.colormap.empty()) result["colormap"] = function.colormap;
  if (function.colorRange)
    result["colorRange"] = {function.colorRange->first, function.colorRange->second};
  return result;
}

/// What is not the default.
json jsonOf(const SeedParameters& p) {
  json result = json::object();
  if (p.opacity != 1.0) result["opacity"] = p.opacity;
  if (p.gamma != 1.0) result["gamma"] = p.gamma;
  if (p.shift != glm::dvec3(0.0)) result["shift"] = {p.shift.r, p.shift.g, p.shift.b};
  if (p.function) {
    result["function"] = jsonOf(*p.function);
    result["blend"] = p.blend;
  }
  return result;
}

}  // namespace

Customization customizationFromJson(const json& source, const std::string& path,
                                    const std::string& owner) {
  Customization result;
  JsonObject object(source, path, owner);
  double resolution = result.resolution;
  object.read("resolution", resolution);
  requireRange(object, "resolution", resolution, 32, kMostNodes);
  result.resolution = int(resolution);
  if (result.resolution != resolution) object.fail("resolution", "must be a whole number");
  object.readName("metric", kMetrics, result.metric);
  readCorners(object, result, owner);
  for (JsonObject& entry : object.list("seeds")) {
    SeedPrimitive& seed = result.seeds.emplace_back();
    entry.read("name", seed.name);
    entry.read("enabled", seed.enabled);
    if (!entry.find("position")) entry.fail("position", "is missing");
    seed.position = readVector(entry, "position", seed.position);
    seed.extent = readVector(entry, "extent", seed.extent);
    for (int axis = 0; axis < 3; ++axis)
      requireRange(entry, "extent", seed.extent[axis], 0.0, 1e300);
    seed.parameters = readParameters(entry, owner);
    entry.finish();
  }
  if (result.seeds.size() > Customization::kMaxPrimitives) {
    object.fail("seeds", fmt::format("lists {} seeds, at most {}", result.seeds.size(),
                                     Customization::kMaxPrimitives));
  }
  if (result.functions().size() > Customization::kMaxFunctions) {
    object.fail("seeds", fmt::format("blend to {} different functions, at most {}",
                                     result.functions().size(), Customization::kMaxFunctions));
  }
  object.finish();
  return result;
}

json toJson(const Customization& customization) {
  json result{
      {"resolution", customization.resolution},
      {"metric", customization.metric == SeedMetric::Euclidean ? "euclidean" : "manhattan"}};
  result["seeds"] = json::array();
  for (const SeedPrimitive& seed : customization.seeds) {
    json entry = jsonOf(seed.parameters);
    if (!seed.name.empty()) entry["name"] = seed.name;
    if (!seed.enabled) entry["enabled"] = false;
    entry["position"] = {seed.position.x, seed.position.y, seed.position.z};
    if (seed.extent != glm::dvec3(0.0))
      entry["extent"] = {seed.extent.x, seed.extent.y, seed.extent.z};
    result["seeds"].push_back(std::move(entry));
  }
  result["corners"] = json::array();
  for (const SeedParameters& corner : customization.corners)
    result["corners"].push_back(jsonOf(corner));
  return result;
}

}  // namespace vestige
