// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/features/field_bundle.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "explorer/recomposition/decode.h"
#include "explorer/stacks/stack_source.h"
#include "explorer/volume/field_source.h"
#include "explorer/volume/known_mean.h"
#include "proxy/base/error.h"
#include "proxy/base/parallel.h"

namespace vestige {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

/// One field on its own grid.
struct Samples {
  glm::ivec3 size{0};
  glm::dmat4 worldFromGrid{1.0};
  glm::dvec3 low{0.0}, high{1.0};
  std::array<std::vector<double>, 3> nodes;  ///< as GridAxes
  std::vector<float> values;                 ///< normalised by its domain
  FieldDomain domain;
  Box box;
  std::string note;
  std::optional<FieldBundle::Wrong> wrong;
};

FieldDomain domainOf(const ProxyHeader& header) {
  const FieldStatistics& statistics = header.statistics;
  return fieldDomain(header.partition
                         ? *header.partition
                         : IntervalPartition::uniform(statistics.low, statistics.high, 1),
                     statistics);
}

/// values * unit + zero, normalised by the domain.
void normalise(std::vector<float>& values, double unit, double zero, const FieldDomain& domain) {
  const double factor = unit / domain.range(), shift = (zero - domain.low) / domain.range();
  parallelRanges(int(values.size()), [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      float& value = values[std::size_t(i)];
      value = float(double(value) * factor + shift);
    }
  });
}

Samples storedField(const Archive& archive, const ArchiveRow& row) {
  PlacedField placed = placedField(readImage(archive.open(row)));
  Samples samples{placed.size,
                  placed.worldFromGrid,
                  placed.low,
                  placed.high,
                  std::move(placed.nodes),
                  std::move(placed.values),
                  domainOf(placed.header),
                  placed.header.domain,
                  "'" + placed.header.field + "' as stored",
                  std::nullopt};
  const FieldGrid& stored = *placed.header.grid;
  if (stored.reduction == 1)
    samples.wrong = FieldBundle::Wrong{stored.tolerance / samples.domain.range(), {}};
  normalise(samples.values, placed.valueUnit, placed.valueZero, samples.domain);
  return samples;
}

Samples fromStacks(const Archive& archive, long cycle, const std::string& field) {
  std::vector<ProxyHeader> headers;
  StackSamples fused = samplesOfStacks(archive, cycle, field, headers);
  const ProxyHeader& header = headers.front();
  Samples samples{fused.size,
                  fused.worldFromGrid,
                  glm::dvec3(0.0),
                  glm::dvec3(1.0),
                  {},
                  std::move(fused.values),
                  domainOf(header),
                  header.domain,
                  fmt::format("'{}' from {} {}", field, headers.size(),
                              headers.size() == 1 ? "stack" : "stacks"),
                  std::nullopt};
  samples.wrong = FieldBundle::Wrong{};
  if (!fused.wrong.empty())
    samples.wrong = {double(StackSamples::kWrongUnit) * fused.unit / samples.domain.range(),
                     std::move(fused.wrong)};
  normalise(samples.values, fused.unit, fused.zero, samples.domain);
  return samples;
}

Samples samplesOf(const Archive& archive, long cycle, const std::string& field) {
  if (const ArchiveRow* row = archive.find(cycle, kFieldView, field, kind::kField)) {
    return storedField(archive, *row);
  }
  if (!StackSource::viewsOf(archive, cycle, field).empty()) {
    return fromStacks(archive, cycle, field);
  }
  throw Error(ErrorCode::NotFound,
              fmt::format("a classifier wants field '{}', of which cycle {} has neither the field "
                          "nor stacks",
                          field, cycle));
}

/// Calls add(index, weight) for the samples around a place in cells, centres at whole numbers,
/// clamped at the outermost ones; those that do not weigh are left out.
template <typename Add>
void forCorners(glm::ivec3 size, const glm::dvec3& cell, const Add& add) {
  glm::ivec3 first;
  glm::dvec3 t;
  for (int a = 0; a < 3; ++a) {
    const double v = std::clamp(cell[a], 0.0, double(size[a] - 1));
    first[a] = std::min(int(v), std::max(size[a] - 2, 0));
    t[a] = v - first[a];
    // Rounding of places must not reach for a sample without data.
    if (t[a] < 1e-6) t[a] = 0.0;
  }
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    glm::ivec3 at = first;
    for (int a = 0; a < 3; ++a) {
      const bool up = corner >> a & 1;
      weight *= up ? t[a] : 1.0 - t[a];
      at[a] += up;
    }
    if (!(weight > 0.0)) continue;
    add((std::size_t(at.z) * std::size_t(size.y) + std::size_t(at.y)) * std::size_t(size.x) +
            std::size_t(at.x),
        weight);
  }
}

/// Trilinear, clamped at the outermost centres, between samples with data, which weigh by their
/// shares: NaN where the nearest sample has none (method §1). `value(index)`.
template <typename Value>
double interpolated(glm::ivec3 size, const glm::dvec3& cell, const Value& value) {
  KnownMean mean;
  forCorners(size, cell, [&](std::size_t i, double weight) { mean.add(value(i), weight); });
  return mean.value();
}

/// Where along an axis of so many samples a place in cells of equal width is, counted in samples,
/// and the inverse; `nodes` as GridAxes.
double indexAt(const std::vector<double>& nodes, double place) {
  if (nodes.empty()) return place - 0.5;
  const auto after = std::upper_bound(nodes.begin() + 1, nodes.end() - 1, place);
  const double from = *(after - 1);
  return double(after - nodes.begin() - 1) + (place - from) / (*after - from);
}
double placeAt(const std::vector<double>& nodes, int index) {
  return nodes.empty() ? index + 0.5 : nodes[std::size_t(index)];
}

glm::dvec3 indexAt(const std::array<std::vector<double>, 3>& nodes, const glm::dvec3& place) {
  return {indexAt(nodes[0], place.x), indexAt(nodes[1], place.y), indexAt(nodes[2], place.z)};
}

class Interpolator {
 public:
  Interpolator(const Samples& from, const Samples& to)
      : from_(from),
        to_(to),
        placeFromPlace_(glm::inverse(from.worldFromGrid) * to.worldFromGrid) {}

  float at(int x, int y, int z) const {
    return float(interpolated(from_.size, cellAt(x, y, z),
                              [&](std::size_t i) { return double(from_.values[i]); }));
  }
  /// Of something else that is given at the samples.
  std::uint8_t share(const std::vector<std::uint8_t>& shares, int x, int y, int z) const {
    return std::uint8_t(std::lround(interpolated(
        from_.size, cellAt(x, y, z), [&](std::size_t i) { return double(shares[i]); })));
  }

 private:
  glm::dvec3 cellAt(int x, int y, int z) const {
    const glm::dvec3 place(placeAt(to_.nodes[0], x), placeAt(to_.nodes[1], y),
                           placeAt(to_.nodes[2], z));
    const glm::dvec3 grid(placeFromPlace_ * glm::dvec4(place / glm::dvec3(to_.size), 1.0));
    return indexAt(from_.nodes, grid * glm::dvec3(from_.size));
  }

  const Samples &from_, &to_;
  glm::dmat4 placeFromPlace_;
};

bool sameGrid(const Samples& a, const Samples& b) {
  return a.size == b.size && a.worldFromGrid == b.worldFromGrid && a.nodes == b.nodes;
}

}  // namespace

FieldBundle::FieldBundle(const Archive& archive, long cycle, std::vector<std::string> names)
    : fields(std::move(names)), lengthUnit(archive.lengthUnit()) {
  Samples first;
  bool isKnown = true;
  for (std::size_t j = 0; j < fields.size(); ++j) {
    Samples samples = samplesOf(archive, cycle, fields[j]);
    domains.push_back(samples.domain);
    note += (j ? ", " : "") + samples.note;
    if (j == 0) {
      first = samples;
      values.assign(4 * first.values.size(), 0.0f);
    }
    const bool same = sameGrid(first, samples);
    const Interpolator interpolate(samples, first);
    isKnown = isKnown && samples.wrong;
    Wrong& far = wrong.emplace_back(samples.wrong.value_or(Wrong{}));
    if (!same && !far.share.empty()) far.share.resize(values.size() / 4);
    const auto nx = std::size_t(first.size.x), ny = std::size_t(first.size.y);
    parallelRanges(first.size.z, [&](int begin, int end) {
      for (int z = begin; z < end; ++z) {
        for (std::size_t y = 0; y < ny; ++y) {
          for (std::size_t x = 0; x < nx; ++x) {
            const std::size_t i = (std::size_t(z) * ny + y) * nx + x;
            values[4 * i + j] = same ? samples.values[i] : interpolate.at(int(x), int(y), z);
            if (!same && !far.share.empty())
              far.share[i] = interpolate.share(samples.wrong->share, int(x), int(y), z);
          }
        }
      }
    });
    if (j == 0) first.values.clear();
  }
  if (!isKnown) wrong.clear();
  size = first.size;
  worldFromGrid = first.worldFromGrid;
  low = first.low;
  high = first.high;
  nodes = std::move(first.nodes);
  domain = first.box;
  for (std::size_t i = 0; i < values.size(); i += 4) {
    bool known = true;
    for (std::size_t j = 0; j < fields.size(); ++j) known = known && std::isfinite(values[i + j]);
    if (!known) std::fill_n(values.begin() + std::ptrdiff_t(i), 4, kNone);
  }
}

FieldSample FieldBundle::sample(const glm::dvec3& world) const {
  FieldSample sample;
  sample.values.fill(std::numeric_limits<double>::quiet_NaN());
  for (int a = 0; a < 3; ++a) {
    if (!(world[a] >= domain.low[a] && world[a] <= domain.high[a])) return sample;
  }
  const glm::dvec3 grid(glm::inverse(worldFromGrid) * glm::dvec4(world, 1.0));
  sample.values.fill(0.0);
  for (std::size_t j = 0; j < fields.size(); ++j) {
    sample.values[j] =
        interpolated(size, indexAt(nodes, grid * glm::dvec3(size)), [&](std::size_t i) {
          return domains[j].low + double(values[4 * i + j]) * domains[j].range();
        });
  }
  return sample;
}

std::array<std::vector<double>, 3> FieldBundle::places() const {
  std::array<std::vector<double>, 3> places;
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < size[a]; ++i)
      places[std::size_t(a)].push_back(placeAt(nodes[std::size_t(a)], i) / size[a]);
  return places;
}

namespace {

/// Of a cell along an axis: the cells before and after, itself where one of them has no data, and
/// how far these are apart in cells of equal width.
struct SlopeEnds {
  std::size_t before, after;
  double run;
};

}  // namespace

template <typename Visit>
void FieldBundle::forSlopes(const Visit& visit) const {
  const std::array<std::size_t, 3> stride{1, std::size_t(size.x),
                                          std::size_t(size.x) * std::size_t(size.y)};
  parallelRanges(size.z, [&](int begin, int end) {
    for (int z = begin; z < end; ++z) {
      for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x) {
          const glm::ivec3 at(x, y, z);
          const std::size_t i =
              std::size_t(z) * stride[2] + std::size_t(y) * stride[1] + std::size_t(x);
          if (std::isnan(values[4 * i])) continue;
          std::array<SlopeEnds, 3> ends;
          for (int a = 0; a < 3; ++a) {
            const auto s = stride[std::size_t(a)];
            const bool before = at[a] > 0 && !std::isnan(values[4 * (i - s)]);
            const bool after = at[a] + 1 < size[a] && !std::isnan(values[4 * (i + s)]);
            const auto& axis = nodes[std::size_t(a)];
            ends[std::size_t(a)] = {
                before ? i - s : i, after ? i + s : i,
                placeAt(axis, at[a] + int(after)) - placeAt(axis, at[a] - int(before))};
          }
          visit(i, ends);
        }
      }
    }
  });
}

namespace {

/// World from slopes by cells of equal width.
glm::dmat3 worldFromSlopes(const glm::dmat4& worldFromGrid, glm::ivec3 size) {
  glm::dmat3 m = glm::inverse(glm::dmat3(worldFromGrid));
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) m[column][row] *= double(size[row]);
  return glm::transpose(m);
}

}  // namespace

std::vector<float> FieldBundle::gradients() const {
  std::vector<float> norms(values.size() / 4, kNone);
  const glm::dmat3 worldFromSlope = worldFromSlopes(worldFromGrid, size);
  forSlopes([&](std::size_t i, const std::array<SlopeEnds, 3>& ends) {
    double squares = 0.0;
    for (std::size_t j = 0; j < fields.size(); ++j) {
      glm::dvec3 slope(0.0);
      for (int a = 0; a < 3; ++a) {
        const auto& [before, after, run] = ends[std::size_t(a)];
        if (before != after)
          slope[a] = (double(values[4 * after + j]) - double(values[4 * before + j])) / run;
      }
      const glm::dvec3 gradient = worldFromSlope * slope;
      squares += glm::dot(gradient, gradient);
    }
    norms[i] = float(std::sqrt(squares) / lengthUnit);
  });
  return norms;
}

std::vector<float> FieldBundle::gradientsWrong() const {
  std::vector<float> far(values.size() / 4, 0.0f);
  const glm::dmat3 worldFromSlope = worldFromSlopes(worldFromGrid, size);
  forSlopes([&](std::size_t i, const std::array<SlopeEnds, 3>& ends) {
    double squares = 0.0;
    for (const Wrong& each : wrong) {
      for (int a = 0; a < 3; ++a) {
        const auto& [before, after, run] = ends[std::size_t(a)];
        if (before == after) continue;
        const double slope = std::hypot(each.at(before), each.at(after)) / run;
        squares += slope * slope * glm::dot(worldFromSlope[a], worldFromSlope[a]);
      }
    }
    far[i] = float(std::sqrt(squares) / lengthUnit);
  });
  return far;
}

}  // namespace vestige
