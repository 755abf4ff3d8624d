// SPDX-License-Identifier: BSD-3-Clause
// Colour volumes, such as photographed slices: three fields are the red, green and blue of a point
// and classify themselves. Keys beside a feature's own (name, opacity, color, which tints,
// enabled):
//   range: [low, high], the values of no and full colour; by default the least and greatest of the
//     fields' ranges, the same for all three, so that grey stays grey;
//   encoding: "srgb" (default) or "linear", of the fields;
//   weight: "luminance" (default), so that dark matter is clear, or "constant".
// Channels: "opacity" weighs extinction, "red", "green" and "blue" what is emitted: w and w times
// the linear colour.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "proxy/classifier/kinds.h"
#include "proxy/base/json_object.h"

namespace vestige {
namespace {

enum class Encoding { Srgb, Linear };
enum class Weight { Luminance, Constant };
const std::vector<std::pair<const char*, Encoding>> kEncodings{{"srgb", Encoding::Srgb},
                                                               {"linear", Encoding::Linear}};
const std::vector<std::pair<const char*, Weight>> kWeights{{"luminance", Weight::Luminance},
                                                           {"constant", Weight::Constant}};

struct Options {
  std::optional<std::array<double, 2>> range;  ///< as it is written
  Encoding encoding = Encoding::Srgb;
  Weight weight = Weight::Luminance;
};

/// (opacity, red, green, blue) weights.
using Vector = std::array<double, 4>;

class Color final : public Classifier {
 public:
  /// `domains`: what values of weights() are normalised by already; none by default.
  Color(std::vector<std::string> fields, std::vector<Feature> features, Options options,
        std::span<const FieldDomain> domains = {})
      : Classifier("color", std::move(fields), std::move(features)), options_(options) {
    for (std::size_t i = 0; i < 3; ++i) {
      const FieldDomain own = domains.empty() ? FieldDomain{} : domains[i];
      const auto range = options_.range.value_or(std::array{own.low, own.high});
      low_[i] = (range[0] - own.low) / own.range();
      scale_[i] = own.range() / (range[1] - range[0]);
    }
  }

  std::unique_ptr<Classifier> resolved(std::span<const FieldDomain> domains,
                                       double) const override {
    Options options = options_;
    if (!options.range) {
      options.range = {domains[0].low, domains[0].high};
      for (const FieldDomain& domain : domains) {
        (*options.range)[0] = std::min((*options.range)[0], domain.low);
        (*options.range)[1] = std::max((*options.range)[1], domain.high);
      }
    }
    return std::make_unique<Color>(fields_, features_, options);
  }

  std::unique_ptr<Classifier> normalised(std::span<const FieldDomain> domains) const override {
    return std::make_unique<Color>(fields_, features_, options_, domains);
  }

  std::vector<std::string> channels() const override { return {"opacity", "red", "green", "blue"}; }

  std::vector<ChannelOptics> optics(double referenceLength) const override {
    const double extinction = features_[0].extinction(referenceLength);
    std::vector<ChannelOptics> optics(4);
    optics[0].extinction = extinction;
    for (std::size_t i = 0; i < 3; ++i)
      optics[i + 1].emission[int(i)] = extinction * features_[0].color[int(i)];
    return optics;
  }

  void weights(const FieldSample& a, const FieldSample& b,
               std::span<double> weights) const override {
    std::fill(weights.begin(), weights.end(), 0.0);
    std::array<double, 3> from{}, to{};
    for (std::size_t i = 0; i < 3; ++i) {
      from[i] = (a.values[i] - low_[i]) * scale_[i];
      to[i] = (b.values[i] - low_[i]) * scale_[i];
      if (!std::isfinite(from[i]) || !std::isfinite(to[i])) return;
    }
    const Vector mean = meanOf(from, to);
    for (std::size_t i = 0; i < 4; ++i) weights[i] = std::clamp(mean[i], 0.0, 1.0);
  }

  /// (low, scale) of a field in each component, then (0 of linear fields, 0 of constant weight).
  std::vector<glm::vec4> parameters() const override {
    return {
        glm::vec4(low_[0], low_[1], low_[2], 0), glm::vec4(scale_[0], scale_[1], scale_[2], 0),
        glm::vec4(options_.encoding == Encoding::Srgb, options_.weight == Weight::Luminance, 0, 0)};
  }

  std::string_view glsl() const override {
    return R"glsl(
vec4 colorAt(vec3 value) {
  vec3 c = clamp((value - parameters[0].xyz) * parameters[1].xyz, 0.0, 1.0);
  if (parameters[2].x > 0.0) {
    vec3 power = pow((c + 0.055) / 1.055, vec3(2.4));
    c = mix(power, c / 12.92, vec3(lessThanEqual(c, vec3(0.04045))));
  }
  float w = parameters[2].y > 0.0 ? dot(c, vec3(0.2126, 0.7152, 0.0722)) : 1.0;
  return vec4(w, w * c);
}

// Four-point Gauss-Legendre: within 4e-5 between values in the range, 0.06 where it clamps them.
void classify(vec4 a, vec4 b, float gradientA, float gradientB, out float weights[CHANNELS]) {
  vec3 middle = 0.5 * (a.xyz + b.xyz), reach = 0.5 * (b.xyz - a.xyz);
  vec4 mean = 0.17392742256872693 * (colorAt(middle - 0.8611363115940526 * reach) +
                                     colorAt(middle + 0.8611363115940526 * reach)) +
              0.32607257743127307 * (colorAt(middle - 0.3399810435848563 * reach) +
                                     colorAt(middle + 0.3399810435848563 * reach));
  weights[0] = mean.x;
  weights[1] = mean.y;
  weights[2] = mean.z;
  weights[3] = mean.w;
}
)glsl";
  }

  nlohmann::json json() const override {
    nlohmann::json object = classifierJson(*this);
    object.update(featureJson(features_[0]));
    if (options_.range) object["range"] = *options_.range;
    object["encoding"] = kEncodings[std::size_t(options_.encoding)].first;
    object["weight"] = kWeights[std::size_t(options_.weight)].first;
    return object;
  }

 private:
  Vector at(const std::array<double, 3>& value) const {
    glm::dvec3 c(std::clamp(value[0], 0.0, 1.0), std::clamp(value[1], 0.0, 1.0),
                 std::clamp(value[2], 0.0, 1.0));
    if (options_.encoding == Encoding::Srgb) c = linearFromSrgb(c);
    const double w =
        options_.weight == Weight::Luminance ? 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b : 1.0;
    return {w, w * c.r, w * c.g, w * c.b};
  }

  /// Between the values at which a component is clamped or its curve changes, and closer together
  /// the darker it gets, where the power bends more: eight-point Gauss-Legendre on each piece.
  Vector meanOf(const std::array<double, 3>& from, const std::array<double, 3>& to) const {
    std::vector<double> cuts{0.0, 1.0};
    for (std::size_t i = 0; i < 3; ++i) {
      for (const double bend : {0.0, 0.04045, 0.1, 0.2, 0.4, 1.0}) {
        const double t = (bend - from[i]) / (to[i] - from[i]);
        if (t > 0.0 && t < 1.0) cuts.push_back(t);
      }
    }
    std::sort(cuts.begin(), cuts.end());
    static constexpr std::array<double, 4> kNode{0.1834346424956498, 0.5255324099163290,
                                                 0.7966664774136267, 0.9602898564975363};
    static constexpr std::array<double, 4> kWeight{0.3626837833783620, 0.3137066458778873,
                                                   0.2223810344533745, 0.1012285362903763};
    Vector sum{};
    for (std::size_t cut = 1; cut < cuts.size(); ++cut) {
      const double middle = 0.5 * (cuts[cut - 1] + cuts[cut]);
      const double half = 0.5 * (cuts[cut] - cuts[cut - 1]);
      for (const double side : {-1.0, 1.0}) {
        for (std::size_t node = 0; node < 4; ++node) {
          const double t = middle + side * half * kNode[node];
          const Vector each = at({std::lerp(from[0], to[0], t), std::lerp(from[1], to[1], t),
                                  std::lerp(from[2], to[2], t)});
          for (std::size_t i = 0; i < 4; ++i) sum[i] += half * kWeight[node] * each[i];
        }
      }
    }
    return sum;
  }

  Options options_;
  std::array<double, 3> low_{}, scale_{};
};

}  // namespace

std::unique_ptr<Classifier> readColor(JsonObject& object, std::vector<std::string> fields) {
  std::vector<Feature> features{featureFrom(object, "color")};
  Options options;
  std::vector<double> range;
  object.read("range", range);
  if (object.find("range")) {
    const bool fits = range.size() == 2 && std::isfinite(range[0]) && std::isfinite(range[1]) &&
                      range[0] < range[1];
    if (!fits) object.fail("range", "must be two numbers, the lower first");
    options.range = {range[0], range[1]};
  }
  object.readName("encoding", kEncodings, options.encoding);
  object.readName("weight", kWeights, options.weight);
  return std::make_unique<Color>(std::move(fields), std::move(features), options);
}

}  // namespace vestige
