// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/picture/look.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "proxy/base/error.h"
#include "proxy/base/nearest_word.h"

namespace vestige {
namespace {

void require(bool condition, const char* key, double value, const char* range) {
  if (condition) return;
  char text[64];
  std::snprintf(text, sizeof text, "%g", value);
  throw Error(ErrorCode::Config,
              std::string("look key '") + key + "' is " + text + ", it must be " + range);
}

void requireRange(const char* key, double value, double low, double high) {
  char range[96];
  std::snprintf(range, sizeof range, "in [%g, %g]", low, high);
  require(std::isfinite(value) && value >= low && value <= high, key, value, range);
}

void validateFunction(const Look& look) {
  if (look.opacity) {
    for (const OpacityPoint& point : *look.opacity) {
      require(std::isfinite(point.value), "opacity", point.value, "finite");
      requireRange("opacity", point.opacity, 0.0, 1.0);
    }
  }
  if (look.referenceLength) {
    require(std::isfinite(*look.referenceLength) && *look.referenceLength > 0.0, "referenceLength",
            *look.referenceLength, "above 0");
  }
  if (!look.colormap.empty()) Colormap::named(look.colormap);
  if (look.colorRange) {
    const auto& [low, high] = *look.colorRange;
    require(std::isfinite(low) && std::isfinite(high) && low < high, "colorRange", high,
            "two finite numbers, the first below the second");
  }
  for (double factor : look.factors) {
    require(std::isfinite(factor) && factor >= 0.0, "factors", factor, "0 or more");
  }
}

void validateGrid(const Look& look) {
  if (look.isosurfaces.size() > 8) {
    throw Error(ErrorCode::Config, "look key 'isosurfaces' holds " +
                                       std::to_string(look.isosurfaces.size()) +
                                       " surfaces, at most 8");
  }
  for (const SurfaceLook& surface : look.isosurfaces) {
    require(std::isfinite(surface.value), "isosurfaces", surface.value, "finite");
    requireRange("isosurfaces", surface.opacity, 0.0, 1.0);
    if (!surface.color.empty() && surface.color != "map" && !colorFromHex(surface.color)) {
      throw Error(ErrorCode::Config, "look key 'isosurfaces' has the colour '" + surface.color +
                                         "'; choices: #rrggbb, map");
    }
  }
  if (look.slice) {
    for (int i = 0; i < 4; ++i) {
      require(std::isfinite((*look.slice)[i]), "slice", (*look.slice)[i], "finite");
    }
    require(glm::length(glm::dvec3(*look.slice)) > 0.0, "slice", 0.0, "a normal of some length");
  }
  for (int i = 0; look.clip && i < 3; ++i) {
    const double low = look.clip->low[i], high = look.clip->high[i];
    require(std::isfinite(low) && std::isfinite(high) && low < high, "clip", high,
            "finite and above the low corner");
  }
}

void validateFraming(const Look& look) {
  for (const Rotation& rotation : look.frameFor) {
    for (const double angle : {rotation.azimuth, rotation.elevation, rotation.roll})
      requireRange("frameFor", angle, -360.0, 360.0);
  }
  requireRange("zoom", look.zoom, 1e-3, 1e6);
  for (const double shift : {look.pan.x, look.pan.y}) requireRange("pan", shift, -1e6, 1e6);
  for (int i = 0; look.center && i < 3; ++i)
    require(std::isfinite((*look.center)[i]), "center", (*look.center)[i], "finite");
  for (int i = 0; i < 3; ++i) requireRange("scale", look.scale[i], 1e-9, 1e9);
}

/// Learned colours are those of the run: no key may ask for others.
void validateColoring(const Look& look) {
  if (look.color != Coloring::Learned) return;
  const std::pair<const char*, bool> keys[] = {
      {"source", look.source != Source::Auto && look.source != Source::Volume},
      {"draw", look.draw != Draw::Volume},
      {"clip", look.clip.has_value()},
      {"rotate", !look.rotate.isZero()},
      {"scale", look.isStretched()},
      {"colormap", !look.colormap.empty()},
      {"customization", look.customization.has_value()},
      {"colorRange", look.colorRange.has_value()},
      {"via", look.via != Via::Auto},
      {"order", look.order != Order::Auto},
      {"shading", look.isLit()},
      {"ao", look.ao.on}};
  for (const auto& [key, other] : keys) {
    if (!other) continue;
    throw Error(ErrorCode::Config,
                std::string("look key '") + key +
                    "' does not go with learned colours: they are those of the run's own pictures "
                    "of a stored view, light included");
  }
}

void validateLight(const Look& look) {
  if (look.lights.size() > 8) {
    throw Error(ErrorCode::Config, "look key 'lights' holds " + std::to_string(look.lights.size()) +
                                       " lights, at most 8");
  }
  for (const Light& light : look.lights) {
    requireRange("lights.azimuth", light.azimuth, -360.0, 360.0);
    requireRange("lights.elevation", light.elevation, -360.0, 360.0);
    requireRange("lights.intensity", light.intensity, 0.0, 100.0);
  }
  requireRange("material.ambient", look.material.ambient, 0.0, 10.0);
  requireRange("material.diffuse", look.material.diffuse, 0.0, 10.0);
  requireRange("material.specular", look.material.specular, 0.0, 10.0);
  requireRange("material.shininess", look.material.shininess, 1.0, 1000.0);
}

}  // namespace

void Look::validate() const {
  if (cycle && time) {
    throw Error(ErrorCode::Config, "look keys 'cycle' and 'time' exclude each other");
  }
  if (time) require(std::isfinite(*time), "time", *time, "finite");
  if (size) {
    requireRange("size", size->width, 1, 16384);
    requireRange("size", size->height, 1, 16384);
  }
  requireRange("rotate", rotate.azimuth, -360.0, 360.0);
  requireRange("rotate", rotate.elevation, -360.0, 360.0);
  requireRange("rotate", rotate.roll, -360.0, 360.0);
  validateGrid(*this);
  validateFraming(*this);
  validateFunction(*this);
  validateLight(*this);
  validateColoring(*this);
  requireRange("ao.strength", ao.strength, 0.0, 10.0);
  require(ao.radius > 0.0 && ao.radius <= 1.0, "ao.radius", ao.radius, "in (0, 1]");
  requireRange("enhance.lambda", enhance.lambda, 0.0, 1e6);
  require(enhance.gamma > 0.0 && enhance.gamma <= 10.0, "enhance.gamma", enhance.gamma,
          "in (0, 10]");
  if (background) {
    for (int c = 0; c < 3; ++c) requireRange("background", (*background)[c], 0.0, 1.0);
  }
}

std::optional<glm::dvec3> colorFromHex(const std::string& text) {
  unsigned red = 0, green = 0, blue = 0;
  int used = 0;
  if (text.size() == 7 && text.find_first_not_of("0123456789abcdefABCDEF", 1) == text.npos &&
      std::sscanf(text.c_str(), "#%2x%2x%2x%n", &red, &green, &blue, &used) == 3 && used == 7) {
    return glm::dvec3(red, green, blue) / 255.0;
  }
  return std::nullopt;
}

std::optional<glm::dvec3> backgroundFromText(const std::string& text) {
  if (text == "transparent") return std::nullopt;
  if (text == "black") return glm::dvec3(0.0);
  if (text == "white") return glm::dvec3(1.0);
  if (text == "grey" || text == "gray") return glm::dvec3(0.5);
  if (const auto color = colorFromHex(text)) return color;
  throw Error(ErrorCode::Config, "look key 'background' is '" + text +
                                     "'; choices: black, white, grey, transparent, #rrggbb" +
                                     didYouMean(text, {"black", "white", "grey", "transparent"}));
}

std::string textFromBackground(const std::optional<glm::dvec3>& background) {
  if (!background) return "transparent";
  if (*background == glm::dvec3(0.0)) return "black";
  if (*background == glm::dvec3(1.0)) return "white";
  const auto byte = [](double v) { return unsigned(std::lround(255.0 * v)); };
  char text[8];
  std::snprintf(text, sizeof text, "#%02x%02x%02x", byte(background->x) & 255u,
                byte(background->y) & 255u, byte(background->z) & 255u);
  return text;
}

}  // namespace vestige
