// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <vector>

namespace vestige {

/// Where the samples of a stored field stand along an axis: evenly, or at `nodes`.
struct FieldAxis {
  int count = 1;
  double first = 0.0, spacing = 1.0;  ///< even axes; spacing > 0
  std::vector<double> nodes;          ///< uneven axes: rising, `count` of them; else empty

  double at(int i) const { return nodes.empty() ? first + i * spacing : nodes[std::size_t(i)]; }
  friend bool operator==(const FieldAxis&, const FieldAxis&) = default;
};

/// The grid of a stored field and how it is stored (docs/archive-format.md, `vestige:grid`).
struct FieldGrid {
  std::array<FieldAxis, 3> axes;  ///< of what is stored, after reduction
  int reduction = 1;              ///< samples that were averaged along each axis
  double low = 0.0, high = 1.0;   ///< value = low + (high - low) * stored; low < high
  double tolerance = 0.0;         ///< largest error of compression, in the field's units
  std::size_t bytes = 0;          ///< of the compressed stream

  std::size_t cells() const {
    return std::size_t(axes[0].count) * std::size_t(axes[1].count) * std::size_t(axes[2].count);
  }
  friend bool operator==(const FieldGrid&, const FieldGrid&) = default;
};

nlohmann::json toJson(const FieldGrid& grid);
/// Throws Format naming what is missing or makes no sense.
FieldGrid fieldGridFromJson(const nlohmann::json& json);

}  // namespace vestige
