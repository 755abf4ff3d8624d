// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/ingest/ingest_statistics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>

#include "proxy/base/parallel.h"

namespace vestige {
namespace {

/// Count, mean and sum of squared deviations; combined by Chan's update, which keeps the digits of
/// 101325 ± 0.01.
struct Moments {
  std::uint64_t samples = 0;
  std::uint64_t finite = 0;
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  double mean = 0.0;
  long double squares = 0.0;  ///< whose exponents hold squares of 1e300 and of 1e-300

  void add(const Moments& other) {
    samples += other.samples;
    if (other.finite == 0) return;
    const double ours = double(finite), theirs = double(other.finite), all = ours + theirs;
    const double delta = other.mean - mean;
    mean += delta * (theirs / all);
    squares += other.squares + static_cast<long double>(delta) * delta * (ours * theirs / all);
    finite += other.finite;
    low = std::min(low, other.low);
    high = std::max(high, other.high);
  }
};

/// Moments of one row. Eight running values side by side: independent additions, and an order of
/// summation that no compiler or thread changes.
Moments momentsOf(const double* values, int count) {
  constexpr int kLanes = 8;
  std::array<double, kLanes> sum{}, squares{}, low, high;
  std::array<std::int64_t, kLanes> finite{};
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  const auto visit = [count](const auto& one) {
    int i = 0;
    for (; i + kLanes <= count; i += kLanes) {
      for (int lane = 0; lane < kLanes; ++lane) one(i + lane, std::size_t(lane));
    }
    for (; i < count; ++i) one(i, 0);
  };
  visit([&](int i, std::size_t lane) {
    const double value = values[i];
    const bool isFinite = value == value;
    finite[lane] += isFinite;
    sum[lane] += isFinite ? value : 0.0;
    low[lane] = value < low[lane] ? value : low[lane];
    high[lane] = value > high[lane] ? value : high[lane];
  });
  Moments row;
  row.samples = std::uint64_t(count);
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    row.finite += std::uint64_t(finite[lane]);
    row.mean += sum[lane];
    row.low = std::min(row.low, low[lane]);
    row.high = std::max(row.high, high[lane]);
  }
  if (row.finite == 0) return row;
  row.mean /= double(row.finite);
  if (!std::isfinite(row.mean)) {
    // The sum is beyond double, the mean is not.
    long double wide = 0.0;
    for (int i = 0; i < count; ++i) wide += values[i] == values[i] ? values[i] : 0.0;
    row.mean = double(wide / static_cast<long double>(row.finite));
  }
  visit([&](int i, std::size_t lane) {
    const double delta = values[i] - row.mean;
    squares[lane] += delta == delta ? delta * delta : 0.0;
  });
  for (const double part : squares) row.squares += part;
  const double width = row.high - row.low;
  if (width > 1e-140 && width < 1e140) return row;
  row.squares = 0.0;
  for (int i = 0; i < count; ++i) {
    const long double delta = static_cast<long double>(values[i]) - row.mean;
    if (delta == delta) row.squares += delta * delta;
  }
  return row;
}

/// One plane of one part: the unit of work, and of the order in which results are combined.
struct Plane {
  const FieldPart* part;
  int z;
};

std::vector<Plane> planesOf(const std::vector<FieldPart>& parts) {
  std::vector<Plane> planes;
  for (const auto& part : parts) {
    if (part.own.high[0] <= part.own.low[0] || part.own.high[1] <= part.own.low[1]) continue;
    for (int z = part.own.low[2]; z < part.own.high[2]; ++z) planes.push_back({&part, z});
  }
  return planes;
}

template <class Visit>
void visitRows(const Plane& plane, Visit visit) {
  const auto& [reader, own, faces] = *plane.part;
  std::vector<double> row(std::size_t(reader.size()[0]));
  for (int y = own.low[1]; y < own.high[1]; ++y) {
    reader.row(y, plane.z, row.data());
    visit(row.data());
  }
}

/// Widens a range by a row's values on the faces across it.
void widenByFaces(const FieldPart& part, const double* row, Moments& range) {
  for (const auto& [below, weight] : part.faces[0]) {
    const double value = (1.0 - weight) * row[below] + weight * row[below + 1];
    if (!std::isfinite(value)) continue;
    range.low = std::min(range.low, value);
    range.high = std::max(range.high, value);
  }
}

/// Widens a range by the rows that run in the faces along it: between samples in y, in z or in
/// both.
void widenByRowsInFaces(const FieldPart& part, Moments& range) {
  const auto& own = part.own;
  // Every place of an axis: own samples, then the faces.
  const auto placesOf = [&](std::size_t a) {
    std::vector<SamplePlace> places;
    for (int i = own.low[a]; i < own.high[a]; ++i) places.push_back({i, 0.0});
    places.insert(places.end(), part.faces[a].begin(), part.faces[a].end());
    return places;
  };
  if (own.empty() || (part.faces[1].empty() && part.faces[2].empty())) return;
  std::vector<double> sum(std::size_t(part.reader.size()[0])), row(sum.size());
  const auto ys = placesOf(1), zs = placesOf(2);
  for (const auto& z : zs) {
    for (const auto& y : ys) {
      if (y.weight == 0.0 && z.weight == 0.0) continue;
      std::fill(sum.begin(), sum.end(), 0.0);
      for (const int dz : {0, 1}) {
        for (const int dy : {0, 1}) {
          const double weight = (dz ? z.weight : 1.0 - z.weight) * (dy ? y.weight : 1.0 - y.weight);
          if (weight == 0.0) continue;
          part.reader.row(y.below + dy, z.below + dz, row.data());
          for (std::size_t x = 0; x < sum.size(); ++x) sum[x] += weight * row[x];
        }
      }
      const auto inFace = momentsOf(sum.data() + own.low[0], own.high[0] - own.low[0]);
      range.low = std::min(range.low, inFace.low);
      range.high = std::max(range.high, inFace.high);
      widenByFaces(part, sum.data(), range);
    }
  }
}

}  // namespace

FieldStatistics measureField(const std::vector<FieldPart>& parts, int threads,
                             std::optional<std::pair<double, double>> ends, int bins) {
  const auto planes = planesOf(parts);
  std::vector<Moments> partial(planes.size());
  parallelFor(int(planes.size()), threads, [&](int i) {
    const auto& part = *planes[std::size_t(i)].part;
    auto& moments = partial[std::size_t(i)];
    visitRows(planes[std::size_t(i)], [&](const double* row) {
      moments.add(momentsOf(row + part.own.low[0], part.own.high[0] - part.own.low[0]));
      widenByFaces(part, row, moments);
    });
  });
  Moments all;
  for (const auto& moments : partial) all.add(moments);
  for (const auto& part : parts) widenByRowsInFaces(part, all);

  FieldStatistics result;
  result.count = all.samples;
  result.noData = all.samples - all.finite;
  result.histogram.assign(std::size_t(bins), 0);
  if (all.finite == 0) return result;
  result.low = all.low;
  result.high = all.high;
  // The mean of equal values may round to one beyond them.
  result.mean = std::clamp(all.mean, all.low, all.high);
  result.deviation = double(std::sqrt(all.squares / double(all.finite)));

  const double width = all.high - all.low;
  // Bins per unit; a constant field, and one whose range overflows, falls into the first bin.
  const double perBin = double(bins) / width;
  const double scale = width > 0.0 && std::isfinite(width * perBin) ? perBin : 0.0;
  // Where nothing is outside there is nothing to count.
  const double least = ends ? ends->first : all.low, most = ends ? ends->second : all.high;
  const bool counts = all.low < least || all.high > most;
  std::mutex mutex;
  parallelFor(int(planes.size()), threads, [&](int i) {
    // Neighbours fall into the same bin often: each of four has a count of its own, so that none
    // waits for the one before.
    std::vector<std::array<std::uint32_t, 4>> histogram(std::size_t(bins), {0, 0, 0, 0});
    const auto& own = planes[std::size_t(i)].part->own;
    std::uint64_t below = 0, above = 0;
    visitRows(planes[std::size_t(i)], [&](const double* row) {
      for (int x = own.low[0]; counts && x < own.high[0]; ++x) {
        below += row[x] < least;
        above += row[x] > most;
      }
      for (int x = own.low[0]; x < own.high[0]; ++x) {
        if (std::isnan(row[x])) continue;
        const int bin = scale > 0.0 ? int((row[x] - all.low) * scale) : 0;
        ++histogram[std::size_t(std::min(bin, bins - 1))][std::size_t(x & 3)];
      }
    });
    const std::lock_guard lock(mutex);
    result.below += below;
    result.above += above;
    for (std::size_t b = 0; b < histogram.size(); ++b) {
      for (const std::uint32_t count : histogram[b]) result.histogram[b] += count;
    }
  });
  return result;
}

}  // namespace vestige
