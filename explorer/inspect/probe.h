// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "proxy/format/layout/sliced_stack.h"

namespace vestige {

/// How long a ray is in one channel within a slab.
struct ProbeShare {
  std::string channel;
  double low, high;  ///< values of the channel, field units; infinite for below and above
  double length;     ///< world
};

/// What a stack holds of one ray in one slab (method §5): the distribution of values there.
struct ProbeCell {
  int slab;
  double nearDepth, farDepth;  ///< planar
  std::vector<ProbeShare> shares;
  double noData;  ///< world length
};

/// The cells of a pixel's ray, near to far, that it does not miss; with `depth`, the one that holds
/// it. Throws InvalidArgument naming a pixel outside of the picture or a depth outside of the
/// slabs.
std::vector<ProbeCell> probe(const SlicedStack& stack, int x, int y,
                             std::optional<double> depth = {});

nlohmann::json toJson(const std::vector<ProbeCell>& cells);
/// Significant digits that tell values from `low` to `high` apart, 6 .. 17.
int digitsOf(double low, double high);
/// An aligned table for people.
std::string probeText(const std::vector<ProbeCell>& cells);

}  // namespace vestige
