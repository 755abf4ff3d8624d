// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/renderer/look_warnings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "explorer/annotation/ticks.h"
#include "explorer/volume/surface_palette.h"

namespace vestige {
namespace {

bool isAny(Answer answer, std::initializer_list<Answer> these) {
  return std::find(these.begin(), these.end(), answer) != these.end();
}

/// Why keys have no part in what is drawn.
const char* reasonOf(const Look& look, Answer answer) {
  switch (answer) {
    case Answer::Reference:
      return "the run's own picture is used, whose opacity, colour and light cannot be changed";
    case Answer::Layered:
      return "piecewise-analytic layers are used, whose opacity, colour and light are the run's";
    case Answer::Mip:
      return "the stored maximum along each ray is used";
    case Answer::Learned:
      return "colours are learned from the run's pictures";
    case Answer::PlainLayers:
      return "depth layers answer without lengths or attenuation, each with one opacity";
    case Answer::Attenuation:
      return "attenuation is used, in one order of nested intervals";
    case Answer::Layers:
      return "depth layers answer";
    case Answer::Virtual:
      return "virtual rays answer, without light";
    case Answer::Stack:
      return "the view's own stack is recomposed";
    case Answer::Features:
      return "stored features answer";
    case Answer::Lengths:
      return "opacity lengths answer";
    default:
      break;
  }
  return look.draw == Draw::Isosurface ? "isosurfaces are drawn"
         : look.draw == Draw::Slice    ? "a slice is drawn"
         : look.draw == Draw::Mip      ? "the greatest value along each ray is drawn"
                                       : "a grid of values is drawn as a volume";
}

std::string rangeText(double low, double high, const std::string& units) {
  const bool close = low != high && numberText(low) == numberText(high);
  return (close ? fmt::format("{:.15g} .. {:.15g}", low, high)
                : numberText(low) + " .. " + numberText(high)) +
         (units.empty() ? "" : " " + units);
}

std::string boxText(const Box& box) {
  const auto corner = [](glm::dvec3 v) {
    return "(" + numberText(v.x) + ", " + numberText(v.y) + ", " + numberText(v.z) + ")";
  };
  return corner(box.low) + " .. " + corner(box.high);
}

/// The values that the step holds.
struct Data {
  double low, high;
  std::string text;

  explicit Data(const ProxyHeader& header)
      : low(header.statistics.low),
        high(header.statistics.high),
        text("the data are " + rangeText(low, high, header.units)) {}
  bool known() const { return std::isfinite(low) && std::isfinite(high) && low <= high; }
  bool holds(double value) const { return value >= low && value <= high; }
};

void warnOfFunction(const Look& look, Answer answer, const Data& data,
                    const TransferFunction& function, std::vector<Warning>& warnings) {
  const bool grid = answer == Answer::Grid || answer == Answer::Classified;
  const bool opaque = !isAny(answer, {Answer::Reference, Answer::Layered, Answer::Mip}) &&
                      (!grid || look.draw == Draw::Volume);
  if (look.opacity && opaque) {
    const auto& points = *look.opacity;
    const bool outside = std::none_of(points.begin(), points.end(), [&](const OpacityPoint& each) {
      return data.holds(each.value);
    });
    double most = std::max(function.opacity(data.low), function.opacity(data.high));
    for (const OpacityPoint& each : points)
      if (data.holds(each.value)) most = std::max(most, each.opacity);
    if (most == 0.0) {
      warnings.push_back(
          {"opacity", "the opacity is 0 for all values that there are: " + data.text});
    } else if (outside && !(points.front().value < data.low && points.back().value > data.high)) {
      warnings.push_back({"opacity",
                          "all points of the opacity lie outside of the data, which get "
                          "one opacity: " +
                              data.text});
    }
  }
  if (look.colorRange && !isAny(answer, {Answer::Reference, Answer::Layered})) {
    const auto& [low, high] = *look.colorRange;
    if (high < data.low || low > data.high) {
      warnings.push_back(
          {"colorRange", "the colour range " + rangeText(low, high, "") +
                             " lies outside of the data, which get one colour: " + data.text});
    }
  }
  if (grid && look.draw == Draw::Isosurface) {
    std::string values;
    for (const SurfaceLook& each : look.isosurfaces)
      if (!data.holds(each.value)) values += (values.empty() ? "" : ", ") + numberText(each.value);
    if (!values.empty()) {
      warnings.push_back({"isosurfaces", "no surface has the value " + values + ": " + data.text});
    }
  }
}

/// Proxies that know intervals alone draw each with the mean of its opacity.
void warnOfIntervals(const Look& look, Answer answer, const ProxyHeader& header, const Data& data,
                     const TransferFunction& function, std::vector<Warning>& warnings) {
  using enum Answer;
  if (!look.opacity || !header.partition || !isAny(answer, {Lengths, Attenuation, Layers, Virtual}))
    return;
  constexpr double kMuch = 0.5;  // of the largest opacity
  const auto extremes = [&](double low, double high) {
    const double ends[] = {function.opacity(low), function.opacity(high)};
    std::pair range(std::min(ends[0], ends[1]), std::max(ends[0], ends[1]));
    for (const OpacityPoint& each : *look.opacity) {
      if (each.value < low || each.value > high) continue;
      range = {std::min(range.first, each.opacity), std::max(range.second, each.opacity)};
    }
    return range;
  };
  const double most = extremes(data.low, data.high).second;
  std::string worst;
  double largest = kMuch * most;
  int count = 0;
  const auto& bounds = header.partition->bounds();
  for (std::size_t k = 0; k + 1 < bounds.size(); ++k) {
    const double low = std::max(bounds[k], data.low), high = std::min(bounds[k + 1], data.high);
    if (!(low < high)) continue;
    const auto [least, greatest] = extremes(low, high);
    if (greatest - least <= kMuch * most) continue;
    ++count;
    if (greatest - least <= largest) continue;
    largest = greatest - least;
    worst = "between " + numberText(least) + " and " + numberText(greatest) + " inside interval " +
            std::to_string(k) + ", " + rangeText(bounds[k], bounds[k + 1], header.units);
  }
  if (count == 0) return;
  warnings.push_back(
      {"opacity",
       "the opacity changes " + worst +
           (count > 1 ? " (and so inside " + std::to_string(count - 1) + " more)" : "") +
           ", but each interval is drawn with one mean opacity, as " + reasonOf(look, answer) +
           ": put points at the intervals' bounds, which info --json tells, or let the run store "
           "finer intervals, \"sliced\" or \"field\""});
}

void warnOfSlice(const glm::dvec4& plane, const ProxyHeader& header, const Stretch& stretch,
                 const Camera& camera, std::vector<Warning>& warnings) {
  const glm::dvec3 normal(plane);
  double least = HUGE_VAL, most = -HUGE_VAL;
  for (int i = 0; i < 8; ++i) {
    const double at = glm::dot(normal, header.domain.corner(i));
    least = std::min(least, at);
    most = std::max(most, at);
  }
  const double slack = 1e-9 * (most - least);
  if (plane.w < least - slack || plane.w > most + slack) {
    warnings.push_back(
        {"slice", "the slice at " + numberText(plane.w) + " misses the domain, where n . x is " +
                      rangeText(least, most, "") + ": the domain is " + boxText(header.domain)});
    return;
  }
  const glm::dvec4 seen = stretch.plane(plane);
  const double length = glm::length(glm::dvec3(seen));
  const glm::dvec3 toward = camera.projection == Projection::Perspective
                                ? glm::normalize(header.domain.center() - camera.position)
                                : camera.forward;
  const double degrees =
      std::asin(std::min(std::abs(glm::dot(glm::dvec3(seen), toward)) / length, 1.0)) * 57.29577951;
  if (degrees < 1.0) {
    warnings.push_back({"slice",
                        "the slice is seen edge-on: turn the viewer, or leave out its "
                        "plane for one that faces them"});
  }
}

void warnOfPlaces(const Look& look, const ProxyHeader& header, const Camera& camera, ImageSize size,
                  std::vector<Warning>& warnings) {
  const Box& domain = header.domain;
  const std::string place = ": the domain is " + boxText(domain);
  if (look.clip && (glm::any(glm::greaterThanEqual(look.clip->low, domain.high)) ||
                    glm::any(glm::lessThanEqual(look.clip->high, domain.low)))) {
    warnings.push_back({"clip", "the clip box holds nothing of the domain" + place});
  }
  if (look.center && (glm::any(glm::greaterThan(*look.center, domain.high)) ||
                      glm::any(glm::lessThan(*look.center, domain.low)))) {
    warnings.push_back({"center", "the centre lies outside of the domain" + place});
  }
  const bool framed = look.zoom != 1.0 || look.pan != glm::dvec2(0.0) || look.center;
  if (!framed || camera.projection == Projection::MultiPerspective) return;
  std::array<bool, 4> beyond{true, true, true, true};
  const Box scene = Stretch(look.scale, domain).box(domain);
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 pixel = camera.project(scene.corner(i), size);
    beyond[0] = beyond[0] && pixel.x < 0.0;
    beyond[1] = beyond[1] && pixel.x > size.width;
    beyond[2] = beyond[2] && pixel.y < 0.0;
    beyond[3] = beyond[3] && pixel.y > size.height;
  }
  if (std::count(beyond.begin(), beyond.end(), true) > 0) {
    warnings.push_back({look.pan != glm::dvec2(0.0) ? "pan" : "center",
                        "nothing of the domain is inside of the frame" + place});
  }
}

/// World size of a pixel in the middle of the domain.
double pixelWorld(const Camera& camera, ImageSize size, const Box& domain) {
  const double depth = glm::dot(domain.center() - camera.position, camera.forward);
  return (camera.projection == Projection::Perspective
              ? 2.0 * depth * std::tan(0.5 * camera.fieldOfView)
              : camera.viewHeight) /
         size.height;
}

}  // namespace

std::vector<Warning> keysInVain(const Look& look, Answer answer) {
  using enum Answer;
  const bool grid = answer == Grid || answer == Classified;
  const bool volume = grid && look.draw == Draw::Volume;
  const bool surfaces = grid && look.draw == Draw::Isosurface;
  const bool intervals = isAny(answer, {Lengths, Attenuation, Layers, Virtual, Stack, Learned});
  const bool peaks = surfaces && look.isosurfaces.empty();
  const bool baked = answer == Reference || answer == Layered;
  const bool mapped = std::any_of(look.isosurfaces.begin(), look.isosurfaces.end(),
                                  [](const SurfaceLook& each) { return each.color == "map"; });
  const bool opacities = intervals || volume || answer == PlainLayers || peaks;
  const bool colors = !baked && answer != Learned && (!surfaces || mapped);
  const bool layers = isAny(answer, {Lengths, Attenuation, Layers, PlainLayers, Stack});
  const bool lit = layers || volume || surfaces || answer == Features;
  const bool open = layers || volume || answer == Features;
  struct Key {
    const char* name;
    bool given, used;
  };
  const Key keys[] = {
      {"opacity", look.opacity.has_value(), opacities},
      {"referenceLength", look.referenceLength.has_value(),
       intervals || volume || answer == Features ||
           (answer == Classified && look.draw == Draw::Slice)},
      {"factors", !look.factors.empty(), intervals || volume},
      {"classifier", !look.classifier.empty(), !baked && answer != Mip},
      {"colormap", !look.colormap.empty(), colors},
      {"colorRange", look.colorRange.has_value(), colors},
      {"shading", look.shading == Shading::Phong, lit},
      {"normals", look.normals != NormalSource::Stored && (look.isLit() || look.ao.on), layers},
      {"ao", look.ao.on, open},
      {"enhance", look.enhance.on, isAny(answer, {Lengths, Attenuation, Layers, Stack, Learned})},
      {"via", look.via != Via::Auto, isAny(answer, {Lengths, Attenuation, Layers})},
      {"order", look.order != Order::Auto, isAny(answer, {Lengths, Layers})},
      {"isosurfaces", !look.isosurfaces.empty(), surfaces},
      {"slice", look.slice.has_value(), look.draw == Draw::Slice}};
  std::vector<Warning> warnings;
  for (const Key& key : keys) {
    if (!key.given || key.used) continue;
    warnings.push_back({key.name, fmt::format("look key '{}' has no effect: {}", key.name,
                                              reasonOf(look, answer))});
  }
  return warnings;
}

std::vector<Warning> valuesOutside(const Look& look, Answer answer, const ProxyHeader& header,
                                   const TransferFunction* function, const Camera& camera,
                                   ImageSize size) {
  std::vector<Warning> warnings;
  const Data data(header);
  if (function && data.known()) warnOfFunction(look, answer, data, *function, warnings);
  if (function && data.known() && data.low == data.high && !look.opacity &&
      function->opacity(data.low) > 1e-3) {
    warnings.push_back(
        {"field", "field '" + header.field + "' is " + numberText(data.low) +
                      (header.units.empty() ? "" : " " + header.units) +
                      " everywhere: one colour and one opacity, " +
                      numberText(function->opacity(data.low)) +
                      " per reference length, fill the domain; opacity chooses another"});
  }
  if (function && data.known() && warnings.empty())
    warnOfIntervals(look, answer, header, data, *function, warnings);
  if (look.slice && look.draw == Draw::Slice) {
    warnOfSlice(*look.slice, header, Stretch(look.scale, header.domain), camera, warnings);
  }
  warnOfPlaces(look, header, camera, size, warnings);
  const double radius = look.ao.radius * header.domain.diagonal();
  const double pixel = pixelWorld(camera, size, header.domain);
  if (look.ao.on && (radius < pixel || look.ao.strength == 0.0)) {
    warnings.push_back({"ao", fmt::format("look key 'ao' has no effect: its radius, {} of the "
                                          "domain's diagonal, is {:.2g} pixels, its strength {}",
                                          look.ao.radius, radius / pixel, look.ao.strength)});
  }
  return warnings;
}

Warning nothingSeen(const ProxyHeader& header, const TransferFunction* function) {
  std::string text = "nothing is to be seen in the picture";
  const Data data(header);
  if (data.known() && function) {
    text += ": " + data.text;
    double most = std::max(function->opacity(data.low), function->opacity(data.high));
    for (const OpacityPoint& each : function->opacityPoints())
      if (data.holds(each.value)) most = std::max(most, each.opacity);
    text += ", where the opacity is at most " + numberText(most);
  }
  return {"", text + "; the domain is " + boxText(header.domain)};
}

}  // namespace vestige
