// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>

#include "proxy/classifier/classifier.h"

namespace vestige {

/// A Gaussian transfer function over n fields [Kniss 2003, §3]:
/// g(v) = exp(-‖K (v - c)‖²), or, with a thickness, the triangular form (§3.2)
/// exp(-‖K (v - c) / (thickness ĝ)‖²) with ĝ = FieldSample::gradient, 0 where that is 0.
struct GaussianPrimitive {
  int fields = 1;
  std::array<double, 4> center{};
  std::array<std::array<double, 4>, 4> scale{};  ///< K, row by row
  double thickness = 0.0;                        ///< world; 0: not triangular

  double at(const FieldSample& sample) const;
  /// ∫ g dt over a segment, t in [0, 1], on which v goes linearly from a to b (eq. 11-14); the
  /// triangular form has the mean gradient of both ends throughout (§5.2.1). Within 1e-9.
  double mean(const FieldSample& a, const FieldSample& b) const;
  /// At least the greatest g between two corners of a box of values and gradients.
  double most(const FieldSample& low, const FieldSample& high) const;
};

/// {"center": [...], "width": [...] or "matrix": [...], "thickness": ...}: the keys of a primitive
/// in a classifier's JSON. "width" where K is diagonal and positive, "thickness" where there is
/// one.
nlohmann::json primitiveJson(const GaussianPrimitive& primitive);

/// ∫ exp(-(x1 + t (x2 - x1))²) dt over [0, 1]: IGauss of eq. 16.
double meanOfGaussian(double x1, double x2);

}  // namespace vestige
