// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/volume/field_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "explorer/volume/field_thinning.h"
#include "proxy/base/parallel.h"

namespace vestige {
namespace {

constexpr int kMostFiner = 4;

/// For each sample of an even axis, the sample of an uneven one before it and the share of the
/// next.
struct Place {
  int before = 0;
  float share = 0.0f;
};

FieldAxis evenAxis(const FieldAxis& axis) {
  if (axis.nodes.empty() || axis.count == 1) return {axis.count, axis.at(0), 1.0, {}};
  double finest = std::numeric_limits<double>::infinity();
  for (int i = 1; i < axis.count; ++i) finest = std::min(finest, axis.at(i) - axis.at(i - 1));
  const double extent = axis.nodes.back() - axis.nodes.front();
  const double wanted = std::min(std::ceil(extent / finest), double(kMostFiner) * axis.count);
  const int count = std::max(2, int(wanted) + 1);
  return {count, axis.nodes.front(), extent / (count - 1), {}};
}

std::vector<Place> placesOf(const FieldAxis& from, const FieldAxis& to) {
  std::vector<Place> places(std::size_t(to.count));
  int before = 0;
  for (int i = 0; i < to.count; ++i) {
    const double x = to.at(i);
    while (before + 2 < from.count && from.at(before + 1) <= x) ++before;
    if (from.count > 1) {
      const double share = (x - from.at(before)) / (from.at(before + 1) - from.at(before));
      places[std::size_t(i)] = {before, float(std::clamp(share, 0.0, 1.0))};
    }
  }
  return places;
}

}  // namespace

FieldSamples evenlySampled(FieldSamples field) {
  if (std::all_of(field.axes.begin(), field.axes.end(),
                  [](const FieldAxis& axis) { return axis.nodes.empty(); })) {
    return field;
  }
  FieldSamples even{{}, field.low, field.high, {}};
  std::array<std::vector<Place>, 3> places;
  for (std::size_t a = 0; a < 3; ++a) {
    even.axes[a] = field.axes[a].nodes.empty() ? field.axes[a] : evenAxis(field.axes[a]);
    places[a] = placesOf(field.axes[a], even.axes[a]);
  }
  const std::size_t nx = places[0].size(), ny = places[1].size(), nz = places[2].size();
  const std::size_t fromX = std::size_t(field.axes[0].count),
                    fromY = std::size_t(field.axes[1].count);
  even.values.resize(nx * ny * nz);
  // Beside samples without data, as the nearer one.
  const auto mix = [](float a, float b, float share) {
    if (!std::isfinite(a) || !std::isfinite(b)) return share < 0.5f ? a : b;
    return a + share * (b - a);
  };
  parallelRanges(int(nz), [&](int begin, int end) {
    for (int z = begin; z < end; ++z) {
      const Place pz = places[2][std::size_t(z)];
      for (std::size_t y = 0; y < ny; ++y) {
        const Place py = places[1][y];
        for (std::size_t x = 0; x < nx; ++x) {
          const Place px = places[0][x];
          const auto row = [&](int j, int k) {
            const float* values = field.values.data() +
                                  (std::size_t(k) * fromY + std::size_t(j)) * fromX +
                                  std::size_t(px.before);
            return px.share > 0.0f ? mix(values[0], values[1], px.share) : values[0];
          };
          const auto plane = [&](int k) {
            return py.share > 0.0f ? mix(row(py.before, k), row(py.before + 1, k), py.share)
                                   : row(py.before, k);
          };
          even.values[(std::size_t(z) * ny + y) * nx + x] =
              pz.share > 0.0f ? mix(plane(pz.before), plane(pz.before + 1), pz.share)
                              : plane(pz.before);
        }
      }
    }
  });
  return even;
}

namespace {

/// Where the cells of an axis begin, and how long they are together: the outermost ones reach as
/// far beyond their samples as to halfway between theirs and the next.
std::array<double, 2> extentOf(const FieldAxis& axis) {
  const double first = axis.at(1) - axis.at(0);
  const double last = axis.at(axis.count - 1) - axis.at(axis.count - 2);
  const double origin = axis.at(0) - 0.5 * first;
  return {origin, axis.at(axis.count - 1) + 0.5 * last - origin};
}

PlacedField placed(FieldSamples field, const ProxyHeader& header) {
  PlacedField placed;
  placed.header = header;
  for (int a = 0; a < 3; ++a) {
    const FieldAxis& axis = field.axes[std::size_t(a)];
    const double from = placed.header.domain.low[a], to = placed.header.domain.high[a];
    placed.size[a] = axis.count;
    // One sample fills the domain.
    const bool one = axis.count == 1;
    const auto [origin, extent] =
        one ? std::array{from, std::max(to - from, 1e-300)} : extentOf(axis);
    for (int i = 0; i < axis.count && !one && !axis.nodes.empty(); ++i)
      placed.nodes[std::size_t(a)].push_back((axis.at(i) - origin) / extent * axis.count);
    placed.worldFromGrid[a][a] = extent;
    placed.worldFromGrid[3][a] = origin;
    placed.low[a] = (from - origin) / extent;
    placed.high[a] = (to - origin) / extent;
  }
  placed.values = std::move(field.values);
  placed.valueZero = field.low;
  placed.valueUnit = field.high - field.low;
  return placed;
}

}  // namespace

PlacedField placedField(const ProxyImage& image) {
  return placed(thinned(fieldSamples(image)), image.header);
}

PlacedField evenlyPlacedField(const ProxyImage& image) {
  return placed(thinned(evenlySampled(thinned(fieldSamples(image)))), image.header);
}

FieldSource::FieldSource(const ProxyImage& image) : header_(image.header) {
  PlacedField field = placedField(image);
  grid_ = LookGrid::scalar(field.size, field.worldFromGrid, field.values,
                           GridAxes(std::move(field.nodes)));
  grid_.low = field.low;
  grid_.high = field.high;
  grid_.valueZero = field.valueZero + grid_.valueZero * field.valueUnit;
  grid_.valueUnit *= field.valueUnit;
  // How far a mean is from the samples that it stands for is not stored.
  const FieldGrid& stored = *header_.grid;
  const bool whole = stored.reduction == 1 && grid_.size.x == stored.axes[0].count &&
                     grid_.size.y == stored.axes[1].count && grid_.size.z == stored.axes[2].count;
  if (whole) grid_.setWrong(stored.tolerance / grid_.valueUnit);
}

VolumeView FieldSource::draw(const Look& look, const TransferFunction& function,
                             const Camera& camera, ImageSize size) {
  const IntervalPartition* partition = header_.partition ? &*header_.partition : nullptr;
  return painter_.draw(grid_, look, function, partition, header_.domain, camera, size);
}

std::string FieldSource::note() const {
  const FieldGrid& grid = *header_.grid;
  std::string drawn;
  for (std::size_t a = 0; a < 3; ++a) {
    if (grid.axes[a].count > kMostTextureSide) {
      drawn += fmt::format("; drawn from {} along {}, as many as a texture takes", kMostTextureSide,
                           "xyz"[a]);
    }
  }
  return fmt::format("field answers: {} x {} x {} samples{}, each within {:.3g}{} of {}{}",
                     grid.axes[0].count, grid.axes[1].count, grid.axes[2].count,
                     grid.reduction > 1 ? fmt::format(", means of {}^3", grid.reduction) : "",
                     grid.tolerance, header_.units.empty() ? "" : " " + header_.units,
                     grid.reduction > 1 ? "the mean" : "the run's", drawn);
}

}  // namespace vestige
