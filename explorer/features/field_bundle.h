// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "proxy/archive/archive.h"
#include "proxy/camera/box.h"
#include "proxy/classifier/classifier.h"

namespace vestige {

/// One to four fields of a step on one grid, as classifiers want them: of each the stored field,
/// or else what its stacks say of it (StackSamples). The grid is the first field's; the others are
/// interpolated on it.
struct FieldBundle {
  std::vector<std::string> fields;
  std::vector<FieldDomain> domains;  ///< [field]
  glm::ivec3 size{0};
  glm::dmat4 worldFromGrid{1.0};  ///< as LookGrid
  glm::dvec3 low{0.0}, high{1.0};
  std::array<std::vector<double>, 3> nodes;  ///< as GridAxes: the first field's own axes
  Box domain;
  double lengthUnit = 1.0;    ///< Archive::lengthUnit
  std::vector<float> values;  ///< [cell][4] (v - low) / (high - low) of the domains; NaN = no data
                              ///< in one of the fields, in all four places
  /// How far the values of a field may be wrong, in those of `values`.
  struct Wrong {
    double unit = 0.0;
    std::vector<std::uint8_t> share;  ///< [cell] of units; empty: one everywhere
    double at(std::size_t cell) const { return share.empty() ? unit : share[cell] * unit; }
  };
  std::vector<Wrong> wrong;  ///< [field]; empty: of one of them nobody knows (means of a reduction)
  std::string note;          ///< which proxies they come from, a sentence

  /// Throws NotFound naming a field of which the step stores neither.
  FieldBundle(const Archive& archive, long cycle, std::vector<std::string> names);

  /// The fields at a point, trilinear, in their own units, without gradient; NaN where one has no
  /// data or the point lies outside of the domain.
  FieldSample sample(const glm::dvec3& world) const;
  /// Where samples stand along each axis, in grid coordinates.
  std::array<std::vector<double>, 3> places() const;
  /// [cell] FieldSample::gradient: 1 / world unit, whatever the archive's unit of length:
  /// central differences, one-sided at the border and beside cells
  /// without data (method §1); NaN where there are none.
  std::vector<float> gradients() const;
  /// [cell] how far these may be wrong where values are as far as they may be, each for itself.
  std::vector<float> gradientsWrong() const;

 private:
  /// Calls visit(cell, SlopeEnds of each axis) for the cells with data.
  template <typename Visit>
  void forSlopes(const Visit& visit) const;
};

}  // namespace vestige
