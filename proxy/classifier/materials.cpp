// SPDX-License-Identifier: BSD-3-Clause
// Probabilistic materials ([Drebin 1988]; [Bergeron]; method §1): a value
// is of material m with probability p_m = P_m / Σ_j P_j, P_m a normal distribution; there is no
// threshold. Σ p = 1 everywhere: far from every material, where all P underflow, the ratio goes to
// its limit, so that such a value belongs to the widest material (of equally wide ones to the
// nearest). What is none of them needs a material of its own, of opacity 0.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "proxy/base/json_object.h"
#include "proxy/classifier/kinds.h"

namespace vestige {
namespace {

struct Material {
  double mean = 0.0, deviation = 1.0;  ///< in the field's units
  double density = 0.0;
};

using Shares = std::array<double, Classifier::kMaxFeatures>;

/// p of every material: shares of exp(log P), the greatest taken out first.
Shares sharesAt(std::span<const Material> materials, double value) {
  Shares shares{};
  double most = -HUGE_VAL, sum = 0.0;
  for (std::size_t i = 0; i < materials.size(); ++i) {
    const double x = (value - materials[i].mean) / materials[i].deviation;
    shares[i] = -0.5 * x * x - std::log(materials[i].deviation);
    most = std::max(most, shares[i]);
  }
  for (std::size_t i = 0; i < materials.size(); ++i) sum += shares[i] = std::exp(shares[i] - most);
  for (std::size_t i = 0; i < materials.size(); ++i) shares[i] /= sum;
  return shares;
}

/// Integrals of p over values: between values at which some p bends, Gauss-Legendre rules hold to
/// many digits, and sums over whole panels are made once.
class Integrals {
 public:
  explicit Integrals(std::vector<Material> materials) : materials_(std::move(materials)) {
    for (std::size_t i = 0; i < materials_.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) addBends(materials_[i], materials_[j]);
    std::sort(bends_.begin(), bends_.end());
    bends_.erase(std::unique(bends_.begin(), bends_.end()), bends_.end());
    sums_.resize(bends_.size());
    for (std::size_t i = 1; i < bends_.size(); ++i) {
      sums_[i] = sums_[i - 1];
      add(bends_[i - 1], bends_[i], 1.0, sums_[i]);
    }
  }

  /// Means of p between two values.
  Shares mean(double from, double to) const {
    const double low = std::min(from, to), high = std::max(from, to);
    if (!(high > low)) return sharesAt(materials_, low);
    Shares shares{};
    const double scale = 1.0 / (high - low);
    const auto first = std::upper_bound(bends_.begin(), bends_.end(), low);
    const auto last = std::upper_bound(first, bends_.end(), high);
    if (first == last) {
      add(low, high, scale, shares);
      return shares;
    }
    const auto a = std::size_t(first - bends_.begin()), b = std::size_t(last - bends_.begin()) - 1;
    add(low, bends_[a], scale, shares);
    add(bends_[b], high, scale, shares);
    for (std::size_t i = 0; i < materials_.size(); ++i)
      shares[i] += scale * (sums_[b][i] - sums_[a][i]);
    return shares;
  }

 private:
  /// log P_i - log P_j is a parabola: where it crosses 0, one material gives way to the other
  /// within a width of 1 / slope; about its vertex both stay mixed over 1 / √curvature.
  void addBends(const Material& a, const Material& b) {
    const double qa = 0.5 / (a.deviation * a.deviation), qb = 0.5 / (b.deviation * b.deviation);
    const double square = qb - qa, linear = 2.0 * (qa * a.mean - qb * b.mean),
                 constant = qb * b.mean * b.mean - qa * a.mean * a.mean +
                            std::log(b.deviation / a.deviation);
    const auto around = [&](double value, double width) {
      for (const double reach : {0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 24.0})
        for (const double side : {-1.0, 1.0})
          if (std::isfinite(value + reach * width)) bends_.push_back(value + side * reach * width);
    };
    const auto crossing = [&](double value) {
      around(value, 1.0 / std::abs(2.0 * square * value + linear));
    };
    if (std::abs(square) <= 1e-12 * (qa + qb)) {
      if (linear != 0.0) crossing(-constant / linear);
      return;
    }
    around(-0.5 * linear / square, 1.0 / std::sqrt(std::abs(square)));
    const double under = linear * linear - 4.0 * square * constant;
    if (under < 0.0) return;
    const double root = -0.5 * (linear + std::copysign(std::sqrt(under), linear));
    crossing(root / square);
    if (root != 0.0) crossing(constant / root);
  }

  /// Adds scale times the integrals over a panel, by the 16-point rule.
  void add(double low, double high, double scale, Shares& sums) const {
    static constexpr std::array<double, 8> kNode{
        0.0950125098376374, 0.2816035507792589, 0.4580167776572274, 0.6178762444026438,
        0.7554044083550030, 0.8656312023878318, 0.9445750230732326, 0.9894009349916499};
    static constexpr std::array<double, 8> kWeight{
        0.1894506104550685, 0.1826034150449236, 0.1691565193950025, 0.1495959888165767,
        0.1246289712555339, 0.0951585116824928, 0.0622535239386479, 0.0271524594117541};
    const double middle = 0.5 * (low + high), half = 0.5 * (high - low);
    for (std::size_t node = 0; node < 8; ++node) {
      for (const double side : {-1.0, 1.0}) {
        const Shares at = sharesAt(materials_, middle + side * half * kNode[node]);
        for (std::size_t i = 0; i < materials_.size(); ++i)
          sums[i] += scale * half * kWeight[node] * at[i];
      }
    }
  }

  std::vector<Material> materials_;
  std::vector<double> bends_;
  std::vector<Shares> sums_;  ///< [bend] integrals from the first bend
};

class Materials final : public Classifier {
 public:
  Materials(std::vector<std::string> fields, std::vector<Feature> features,
            std::vector<Material> materials)
      : Classifier("materials", std::move(fields), std::move(features)),
        materials_(std::move(materials)),
        integrals_(materials_) {}

  std::unique_ptr<Classifier> resolved(std::span<const FieldDomain>, double) const override {
    return std::make_unique<Materials>(*this);
  }

  std::unique_ptr<Classifier> normalised(std::span<const FieldDomain> domains) const override {
    auto materials = materials_;
    for (Material& each : materials) {
      each.mean = (each.mean - domains[0].low) / domains[0].range();
      each.deviation /= domains[0].range();
    }
    return std::make_unique<Materials>(fields_, features_, std::move(materials));
  }

  void weights(const FieldSample& a, const FieldSample& b,
               std::span<double> weights) const override {
    Shares shares{};
    if (std::isfinite(a.values[0]) && std::isfinite(b.values[0]))
      shares = integrals_.mean(a.values[0], b.values[0]);
    for (std::size_t i = 0; i < materials_.size(); ++i)
      weights[i] = std::clamp(shares[i], 0.0, 1.0);
  }

  std::vector<double> densities() const override {
    std::vector<double> densities;
    for (const Material& each : materials_) densities.push_back(each.density);
    return densities;
  }

  /// (mean, 1 / deviation, log deviation, 0) a material.
  std::vector<glm::vec4> parameters() const override {
    std::vector<glm::vec4> out;
    for (const Material& each : materials_)
      out.emplace_back(each.mean, 1.0 / each.deviation, std::log(each.deviation), 0.0);
    return out;
  }

  std::string_view glsl() const override {
    return R"glsl(
void addShares(float value, float scale, inout float weights[CHANNELS]) {
  float shares[CHANNELS];
  float most = -3e38, sum = 0.0;
  for (int i = 0; i < CHANNELS; ++i) {
    float x = (value - parameters[i].x) * parameters[i].y;
    shares[i] = -0.5 * x * x - parameters[i].z;
    most = max(most, shares[i]);
  }
  for (int i = 0; i < CHANNELS; ++i) {
    shares[i] = exp(shares[i] - most);
    sum += shares[i];
  }
  for (int i = 0; i < CHANNELS; ++i) weights[i] += shares[i] * (scale / sum);
}

// Two-point Gauss-Legendre on four equal parts of the segment: within 2e-3 where it spans no more
// than the least deviation, as it does wherever a material can be made out at all.
void classify(vec4 a, vec4 b, float gradientA, float gradientB, out float weights[CHANNELS]) {
  for (int i = 0; i < CHANNELS; ++i) weights[i] = 0.0;
  for (int part = 0; part < 4; ++part) {
    addShares(mix(a.x, b.x, 0.25 * (float(part) + 0.2113248654)), 0.125, weights);
    addShares(mix(a.x, b.x, 0.25 * (float(part) + 0.7886751346)), 0.125, weights);
  }
}
)glsl";
  }

  nlohmann::json json() const override {
    nlohmann::json object = classifierJson(*this);
    for (std::size_t i = 0; i < materials_.size(); ++i) {
      nlohmann::json entry = featureJson(features_[i]);
      entry["mean"] = materials_[i].mean;
      entry["deviation"] = materials_[i].deviation;
      entry["density"] = materials_[i].density;
      object["materials"].push_back(std::move(entry));
    }
    return object;
  }

 private:
  std::vector<Material> materials_;
  Integrals integrals_;
};

double required(JsonObject& object, const char* key, std::optional<double> number) {
  if (!number) object.fail(key, "is missing");
  return *number;
}

}  // namespace

std::unique_ptr<Classifier> readMaterials(JsonObject& object, std::vector<std::string> fields) {
  std::vector<Feature> features;
  std::vector<Material> materials;
  for (JsonObject& each : featureList(object, "materials")) {
    features.push_back(featureFrom(each, fmt::format("material{}", features.size())));
    Material material;
    material.mean = required(each, "mean", readNumber(each, "mean"));
    material.deviation = required(each, "deviation", readPositive(each, "deviation"));
    // Surfaces are then those of the field, as far as materials follow it.
    material.density = readNumber(each, "density").value_or(material.mean);
    materials.push_back(material);
    each.finish();
  }
  if (materials.empty()) object.fail("materials", "is missing");
  return std::make_unique<Materials>(std::move(fields), std::move(features), std::move(materials));
}

}  // namespace vestige
