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
  return fmt::format("uses field: {} x {} x {} samples{}, each within {:.3g}{} of {}{}",
                     grid.axes[0].count, grid.axes[1].count, grid.axes[2].count,
                     grid.reduction > 1 ? fmt::format(", means of {}^3", grid.reduction) : "",
                     grid.tolerance, header_.units.empty() ? "" : " " + header_.units,
                     grid.reduction > 1 ? "the mean" : "the run's", drawn);
}

}  // namespace vestige
