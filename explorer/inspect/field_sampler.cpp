// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/inspect/field_sampler.h"

#include <algorithm>
#include <cmath>

#include "explorer/volume/known_mean.h"

namespace vestige {
namespace {

/// The sample before a place, and the share of the next.
struct Place {
  int before = 0;
  double share = 0.0;
};

Place placeOn(const FieldAxis& axis, double at) {
  int low = 0, high = axis.count - 1;
  if (high == 0 || at <= axis.at(0)) return {};
  if (at >= axis.at(high)) return {high - 1, 1.0};
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    (axis.at(middle) <= at ? low : high) = middle;
  }
  return {low, (at - axis.at(low)) / (axis.at(high) - axis.at(low))};
}

}  // namespace

double FieldSampler::at(const glm::dvec3& world) const {
  std::array<Place, 3> places;
  for (int a = 0; a < 3; ++a)
    places[std::size_t(a)] = placeOn(field_.axes[std::size_t(a)], world[a]);
  const std::size_t nx = std::size_t(field_.axes[0].count), ny = std::size_t(field_.axes[1].count);
  KnownMean mean;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    std::array<std::size_t, 3> i;
    for (std::size_t a = 0; a < 3; ++a) {
      const bool next = corner >> a & 1;
      weight *= next ? places[a].share : 1.0 - places[a].share;
      i[a] = std::size_t(places[a].before + (next ? 1 : 0));
    }
    if (weight <= 0.0) continue;
    mean.add(double(field_.values[(i[2] * ny + i[1]) * nx + i[0]]), weight);
  }
  const double share = mean.value();
  return std::isnan(share) ? share : std::lerp(field_.low, field_.high, share);  // lerp: of numbers
}

std::array<std::vector<double>, 3> FieldSampler::nodes() const {
  std::array<std::vector<double>, 3> nodes;
  for (std::size_t a = 0; a < 3; ++a)
    for (int i = 0; i < field_.axes[a].count; ++i) nodes[a].push_back(field_.axes[a].at(i));
  return nodes;
}

}  // namespace vestige
