// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <vector>

#include "proxy/format/layout/field_layout.h"

namespace vestige {

/// The values of a stored field between its samples, on its own axes.
class FieldSampler {
 public:
  explicit FieldSampler(FieldSamples field) : field_(std::move(field)) {}

  /// Trilinear, in the field's units; beyond the outermost samples it goes on as it ends. Where the
  /// nearest sample has no data NaN, else of those that have some.
  double at(const glm::dvec3& world) const;
  /// Where the samples stand along each axis.
  std::array<std::vector<double>, 3> nodes() const;

 private:
  FieldSamples field_;
};

}  // namespace vestige
