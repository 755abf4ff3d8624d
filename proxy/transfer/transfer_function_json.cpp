// SPDX-License-Identifier: BSD-3-Clause
// The text forms of transfer functions: JSON inside looks and archives, "v:o,v:o" on command lines.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "proxy/base/error.h"
#include "proxy/base/parse_number.h"
#include "proxy/transfer/transfer_function.h"

namespace vestige {
namespace {

using nlohmann::json;

constexpr std::array<std::string_view, 5> kKeys = {"opacity", "referenceLength", "colormap",
                                                   "colorRange", "factors"};
constexpr std::size_t kMaxColors = 4096;

[[noreturn]] void refuseJson(const std::string& sentence) {
  throw Error(ErrorCode::Config, "transfer function: " + sentence);
}

/// A short quotation of a value for a message. Containers are only named: they may be megabytes,
/// or nested deeply enough to overflow the stack of a recursive dump.
std::string excerpt(const json& value) {
  if (value.is_array()) return fmt::format("a list of {}", value.size());
  if (value.is_object()) return "an object";
  const std::string text = value.dump(-1, ' ', true, json::error_handler_t::replace);
  return text.size() <= 60 ? text : text.substr(0, 57) + "...";
}

double jsonNumber(const json& value, std::string_view key) {
  if (!value.is_number() || !std::isfinite(value.get<double>()))
    refuseJson(fmt::format("{} has {} where a finite number belongs", key, excerpt(value)));
  return value.get<double>();
}

const json& required(const json& object, std::string_view key) {
  const auto found = object.find(key);
  if (found == object.end()) refuseJson(fmt::format("{} is missing", key));
  return *found;
}

/// The array at `value`, of `least` to `most` elements.
const json& array(const json& value, std::string_view key, std::size_t least, std::size_t most) {
  if (!value.is_array())
    refuseJson(fmt::format("{} has {} where a list belongs", key, excerpt(value)));
  if (value.size() < least || value.size() > most)
    refuseJson(fmt::format("{} has a list of {}, not of {}..{}", key, value.size(), least, most));
  return value;
}

std::vector<OpacityPoint> opacityFromJson(const json& value) {
  std::vector<OpacityPoint> points;
  for (const json& pair : array(value, "opacity", 0, TransferFunction::kMaxOpacityPoints)) {
    array(pair, "opacity", 2, 2);
    points.push_back({jsonNumber(pair[0], "opacity"), jsonNumber(pair[1], "opacity")});
  }
  return points;
}

Colormap colormapFromJson(const json& value) {
  if (value.is_string()) {
    try {
      return Colormap::named(value.get<std::string>());
    } catch (const Error&) {
      std::string names;
      for (const std::string& name : Colormap::names()) names += (names.empty() ? "" : ", ") + name;
      refuseJson(fmt::format("colormap is {}; choose {}, each also with _r, or a list of [r, g, b]",
                             excerpt(value), names));
    }
  }
  std::vector<glm::dvec3> colors;
  for (const json& color : array(value, "colormap", 1, kMaxColors)) {
    array(color, "colormap", 3, 3);
    colors.emplace_back(jsonNumber(color[0], "colormap"), jsonNumber(color[1], "colormap"),
                        jsonNumber(color[2], "colormap"));
  }
  return Colormap::fromSrgb("custom", std::move(colors));
}

json toJson(const Colormap& map) {
  const std::vector<std::string> names = Colormap::names();
  std::string_view base = map.name();
  if (base.ends_with("_r")) base.remove_suffix(2);
  // A caller's own map may carry a built-in's name: only the colours tell.
  if (std::find(names.begin(), names.end(), base) != names.end() &&
      Colormap::named(map.name()).srgbColors() == map.srgbColors())
    return map.name();
  json colors = json::array();
  for (const glm::dvec3& c : map.srgbColors()) colors.push_back({c.x, c.y, c.z});
  return colors;
}

TransferFunction fromCheckedKeys(const json& object) {
  const json& range = array(required(object, "colorRange"), "colorRange", 2, 2);
  TransferFunction function(opacityFromJson(required(object, "opacity")),
                            jsonNumber(required(object, "referenceLength"), "referenceLength"),
                            colormapFromJson(required(object, "colormap")),
                            jsonNumber(range[0], "colorRange"), jsonNumber(range[1], "colorRange"));
  if (const auto factors = object.find("factors"); factors != object.end()) {
    std::vector<double> values;
    for (const json& f : array(*factors, "factors", 0, IntervalPartition::kMaxIntervals))
      values.push_back(jsonNumber(f, "factors"));
    function.setFactors(std::move(values));
  }
  return function;
}

}  // namespace

json toJson(const TransferFunction& function) {
  json opacity = json::array();
  for (const OpacityPoint& p : function.opacityPoints()) opacity.push_back({p.value, p.opacity});
  json result{{"opacity", std::move(opacity)},
              {"referenceLength", function.referenceLength()},
              {"colormap", toJson(function.colormap())},
              {"colorRange", {function.colorLow(), function.colorHigh()}}};
  if (!function.factors().empty()) result["factors"] = function.factors();
  return result;
}

TransferFunction transferFunctionFromJson(const json& object) {
  if (!object.is_object()) refuseJson(fmt::format("{} is no object", excerpt(object)));
  for (const auto& item : object.items())
    if (std::find(kKeys.begin(), kKeys.end(), item.key()) == kKeys.end())
      refuseJson(fmt::format("{} is no key of it", excerpt(item.key())));
  try {
    return fromCheckedKeys(object);
  } catch (const Error& e) {
    // What the class refuses also begins with the key.
    if (e.code() == ErrorCode::InvalidArgument) refuseJson(e.what());
    throw;
  }
}

std::vector<OpacityPoint> opacityFromText(const std::string& text) {
  const auto bad = [](std::string_view piece, std::string_view why) {
    throw Error(ErrorCode::Config, fmt::format("opacity '{}' {}", piece.substr(0, 60), why));
  };
  std::vector<OpacityPoint> points;
  for (std::string_view rest = text;;) {
    const std::string_view piece = rest.substr(0, rest.find(','));
    const auto colon = piece.find(':');
    if (colon == std::string_view::npos) bad(piece, "is not value:opacity");
    const auto value = parseNumber(piece.substr(0, colon));
    const auto opacity = parseNumber(piece.substr(colon + 1));
    if (!value || !opacity) bad(piece, "is not a pair of finite numbers value:opacity");
    if (*opacity < 0.0 || *opacity > 1.0) bad(piece, "is not in [0, 1]");
    if (points.size() == TransferFunction::kMaxOpacityPoints) bad(piece, "is one point too many");
    points.push_back({*value, *opacity});
    if (piece.size() == rest.size()) return points;
    rest.remove_prefix(piece.size() + 1);
  }
}

}  // namespace vestige
