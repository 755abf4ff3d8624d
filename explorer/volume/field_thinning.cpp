// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/volume/field_thinning.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "proxy/base/parallel.h"

namespace vestige {
namespace {

/// A place between two samples of a long axis.
struct ThinPlace {
  std::size_t before = 0;
  double share = 0.0;
};

constexpr int kPlaces = 2;  ///< that a mean is taken of, for each sample that it stands for

/// Where the mean of each new sample is taken, a fixed number of places each.
std::vector<ThinPlace> placesOf(int count, int most, int each) {
  const double step = double(count - 1) / (most - 1);
  std::vector<ThinPlace> places;
  for (int i = 0; i < most; ++i) {
    for (int k = 0; k < each; ++k) {
      const double at = std::clamp((i + (k + 0.5) / each - 0.5) * step, 0.0, double(count - 1));
      const auto before = std::size_t(std::min(at, double(count - 2)));
      places.push_back({before, at - double(before)});
    }
  }
  return places;
}

FieldAxis thinnedAxis(const FieldAxis& axis, int most) {
  const double step = double(axis.count - 1) / (most - 1);
  FieldAxis thin{most, axis.first, axis.spacing * step, {}};
  for (int i = 0; i < most && !axis.nodes.empty(); ++i) {
    const int before = std::min(int(i * step), axis.count - 2);
    thin.nodes.push_back(std::lerp(axis.at(before), axis.at(before + 1), i * step - before));
  }
  return thin;
}

/// The values of a field that is `count` long along the axis, whose samples are `stride` apart.
std::vector<float> thinnedValues(const std::vector<float>& values, std::size_t stride, int count,
                                 int most) {
  const int each = kPlaces * int(std::ceil(double(count - 1) / (most - 1)));
  const auto places = placesOf(count, most, each);
  const std::size_t lines = values.size() / (stride * std::size_t(count));
  std::vector<float> thin(lines * stride * std::size_t(most));
  parallelRanges(most, [&](int begin, int end) {
    for (std::size_t line = 0; line < lines; ++line) {
      const float* from = values.data() + line * stride * std::size_t(count);
      for (int i = begin; i < end; ++i) {
        float* to = thin.data() + (line * std::size_t(most) + std::size_t(i)) * stride;
        for (std::size_t s = 0; s < stride; ++s) {
          double sum = 0.0;
          int known = 0;
          for (int k = 0; k < each; ++k) {
            const ThinPlace& place = places[std::size_t(i * each + k)];
            const double a = from[place.before * stride + s];
            const double b = from[(place.before + 1) * stride + s];
            // The sample beside it, where the other has no data.
            const double value = std::isnan(a) || std::isnan(b) ? (place.share > 0.5 ? b : a)
                                                                : std::lerp(a, b, place.share);
            if (std::isnan(value)) continue;
            sum += value;
            ++known;
          }
          to[s] = 2 * known >= each ? float(sum / known) : std::numeric_limits<float>::quiet_NaN();
        }
      }
    }
  });
  return thin;
}

}  // namespace

FieldSamples thinned(FieldSamples field, int most) {
  std::size_t stride = 1;
  for (FieldAxis& axis : field.axes) {
    if (axis.count > most) {
      field.values = thinnedValues(field.values, stride, axis.count, most);
      axis = thinnedAxis(axis, most);
    }
    stride *= std::size_t(axis.count);
  }
  return field;
}

}  // namespace vestige
