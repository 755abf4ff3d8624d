// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/transfer/colormap.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/common.hpp>

#include "proxy/base/error.h"
#include "proxy/base/nearest_word.h"
#include "proxy/transfer/colormap_tables.h"

namespace vestige {
namespace {

std::vector<glm::dvec3> colorsFromHex(std::string_view hex) {
  std::vector<glm::dvec3> colors(hex.size() / 6);
  for (std::size_t i = 0; i < 3 * colors.size(); ++i) {
    unsigned byte = 0;
    std::from_chars(hex.data() + 2 * i, hex.data() + 2 * i + 2, byte, 16);
    colors[i / 3][int(i % 3)] = byte / 255.0;
  }
  return colors;
}

double linearFromSrgb(double s) {
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

double srgbFromLinear(double l) {
  return l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1.0 / 2.4) - 0.055;
}

}  // namespace

Colormap Colormap::named(const std::string& name) {
  std::string_view base = name;
  const bool reversed = base.ends_with("_r");
  if (reversed) base.remove_suffix(2);
  if (base == "gray") base = "grey";
  for (const ColormapTable& table : colormapTables()) {
    if (table.name != base) continue;
    std::vector<glm::dvec3> colors = colorsFromHex(table.hexColors);
    if (reversed) std::reverse(colors.begin(), colors.end());
    return fromSrgb(std::string(base) + (reversed ? "_r" : ""), std::move(colors));
  }
  throw Error(ErrorCode::Config,
              fmt::format("no colour map is called '{}'{}; choose {}, each also with _r", name,
                          didYouMean(name, names()), fmt::join(names(), ", ")));
}

std::vector<std::string> Colormap::names() {
  std::vector<std::string> result;
  for (const ColormapTable& table : colormapTables()) result.emplace_back(table.name);
  return result;
}

Colormap Colormap::fromSrgb(std::string name, std::vector<glm::dvec3> colors) {
  if (colors.empty())
    throw Error(ErrorCode::InvalidArgument, fmt::format("colour map '{}' has no colour", name));
  for (const glm::dvec3& c : colors)
    for (int i = 0; i < 3; ++i)
      if (!(c[i] >= 0.0 && c[i] <= 1.0))
        throw Error(ErrorCode::InvalidArgument,
                    fmt::format("colour map '{}' has the component {}, not in [0, 1]", name, c[i]));
  Colormap map;
  map.name_ = std::move(name);
  map.colors_ = std::move(colors);
  return map;
}

glm::dvec3 Colormap::at(double t) const {
  // Written so that NaN falls to the low end.
  const double position = (t > 0.0 ? std::min(t, 1.0) : 0.0) * double(colors_.size() - 1);
  const std::size_t i = std::min(std::size_t(position), colors_.size() - 1);
  const std::size_t next = std::min(i + 1, colors_.size() - 1);
  return linearFromSrgb(glm::mix(colors_[i], colors_[next], position - double(i)));
}

glm::dvec3 linearFromSrgb(glm::dvec3 s) {
  return {linearFromSrgb(s.x), linearFromSrgb(s.y), linearFromSrgb(s.z)};
}

glm::dvec3 srgbFromLinear(glm::dvec3 l) {
  return {srgbFromLinear(l.x), srgbFromLinear(l.y), srgbFromLinear(l.z)};
}

}  // namespace vestige
