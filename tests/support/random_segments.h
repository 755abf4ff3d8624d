// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>

#include "proxy/classifier/gaussian.h"
#include "tests/support/gpu_classify.h"

namespace vestige::test {

/// Narrow and wide primitives over fields of [0, 1], and segments that meet them.
class RandomSegments {
 public:
  explicit RandomSegments(unsigned seed) : random_(seed) {}

  /// A full K whose axes are 0.1 to 1000 long, none more than `ratio` times as long as another,
  /// about a centre in the unit box; triangular or not. All numbers are floats.
  GaussianPrimitive primitive(int fields, bool triangular, double ratio = 1e4);
  /// Of any length up to the unit box's, along a line that passes the centre at a distance at which
  /// the primitive weighs something.
  Segment near(const GaussianPrimitive& primitive);

 private:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  std::mt19937 random_;
};

/// ∫ g dt by quadrature of GaussianPrimitive's definition, within 1e-12.
double meanByQuadrature(const GaussianPrimitive& primitive, const Segment& segment);

}  // namespace vestige::test
