// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/plan/training_looks.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vestige {

TransferFunction withScaledOpacity(const TransferFunction& base, double low, double high,
                                   double scale) {
  const std::vector<OpacityPoint>& points = base.opacityPoints();
  // The opacity just below a value: the first of two points there, else the function.
  const auto below = [&](double value) {
    const auto at = std::find_if(points.begin(), points.end(),
                                 [&](const OpacityPoint& point) { return point.value == value; });
    return at != points.end() ? at->opacity : base.opacity(value);
  };
  std::vector<OpacityPoint> changed;
  for (const OpacityPoint& point : points) {
    if (point.value == low || point.value == high) continue;
    const bool inside = point.value > low && point.value < high;
    changed.push_back({point.value, (inside ? scale : 1.0) * point.opacity});
  }
  if (std::isfinite(low)) {
    changed.push_back({low, below(low)});
    changed.push_back({low, scale * base.opacity(low)});
  }
  if (std::isfinite(high)) {
    changed.push_back({high, scale * below(high)});
    changed.push_back({high, base.opacity(high)});
  }
  TransferFunction function = base;
  function.setOpacity(std::move(changed));
  return function;
}

std::vector<TransferFunction> trainingLooks(const TransferFunction& base,
                                            const IntervalPartition& partition, int pictures,
                                            double scale) {
  const IntervalLook look = base.onIntervals(partition);
  std::vector<int> visible;
  for (int k = 0; k < partition.intervals(); ++k)
    if (look.extinction[std::size_t(k)] > 0.0) visible.push_back(k);
  const int groups = std::min(std::max(2, pictures - 1), int(visible.size()));
  std::vector<TransferFunction> looks{base};
  constexpr double infinity = std::numeric_limits<double>::infinity();
  for (int group = 0; group < groups && int(looks.size()) < pictures; ++group) {
    const auto bound = [&](int g) {
      return partition
          .bounds()[std::size_t(visible[visible.size() * std::size_t(g) / std::size_t(groups)])];
    };
    looks.push_back(withScaledOpacity(base, group == 0 ? -infinity : bound(group),
                                      group + 1 == groups ? infinity : bound(group + 1), scale));
  }
  return looks;
}

}  // namespace vestige
