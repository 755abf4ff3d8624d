// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/ingest/field_view.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "proxy/base/parallel.h"

namespace vestige {
namespace {

constexpr double kNoData = std::numeric_limits<double>::quiet_NaN();

template <class T>
void convertRow(const std::byte* from, std::ptrdiff_t stride, int count, double* out) {
  // memcpy, for hosts whose records are packed without regard to alignment; x - x is 0 for what is
  // finite and NaN else, which sends infinities to "no data" without a branch.
  const auto convert = [&](std::ptrdiff_t step) {
    for (int i = 0; i < count; ++i) {
      T sample;
      std::memcpy(&sample, from + i * step, sizeof sample);
      const double value = static_cast<double>(sample);
      if constexpr (std::is_floating_point_v<T>) {
        out[i] = value + (value - value);
      } else {
        out[i] = value;
      }
    }
  };
  if (stride == std::ptrdiff_t(sizeof(T))) {
    convert(std::ptrdiff_t(sizeof(T)));  // a constant: the compiler makes vector code of it
  } else {
    convert(stride);
  }
}

using RowConverter = void (*)(const std::byte*, std::ptrdiff_t, int, double*);

RowConverter converterOf(SampleType type) {
  switch (type) {
    case SampleType::Float32:
      return convertRow<float>;
    case SampleType::Float64:
      return convertRow<double>;
    case SampleType::Int8:
      return convertRow<std::int8_t>;
    case SampleType::UInt8:
      return convertRow<std::uint8_t>;
    case SampleType::Int16:
      return convertRow<std::int16_t>;
    case SampleType::UInt16:
      return convertRow<std::uint16_t>;
    case SampleType::Int32:
      return convertRow<std::int32_t>;
    case SampleType::UInt32:
      return convertRow<std::uint32_t>;
    case SampleType::Int64:
      return convertRow<std::int64_t>;
    case SampleType::UInt64:
      return convertRow<std::uint64_t>;
  }
  return convertRow<float>;
}

/// Ranges of no data as samples of a type hold them, in double.
std::vector<ValueRange> heldBy(SampleType type, const std::vector<ValueRange>& ranges) {
  std::vector<ValueRange> held;
  for (const auto& [low, high] : ranges) {
    const double floatLow = double(float(low)), floatHigh = double(float(high));
    if (low < high) {
      const bool single = type == SampleType::Float32;
      held.push_back(
          {single ? std::min(low, floatLow) : low, single ? std::max(high, floatHigh) : high});
      continue;
    }
    if (type != SampleType::Float32) held.push_back({low, low});
    // Doubles may have been read from a file of floats.
    if (type == SampleType::Float32 || (type == SampleType::Float64 && floatLow != low))
      held.push_back({floatLow, floatLow});
  }
  return held;
}

/// A row of scratch memory per thread, so that reading rows allocates nothing.
std::vector<double>& scratch(int which, int size) {
  thread_local std::array<std::vector<double>, 6> rows;
  auto& row = rows[std::size_t(which)];
  if (int(row.size()) < size) row.resize(std::size_t(size));
  return row;
}

/// The derivative at the middle one of three samples: central where both neighbours are there,
/// one-sided where one is, 0 along an axis without extent or where both lack data: a sample with
/// data stays one.
double derivative(double before, double here, double after, double xBefore, double x, double xAfter,
                  bool hasBefore, bool hasAfter) {
  const bool useBefore = hasBefore && !std::isnan(before);
  const bool useAfter = hasAfter && !std::isnan(after);
  if (useBefore && useAfter) return (after - before) / (xAfter - xBefore);
  if (useBefore) return (here - before) / (x - xBefore);
  if (useAfter) return (after - here) / (xAfter - x);
  return 0.0;
}

}  // namespace

std::size_t sizeOf(SampleType type) {
  static constexpr std::array<std::size_t, kSampleTypes> sizes{4, 8, 1, 1, 2, 2, 4, 4, 8, 8};
  return sizes[std::size_t(type)];
}

const char* nameOf(SampleType type) {
  static constexpr std::array<const char*, kSampleTypes> names{
      "Float32", "Float64", "Int8",   "UInt8", "Int16",
      "UInt16",  "Int32",   "UInt32", "Int64", "UInt64"};
  return names[std::size_t(type)];
}

const char* nameOf(Location location) { return location == Location::Point ? "point" : "cell"; }

FieldReader::FieldReader(const FieldView& field, std::optional<MaskView> mask,
                         Derivation derivation, const std::array<std::vector<double>, 3>& nodes)
    : field_(field), mask_(mask), derivation_(std::move(derivation)), nodes_(nodes) {
  derivation_.noData = heldBy(field.type, derivation_.noData);
}

FieldReader::FieldReader(std::vector<FieldReader> terms, std::vector<double> ranges)
    : nodes_(terms.at(0).nodes_), terms_(std::move(terms)), ranges_(std::move(ranges)) {
  field_.size = terms_[0].size();
}

void FieldReader::row(int y, int z, double* out) const {
  if (!terms_.empty()) {
    normRow(y, z, out);
  } else if (derivation_.gradient) {
    gradientRow(y, z, out);
  } else {
    scalarRow(y, z, out);
  }
}

void FieldReader::scalarRow(int y, int z, double* out) const {
  const int count = field_.size[0];
  const auto offset = y * field_.strides[1] + z * field_.strides[2];
  if (derivation_.component >= 0) {
    componentRow(std::size_t(derivation_.component), offset, out);
  } else {
    magnitudeRow(offset, out);
  }
  if (mask_) {
    const auto* bytes = mask_->data + y * mask_->strides[1] + z * mask_->strides[2];
    for (int i = 0; i < count; ++i) {
      if (std::to_integer<std::uint8_t>(bytes[i * mask_->strides[0]]) & mask_->bits) {
        out[i] = kNoData;
      }
    }
  }
}

void FieldReader::componentRow(std::size_t component, std::ptrdiff_t offset, double* out) const {
  const int count = field_.size[0];
  converterOf(field_.type)(field_.components[component] + offset, field_.strides[0], count, out);
  for (const auto& [low, high] : derivation_.noData)
    for (int i = 0; i < count; ++i) out[i] = out[i] >= low && out[i] <= high ? kNoData : out[i];
}

void FieldReader::magnitudeRow(std::ptrdiff_t offset, double* out) const {
  const int count = field_.size[0];
  auto& component = scratch(0, count);
  std::fill_n(out, count, 0.0);
  for (std::size_t c = 0; c < field_.components.size(); ++c) {
    componentRow(c, offset, component.data());
    for (int i = 0; i < count; ++i) out[i] += component[std::size_t(i)] * component[std::size_t(i)];
  }
  bool extreme = false;
  for (int i = 0; i < count; ++i) {
    extreme |= !(out[i] < 1e280) || (out[i] < 1e-280 && out[i] > 0.0);
    out[i] = std::sqrt(out[i]);
  }
  if (!extreme) return;
  // Squares that overflow or underflow, or no data: the same with the largest component factored
  // out.
  auto& largest = scratch(1, count);
  std::fill_n(largest.begin(), count, 0.0);
  for (std::size_t c = 0; c < field_.components.size(); ++c) {
    componentRow(c, offset, component.data());
    for (int i = 0; i < count; ++i) {
      auto& most = largest[std::size_t(i)];
      most = std::max(most, std::abs(component[std::size_t(i)]));
    }
  }
  std::fill_n(out, count, 0.0);
  for (std::size_t c = 0; c < field_.components.size(); ++c) {
    componentRow(c, offset, component.data());
    for (int i = 0; i < count; ++i) {
      const double most = largest[std::size_t(i)];
      const double ratio = component[std::size_t(i)] / (most > 0.0 ? most : 1.0);
      out[i] += ratio * ratio;
    }
  }
  for (int i = 0; i < count; ++i) {
    const double value = largest[std::size_t(i)] * std::sqrt(out[i]);
    out[i] = value + (value - value);
  }
}

namespace {

/// sqrt(a^2 + b^2) where squares may be beyond double.
double norm(double a, double b) {
  const double squares = a * a + b * b;
  return squares > 1e-280 && squares < 1e280 ? std::sqrt(squares) : std::hypot(a, b);
}

/// Three rows to work in.
struct WorkRows {
  std::vector<double>&here, &before, &after;
};

/// The gradient's magnitude along a row of what `rowAt(y, z, out)` gives.
template <class RowAt>
void gradientOfRows(const RowAt& rowAt, const std::array<int, 3>& size,
                    const std::array<std::vector<double>, 3>& allNodes, const WorkRows& work, int y,
                    int z, double* out) {
  const auto [nx, ny, nz] = size;
  auto& [here, before, after] = work;
  rowAt(y, z, here.data());
  const auto& x = allNodes[0];
  for (int i = 0; i < nx; ++i) {
    const auto at = std::size_t(i);
    const bool hasBefore = i > 0, hasAfter = i + 1 < nx;
    out[at] = derivative(hasBefore ? here[at - 1] : 0.0, here[at], hasAfter ? here[at + 1] : 0.0,
                         hasBefore ? x[at - 1] : 0.0, x[at], hasAfter ? x[at + 1] : 0.0, hasBefore,
                         hasAfter);
  }
  // Across rows: along y, then along z.
  for (int axis = 1; axis <= 2; ++axis) {
    const int index = axis == 1 ? y : z;
    const bool hasBefore = index > 0, hasAfter = index + 1 < (axis == 1 ? ny : nz);
    const auto& nodes = allNodes[std::size_t(axis)];
    const int dy = axis == 1 ? 1 : 0, dz = axis == 2 ? 1 : 0;
    if (hasBefore) rowAt(y - dy, z - dz, before.data());
    if (hasAfter) rowAt(y + dy, z + dz, after.data());
    const double at = nodes[std::size_t(index)];
    const double atBefore = hasBefore ? nodes[std::size_t(index) - 1] : 0.0;
    const double atAfter = hasAfter ? nodes[std::size_t(index) + 1] : 0.0;
    for (int i = 0; i < nx; ++i) {
      const auto k = std::size_t(i);
      const double d =
          derivative(before[k], here[k], after[k], atBefore, at, atAfter, hasBefore, hasAfter);
      out[k] = norm(out[k], d);
    }
  }
  for (int i = 0; i < nx; ++i) {
    const auto k = std::size_t(i);
    const double value = std::abs(out[k]);
    out[i] = std::isnan(here[k]) ? kNoData : value + (value - value);
  }
}

}  // namespace

void FieldReader::gradientRow(int y, int z, double* out) const {
  const int nx = field_.size[0];
  gradientOfRows([this](int j, int k, double* to) { scalarRow(j, k, to); }, field_.size, nodes_,
                 {scratch(2, nx), scratch(3, nx), scratch(4, nx)}, y, z, out);
}

void FieldReader::normRow(int y, int z, double* out) const {
  const int nx = field_.size[0];
  // Rows of its own: a term may be a norm itself.
  std::array<std::vector<double>, 4> rows;
  for (auto& row : rows) row.resize(std::size_t(nx));
  auto& gradient = rows[3];
  std::fill_n(out, nx, 0.0);
  for (std::size_t t = 0; t < terms_.size(); ++t) {
    // Values by their range first: gradients in the field's units may be beyond double.
    const auto shares = [&term = terms_[t], nx, range = ranges_[t]](int j, int k, double* to) {
      term.row(j, k, to);
      for (int i = 0; i < nx; ++i) to[i] /= range;
    };
    gradientOfRows(shares, field_.size, nodes_, {rows[0], rows[1], rows[2]}, y, z, gradient.data());
    for (int i = 0; i < nx; ++i) out[i] = norm(out[i], gradient[std::size_t(i)]);
  }
  for (int i = 0; i < nx; ++i) out[i] += out[i] - out[i];  // infinite: no data
}

void fillNormalised(const FieldReader& reader, double low, double high, const SampleRange& window,
                    int z0, int z1, float* out, int threads, double most) {
  const auto [x0, y0, zFirst] = window.low;
  const int nx = window.high[0] - x0, ny = window.high[1] - y0;
  const double width = high - low;
  // A task is a bundle of rows: large enough to be worth a thread, small enough to share out.
  constexpr int kRows = 64;
  const int rows = (z1 - z0) * ny;
  parallelFor((rows + kRows - 1) / kRows, threads,
              [&, x0 = x0, y0 = y0, zFirst = zFirst](int task) {
                std::vector<double> values(std::size_t(reader.size()[0]), 0.0);
                const double* from = values.data() + x0;
                for (int r = task * kRows; r < std::min(rows, (task + 1) * kRows); ++r) {
                  reader.row(y0 + r % ny, zFirst + z0 + r / ny, values.data());
                  float* to = out + std::size_t(r) * std::size_t(nx);
                  for (int i = 0; i < nx; ++i)
                    to[i] = float(std::clamp((from[i] - low) / width, -most, most));
                }
              });
}

}  // namespace vestige
