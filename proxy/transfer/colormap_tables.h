// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string_view>

namespace vestige {

/// A built-in colour map: equally spaced sRGB colours over [0, 1], six hexadecimal digits each.
struct ColormapTable {
  std::string_view name;
  std::string_view hexColors;
};

std::span<const ColormapTable> colormapTables();

}  // namespace vestige
