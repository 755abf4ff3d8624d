// SPDX-License-Identifier: BSD-3-Clause
// Levoy's boundary opacity ([Bergeron]; method §1): a material boundary at a
// value weighs w = max(0, 1 - |v - value| / (thickness ‖∇v‖)), which makes every boundary about
// `thickness` thick in the world, however steep the field; 1 where v = value and ∇v = 0.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "proxy/base/json_object.h"
#include "proxy/classifier/kinds.h"

namespace vestige {
namespace {

struct Boundary {
  std::optional<double> value;      ///< in the field's units
  std::optional<double> thickness;  ///< world; from the middle to where the weight is 0
};

/// Mean of max(0, 1 - |x|) over a segment from x1 to x2, which may be one point: of each slope, the
/// share of the segment on it times the weight at the middle of that part.
double meanOfTent(double x1, double x2) {
  const double low = std::min(x1, x2), high = std::max(x1, x2);
  if (!(high > low)) return std::max(0.0, 1.0 - std::abs(low));
  const double p = std::clamp(low, -1.0, 0.0), q = std::clamp(high, -1.0, 0.0);
  const double r = std::clamp(low, 0.0, 1.0), s = std::clamp(high, 0.0, 1.0);
  return ((q - p) * (1.0 + 0.5 * (p + q)) + (s - r) * (1.0 - 0.5 * (r + s))) / (high - low);
}

class Boundaries final : public Classifier {
 public:
  /// `range`: what FieldSample::gradient is divided by, of values that weights() takes.
  Boundaries(std::vector<std::string> fields, std::vector<Feature> features,
             std::vector<Boundary> boundaries, double range)
      : Classifier("boundaries", std::move(fields), std::move(features)),
        boundaries_(std::move(boundaries)),
        range_(range) {}

  std::unique_ptr<Classifier> resolved(std::span<const FieldDomain> domains,
                                       double referenceLength) const override {
    auto boundaries = boundaries_;
    for (Boundary& each : boundaries) {
      each.value = each.value.value_or(domains[0].median);
      each.thickness = each.thickness.value_or(referenceLength);
    }
    return std::make_unique<Boundaries>(fields_, features_, std::move(boundaries),
                                        domains[0].range());
  }

  std::unique_ptr<Classifier> normalised(std::span<const FieldDomain> domains) const override {
    auto boundaries = boundaries_;
    for (Boundary& each : boundaries) *each.value = (*each.value - domains[0].low) / range_;
    return std::make_unique<Boundaries>(fields_, features_, std::move(boundaries), 1.0);
  }

  void weights(const FieldSample& a, const FieldSample& b,
               std::span<double> weights) const override {
    // As with triangular primitives, the mean gradient holds along the whole segment.
    const double slope = 0.5 * (a.gradient + b.gradient) * range_;
    for (std::size_t i = 0; i < boundaries_.size(); ++i) {
      const double from = a.values[0] - *boundaries_[i].value;
      const double to = b.values[0] - *boundaries_[i].value;
      const double width = *boundaries_[i].thickness * slope;
      if (!std::isfinite(from) || !std::isfinite(to) || std::isnan(width)) {
        weights[i] = 0.0;
      } else if (width > 0.0) {
        weights[i] = meanOfTent(from / width, to / width);
      } else {
        weights[i] = from == 0.0 && to == 0.0 ? 1.0 : 0.0;
      }
    }
  }

  bool needsGradient() const override { return true; }

  bool vanishes(const FieldSample& low, const FieldSample& high) const override {
    return std::all_of(boundaries_.begin(), boundaries_.end(), [&](const Boundary& each) {
      const double away = std::max(low.values[0] - *each.value, *each.value - high.values[0]);
      return away > 0.0 && away >= *each.thickness * high.gradient * range_;
    });
  }

  /// (value, thickness, 0, 0) a boundary.
  std::vector<glm::vec4> parameters() const override {
    std::vector<glm::vec4> out;
    for (const Boundary& each : boundaries_) out.emplace_back(*each.value, *each.thickness, 0, 0);
    return out;
  }

  std::string_view glsl() const override {
    return R"glsl(
void classify(vec4 a, vec4 b, float gradientA, float gradientB, out float weights[CHANNELS]) {
  for (int i = 0; i < CHANNELS; ++i) {
    float width = parameters[i].y * 0.5 * (gradientA + gradientB);
    float low = min(a.x, b.x) - parameters[i].x, high = max(a.x, b.x) - parameters[i].x;
    if (!(width > 1e-30)) {
      weights[i] = low == 0.0 && high == 0.0 ? 1.0 : 0.0;
      continue;
    }
    low /= width;
    high /= width;
    vec2 from = clamp(vec2(low), vec2(-1.0, 0.0), vec2(0.0, 1.0));
    vec2 to = clamp(vec2(high), vec2(-1.0, 0.0), vec2(0.0, 1.0));
    vec2 area = (to - from) * (1.0 + vec2(0.5, -0.5) * (from + to));
    weights[i] = high > low ? (area.x + area.y) / (high - low) : max(0.0, 1.0 - abs(low));
  }
}
)glsl";
  }

  nlohmann::json json() const override {
    nlohmann::json object = classifierJson(*this);
    for (std::size_t i = 0; i < boundaries_.size(); ++i) {
      nlohmann::json entry = featureJson(features_[i]);
      if (boundaries_[i].value) entry["value"] = *boundaries_[i].value;
      if (boundaries_[i].thickness) entry["thickness"] = *boundaries_[i].thickness;
      object["boundaries"].push_back(std::move(entry));
    }
    return object;
  }

 private:
  std::vector<Boundary> boundaries_;
  double range_;
};

}  // namespace

std::unique_ptr<Classifier> readBoundaries(JsonObject& object, std::vector<std::string> fields) {
  std::vector<Feature> features;
  std::vector<Boundary> boundaries;
  for (JsonObject& each : featureList(object, "boundaries")) {
    features.push_back(featureFrom(each, fmt::format("boundary{}", features.size())));
    Boundary boundary;
    boundary.value = readNumber(each, "value");
    boundary.thickness = readPositive(each, "thickness");
    boundaries.push_back(boundary);
    each.finish();
  }
  if (features.empty()) {
    features.push_back({.name = "median"});
    boundaries.emplace_back();
  }
  return std::make_unique<Boundaries>(std::move(fields), std::move(features), std::move(boundaries),
                                      1.0);
}

}  // namespace vestige
