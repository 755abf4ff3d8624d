// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/random_segments.h"

#include <array>
#include <cmath>

#include "tests/support/quadrature.h"

namespace vestige::test {
namespace {

using Vector = std::array<double, 4>;
using Matrix = std::array<Vector, 4>;

double asFloat(double value) { return double(float(value)); }

/// x with K x = y, by Gauss-Jordan elimination with pivots.
Vector solve(Matrix k, Vector y, std::size_t n) {
  for (std::size_t column = 0; column < n; ++column) {
    std::size_t pivot = column;
    for (std::size_t row = column; row < n; ++row)
      if (std::abs(k[row][column]) > std::abs(k[pivot][column])) pivot = row;
    std::swap(k[pivot], k[column]);
    std::swap(y[pivot], y[column]);
    for (std::size_t row = 0; row < n; ++row) {
      if (row == column) continue;
      const double factor = k[row][column] / k[column][column];
      for (std::size_t j = column; j < n; ++j) k[row][j] -= factor * k[column][j];
      y[row] -= factor * y[column];
    }
  }
  for (std::size_t i = 0; i < n; ++i) y[i] /= k[i][i];
  return y;
}

}  // namespace

GaussianPrimitive RandomSegments::primitive(int fields, bool triangular, double ratio) {
  GaussianPrimitive primitive{.fields = fields};
  const auto n = std::size_t(fields);
  for (std::size_t i = 0; i < n; ++i) primitive.center[i] = asFloat(uniform(0.0, 1.0));
  // Axes of random lengths, turned in each plane.
  const double spread = std::log10(ratio), shortest = uniform(-1.0, 3.0 - spread);
  for (std::size_t i = 0; i < n; ++i)
    primitive.scale[i][i] = std::pow(10.0, shortest + uniform(0.0, spread));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      const double angle = uniform(0.0, 3.2), c = std::cos(angle), s = std::sin(angle);
      for (Vector& row : primitive.scale) {
        const double x = row[i], y = row[j];
        row[i] = c * x - s * y;
        row[j] = s * x + c * y;
      }
    }
  }
  for (Vector& row : primitive.scale)
    for (double& each : row) each = asFloat(each);
  if (triangular) primitive.thickness = asFloat(std::pow(10.0, uniform(-1.0, 1.0)));
  return primitive;
}

Segment RandomSegments::near(const GaussianPrimitive& primitive) {
  Segment segment;
  double factor = 1.0;
  if (primitive.thickness > 0.0) {
    segment.a.gradient = uniform(0.0, 2.0);
    segment.b.gradient = uniform(0.0, 2.0);
    factor = 0.5 * primitive.thickness * (segment.a.gradient + segment.b.gradient);
  }
  const auto n = std::size_t(primitive.fields);
  Vector aside{}, along{};
  for (std::size_t i = 0; i < n; ++i) {
    aside[i] = std::normal_distribution<double>(0.0, 0.6)(random_) * factor;
    along[i] = uniform(-1.0, 1.0);
  }
  const Vector offset = solve(primitive.scale, aside, n);
  const double length = std::pow(10.0, uniform(-5.0, 0.0)), place = uniform(-0.2, 1.2);
  for (std::size_t i = 0; i < n; ++i) {
    segment.a.values[i] = primitive.center[i] + offset[i] - place * length * along[i];
    segment.b.values[i] = segment.a.values[i] + length * along[i];
  }
  return rounded(segment);
}

double meanByQuadrature(const GaussianPrimitive& primitive, const Segment& segment) {
  const auto n = std::size_t(primitive.fields);
  const double gradient = 0.5 * (segment.a.gradient + segment.b.gradient);
  if (primitive.thickness > 0.0 && gradient == 0.0) return 0.0;
  const double width = primitive.thickness > 0.0 ? primitive.thickness * gradient : 1.0;
  const auto exponent = [&](double t) {
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      double each = 0.0;
      for (std::size_t j = 0; j < n; ++j) {
        const double value = segment.a.values[j] + t * (segment.b.values[j] - segment.a.values[j]);
        each += primitive.scale[i][j] * (value - primitive.center[j]) / width;
      }
      sum += each * each;
    }
    return sum;
  };
  // The exponent is a parabola in t: where it is least, and how fast it rises, place the panels.
  const double at0 = exponent(0.0), middle = exponent(0.5), at1 = exponent(1.0);
  const double bend = 2.0 * (at0 + at1 - 2.0 * middle), slope = at1 - at0 - bend;
  std::array<double, 7> panels{};
  if (bend > 0.0) {
    const double least = -0.5 * slope / bend, reach = 1.0 / std::sqrt(bend);
    panels = {least - 6 * reach, least - 3 * reach, least - reach,    least,
              least + reach,     least + 3 * reach, least + 6 * reach};
  }
  return integrateUnit([&](double t) { return std::exp(-exponent(t)); }, panels, 1e-12);
}

}  // namespace vestige::test
