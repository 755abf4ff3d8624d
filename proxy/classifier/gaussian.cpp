// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/classifier/gaussian.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "proxy/base/error.h"
#include "proxy/base/json_object.h"
#include "proxy/classifier/kinds.h"

namespace vestige {
namespace {

using Vector = std::array<double, 4>;

Vector scaled(const GaussianPrimitive& g, const Vector& v, double factor) {
  Vector out{};
  for (std::size_t i = 0; i < std::size_t(g.fields); ++i) {
    for (std::size_t j = 0; j < std::size_t(g.fields); ++j)
      out[i] += g.scale[i][j] * (v[j] - g.center[j]);
    out[i] *= factor;
  }
  return out;
}

double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

}  // namespace

double meanOfGaussian(double x1, double x2) {
  const double d = x2 - x1;
  // Below, the difference of erf loses digits; the midpoint rule's next term is of order d^4.
  if (std::abs(d) < 1e-3) {
    const double middle = 0.5 * (x1 + x2), square = middle * middle;
    return std::exp(-square) * (1.0 + d * d * (2.0 * square - 1.0) / 12.0);
  }
  const double half = 0.5 * std::sqrt(std::numbers::pi) / d;
  // On one side of 0, erfc keeps the digits that erf rounds to 1.
  if (x1 > 0.0 && x2 > 0.0) return half * (std::erfc(x1) - std::erfc(x2));
  if (x1 < 0.0 && x2 < 0.0) return half * (std::erfc(-x2) - std::erfc(-x1));
  return half * (std::erf(x2) - std::erf(x1));
}

double GaussianPrimitive::at(const FieldSample& sample) const { return mean(sample, sample); }

double GaussianPrimitive::mean(const FieldSample& a, const FieldSample& b) const {
  double factor = 1.0;
  if (thickness > 0.0) {
    const double gradient = 0.5 * (a.gradient + b.gradient);
    if (!(gradient > 0.0)) return 0.0;
    factor = 1.0 / (thickness * gradient);
  }
  const Vector v1 = scaled(*this, a.values, factor), v2 = scaled(*this, b.values, factor);
  Vector d{};
  for (std::size_t i = 0; i < 4; ++i) d[i] = v2[i] - v1[i];
  const double length = std::sqrt(dot(d, d));
  if (std::isnan(length) || std::isinf(length)) return 0.0;
  if (length == 0.0) return std::exp(-dot(v1, v1));
  // The distance of the segment's line from the centre, and where along it the centre lies.
  const double along = dot(v1, d) / length;
  Vector aside{};
  for (std::size_t i = 0; i < 4; ++i) aside[i] = v1[i] - along * d[i] / length;
  return std::exp(-dot(aside, aside)) * meanOfGaussian(along, along + length);
}

double GaussianPrimitive::most(const FieldSample& low, const FieldSample& high) const {
  double square = 0.0;
  for (std::size_t i = 0; i < std::size_t(fields); ++i) {
    // The least |row (v - c)|: each row by itself, so that the sum is no more than the true least.
    double from = 0.0, to = 0.0;
    for (std::size_t j = 0; j < std::size_t(fields); ++j) {
      const double a = scale[i][j] * (low.values[j] - center[j]);
      const double b = scale[i][j] * (high.values[j] - center[j]);
      from += std::min(a, b);
      to += std::max(a, b);
    }
    const double least = std::max({from, -to, 0.0});
    square += least * least;
  }
  if (thickness > 0.0) {
    if (!(high.gradient > 0.0)) return 0.0;
    square /= thickness * thickness * high.gradient * high.gradient;
  }
  return std::exp(-square);
}

namespace {

/// "width" of a diagonal K, "matrix" of any other.
void writeScale(const std::array<Vector, 4>& scale, std::size_t n, nlohmann::json& entry) {
  bool diagonal = true;
  std::vector<double> widths, rows;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      rows.push_back(scale[i][j]);
      diagonal = diagonal && (i == j ? scale[i][j] > 0.0 : scale[i][j] == 0.0);
    }
    widths.push_back(1.0 / scale[i][i]);
  }
  if (diagonal) {
    entry["width"] = widths;
  } else {
    entry["matrix"] = rows;
  }
}

void writeCenter(const Vector& center, std::size_t n, nlohmann::json& entry) {
  entry["center"] = std::vector<double>(center.begin(), center.begin() + long(n));
}

}  // namespace

nlohmann::json primitiveJson(const GaussianPrimitive& primitive) {
  nlohmann::json entry = nlohmann::json::object();
  const auto n = std::size_t(primitive.fields);
  writeCenter(primitive.center, n, entry);
  writeScale(primitive.scale, n, entry);
  if (primitive.thickness > 0.0) entry["thickness"] = primitive.thickness;
  return entry;
}

namespace {

/// A primitive as it is written: what is left out is filled in by resolved().
struct Primitive {
  std::optional<Vector> center;
  std::optional<std::array<Vector, 4>> scale;
  std::optional<double> thickness;
};

/// The R of K = Q R, Q orthogonal: ‖R x‖ = ‖K x‖ with fewer products.
std::array<Vector, 4> upperTriangle(std::array<Vector, 4> k) {
  for (std::size_t column = 0; column < 3; ++column) {
    for (std::size_t row = column + 1; row < 4; ++row) {
      // A Givens rotation of two rows that leaves nothing below the diagonal.
      const double length = std::hypot(k[column][column], k[row][column]);
      if (k[row][column] == 0.0) continue;
      const double c = k[column][column] / length, s = k[row][column] / length;
      for (std::size_t j = 0; j < 4; ++j) {
        const double upper = k[column][j], lower = k[row][j];
        k[column][j] = c * upper + s * lower;
        k[row][j] = j == column ? 0.0 : c * lower - s * upper;
      }
    }
  }
  return k;
}

class Gaussian final : public Classifier {
 public:
  Gaussian(std::vector<std::string> fields, std::vector<Feature> features,
           std::vector<Primitive> primitives)
      : Classifier("gaussian", std::move(fields), std::move(features)),
        primitives_(std::move(primitives)) {
    for (const Primitive& each : primitives_) {
      if (each.center && each.scale) {
        resolved_.push_back(
            {int(fields_.size()), *each.center, *each.scale, each.thickness.value_or(0.0)});
      }
    }
  }

  std::unique_ptr<Classifier> resolved(std::span<const FieldDomain> domains,
                                       double referenceLength) const override {
    auto primitives = primitives_;
    for (Primitive& each : primitives) {
      // Nothing but a name: the paper's default, a triangular one as wide as the fields.
      if (!each.scale && !each.thickness) each.thickness = referenceLength;
      if (!each.center) {
        each.center.emplace();
        for (std::size_t j = 0; j < fields_.size(); ++j) (*each.center)[j] = domains[j].median;
      }
      if (!each.scale) {
        each.scale.emplace();
        for (std::size_t j = 0; j < fields_.size(); ++j)
          (*each.scale)[j][j] = 1.0 / domains[j].range();
      }
    }
    return std::make_unique<Gaussian>(fields_, features_, std::move(primitives));
  }

  std::unique_ptr<Classifier> normalised(std::span<const FieldDomain> domains) const override {
    auto primitives = primitives_;
    for (Primitive& each : primitives) {
      for (std::size_t j = 0; j < fields_.size(); ++j) {
        (*each.center)[j] = ((*each.center)[j] - domains[j].low) / domains[j].range();
        for (Vector& row : *each.scale) row[j] *= domains[j].range();
      }
    }
    return std::make_unique<Gaussian>(fields_, features_, std::move(primitives));
  }

  void weights(const FieldSample& a, const FieldSample& b,
               std::span<double> weights) const override {
    for (std::size_t i = 0; i < resolved_.size(); ++i) weights[i] = resolved_[i].mean(a, b);
  }

  bool needsGradient() const override {
    for (const auto& each : primitives_) {
      if (each.thickness || !each.scale) return true;
    }
    return false;
  }

  bool vanishes(const FieldSample& low, const FieldSample& high) const override {
    return std::all_of(resolved_.begin(), resolved_.end(), [&](const GaussianPrimitive& each) {
      return each.most(low, high) <= kNegligible;
    });
  }

  std::string_view glsl() const override;

  /// Four a primitive: rows of upperTriangle(K), the second's last being the thickness, the last
  /// two in one, and the centre.
  std::vector<glm::vec4> parameters() const override {
    std::vector<glm::vec4> out;
    for (const auto& each : resolved_) {
      const auto k = upperTriangle(each.scale);
      out.emplace_back(k[0][0], k[0][1], k[0][2], k[0][3]);
      out.emplace_back(k[1][1], k[1][2], k[1][3], each.thickness);
      out.emplace_back(k[2][2], k[2][3], k[3][3], 0.0);
      out.emplace_back(each.center[0], each.center[1], each.center[2], each.center[3]);
    }
    return out;
  }

  nlohmann::json json() const override {
    nlohmann::json object = classifierJson(*this);
    const std::size_t n = fields_.size();
    for (std::size_t i = 0; i < primitives_.size(); ++i) {
      const Primitive& each = primitives_[i];
      nlohmann::json entry = featureJson(features_[i]);
      if (each.center) writeCenter(*each.center, n, entry);
      if (each.scale) writeScale(*each.scale, n, entry);
      if (each.thickness) entry["thickness"] = *each.thickness;
      object["primitives"].push_back(std::move(entry));
    }
    return object;
  }

 private:
  std::vector<Primitive> primitives_;        ///< as written
  std::vector<GaussianPrimitive> resolved_;  ///< those with all that they need
};

std::string_view Gaussian::glsl() const {
  return R"glsl(
// erf(x) = x P / Q within 3e-8, as (x P, Q): a rational least-maximum fit on [-3.8, 3.8].
vec2 erfParts(float x) {
  x = clamp(x, -3.8, 3.8);
  float u = x * x;
  float p = 1.128378895 + u * (0.1951490021 + u * (0.04996629773 + u * (0.003532071128 + u *
            (0.0001406293482 + u * (-2.019929346e-6 + u * 2.124062542e-8)))));
  float q = 1.0 + u * (0.5062763862 + u * (0.1130528469 + u * (0.01397406978 + u *
            0.000924321964)));
  return vec2(x * p, q);
}

// Mean of a Gaussian primitive over a segment [Kniss 2003, eq. 11-14], without a
// branch, which software rasterisers take both ways. K comes as an upper triangle.
float meanOfPrimitive(int first, vec4 a, vec4 b, float gradient) {
  vec4 row0 = parameters[first], row1 = parameters[first + 1], row23 = parameters[first + 2];
  float thickness = row1.w;
  float inverse = thickness > 0.0 ? 1.0 / max(thickness * gradient, 1e-10) : 1.0;
  // Each end from the centre first: their sum would round away what is small against the centre.
  vec4 center = parameters[first + 3];
  vec4 c = 0.5 * ((a - center) + (b - center)) * inverse, d = 0.5 * (b - a) * inverse;
  // The segment's middle and half of it, seen from the centre through K.
  vec4 middle = vec4(dot(row0, c), dot(row1.xyz, c.yzw), dot(row23.xy, c.zw), row23.z * c.w);
  vec4 reach = vec4(dot(row0, d), dot(row1.xyz, d.yzw), dot(row23.xy, d.zw), row23.z * d.w);
  float square = dot(reach, reach), perLength = inversesqrt(max(square, 1e-30));
  vec4 way = reach * perLength;
  float x = dot(middle, way), h = square * perLength;
  vec4 aside = middle - x * way;
  // Short segments, on which the difference of erf loses digits: the mean of a Taylor series about
  // the middle, to the sixth derivative of exp(-x^2).
  float s = min(x * x, 100.0);
  float series = 1.0 + square * ((4.0 * s - 2.0) / 6.0 + square * (
                 ((16.0 * s - 48.0) * s + 12.0) / 120.0 + square * (
                 (((64.0 * s - 480.0) * s + 720.0) * s - 120.0) / 5040.0)));
  vec2 to = erfParts(x + h), from = erfParts(x - h);
  float closed = 0.4431134627263790 * perLength * (to.x * from.y - from.x * to.y) / (to.y * from.y);
  bool isShort = h < 0.3;
  float mean = exp(-dot(aside, aside) - (isShort ? x * x : 0.0)) * (isShort ? series : closed);
  // In the tail the rounding of erf can leave less than nothing, by which nobody is to divide.
  mean = clamp(mean, 0.0, 1.0);
  return thickness > 0.0 && !(gradient > 0.0) ? 0.0 : mean;
}

void classify(vec4 a, vec4 b, float gradientA, float gradientB, out float weights[CHANNELS]) {
  for (int i = 0; i < CHANNELS; ++i) {
    weights[i] = meanOfPrimitive(4 * i, a, b, 0.5 * (gradientA + gradientB));
  }
}
)glsl";
}

std::optional<Vector> readVector(JsonObject& object, const char* key, std::size_t count) {
  std::vector<double> numbers;
  object.read(key, numbers);
  if (!object.find(key)) return std::nullopt;
  if (numbers.size() != count) {
    object.fail(key,
                fmt::format("must hold {} numbers, one a field, not {}", count, numbers.size()));
  }
  Vector vector{};
  for (std::size_t i = 0; i < count; ++i) {
    if (!std::isfinite(numbers[i])) object.fail(key, fmt::format("holds {}", numbers[i]));
    vector[i] = numbers[i];
  }
  return vector;
}

Primitive primitiveFrom(JsonObject& object, std::size_t n) {
  Primitive primitive;
  primitive.center = readVector(object, "center", n);
  if (const auto width = readVector(object, "width", n)) {
    primitive.scale.emplace();
    for (std::size_t i = 0; i < n; ++i) {
      if (!((*width)[i] > 0.0))
        object.fail("width", fmt::format("{} is not positive", (*width)[i]));
      (*primitive.scale)[i][i] = 1.0 / (*width)[i];
    }
  }
  if (std::vector<double> rows; object.find("matrix")) {
    object.read("matrix", rows);
    if (primitive.scale) object.fail("matrix", "and width are both given");
    if (rows.size() != n * n)
      object.fail("matrix", fmt::format("must hold {} numbers, not {}", n * n, rows.size()));
    primitive.scale.emplace();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (!std::isfinite(rows[i])) object.fail("matrix", fmt::format("holds {}", rows[i]));
      (*primitive.scale)[i / n][i % n] = rows[i];
    }
  }
  primitive.thickness = readPositive(object, "thickness");
  return primitive;
}

}  // namespace

std::unique_ptr<Classifier> readGaussian(JsonObject& object, std::vector<std::string> fields) {
  std::vector<Feature> features;
  std::vector<Primitive> primitives;
  for (JsonObject& each : featureList(object, "primitives")) {
    features.push_back(featureFrom(each, fmt::format("primitive{}", features.size())));
    primitives.push_back(primitiveFrom(each, fields.size()));
    each.finish();
  }
  if (features.empty()) {
    features.push_back({.name = "median"});
    primitives.emplace_back();
  }
  return std::make_unique<Gaussian>(std::move(fields), std::move(features), std::move(primitives));
}

}  // namespace vestige
