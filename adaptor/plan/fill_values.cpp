// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/plan/fill_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>

#include "proxy/base/parallel.h"

namespace vestige {
namespace {

constexpr double kShare = 0.01;  ///< of the samples
constexpr double kGap = 0.1;     ///< to the other values, over their range
constexpr double kFar = 1e6;     ///< times as large as all others: no value of theirs

/// Magnitudes in use for samples without data: of models and stations, of integers' ends, of
/// NetCDF, well logs and scanners.
constexpr std::array kInUse{999.0,
                            9999.0,
                            99999.0,
                            999999.0,
                            9999999.0,
                            99999999.0,
                            999999999.0,
                            999.25,
                            999.9,
                            9999.9,
                            9.99e33,
                            9.969209968386869e36,
                            2000.0,
                            3024.0,
                            32767.0,
                            32768.0,
                            2147483647.0,
                            2147483648.0,
                            9223372036854775807.0,
                            double(std::numeric_limits<float>::max()),
                            std::numeric_limits<double>::max()};
/// Tens, hundreds and thousands of Hounsfield units and the like are fills where they are negative.
constexpr double kNegativeOnly = 5000.0;

/// The value in use that this is, but for the rounding to float; NaN = none.
double inUse(double value) {
  const double size = std::abs(value);
  const auto same = [&](double known) { return std::abs(size - known) <= 1e-7 * known; };
  for (const double known : kInUse) {
    const bool scanner = known == 2000.0 || known == 3024.0;
    if (same(known) && !(scanner && value > 0.0 && value < kNegativeOnly))
      return std::copysign(known, value);
  }
  const double power = std::pow(10.0, std::nearbyint(std::log10(size)));
  return size >= 1e10 && same(power) ? std::copysign(power, value)
                                     : std::numeric_limits<double>::quiet_NaN();
}

struct Others {
  std::uint64_t equal = 0;  ///< to the value
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
};

Others othersThan(double value, const std::vector<FieldPart>& parts, int threads) {
  Others all;
  std::mutex mutex;
  for (const FieldPart& part : parts) {
    const auto& own = part.own;
    parallelFor(own.high[2] - own.low[2], threads, [&](int layer) {
      Others here;
      std::vector<double> row(std::size_t(part.reader.size()[0]));
      for (int y = own.low[1]; y < own.high[1]; ++y) {
        part.reader.row(y, own.low[2] + layer, row.data());
        for (int x = own.low[0]; x < own.high[0]; ++x) {
          const double sample = row[std::size_t(x)];
          if (sample == value) {
            ++here.equal;
          } else if (!std::isnan(sample)) {
            here.low = std::min(here.low, sample);
            here.high = std::max(here.high, sample);
          }
        }
      }
      const std::lock_guard lock(mutex);
      all.equal += here.equal;
      all.low = std::min(all.low, here.low);
      all.high = std::max(all.high, here.high);
    });
  }
  return all;
}

/// Whether a histogram's outermost bin is full enough, and those beside it are empty.
template <class Bin>
bool standsAlone(Bin bin, Bin end, double least) {
  if (!(double(*bin) > least)) return false;
  const auto bins = std::distance(bin, end);
  const auto gap = std::ptrdiff_t(std::floor(kGap / (1.0 + kGap) * double(bins))) - 2;
  return gap < bins && std::all_of(bin + 1, bin + 1 + gap, [](auto count) { return count == 0; });
}

}  // namespace

std::string shortest(double value) {
  return double(float(value)) == value ? fmt::format("{}", float(value)) : fmt::format("{}", value);
}

std::optional<SuspectedFill> suspectedFill(const PlannedField& field,
                                           const FieldStatistics& statistics,
                                           const BlockSet& blocks, int threads) {
  const auto& bins = statistics.histogram;
  if (!(statistics.low < statistics.high) || bins.size() < 16 || !field.terms.empty()) return {};
  const double least = kShare * double(statistics.count);
  std::vector<double> candidates;
  if (standsAlone(bins.begin(), bins.end(), least)) candidates.push_back(statistics.low);
  if (standsAlone(bins.rbegin(), bins.rend(), least)) candidates.push_back(statistics.high);
  const int component = field.derivation.component;
  for (const double value : candidates) {
    const auto parts = partsOf(field, blocks);
    const Others others = othersThan(value, parts, threads);
    if (!(double(others.equal) > least) || !(others.low <= others.high)) continue;
    const double gap = value < others.low ? others.low - value : value - others.high;
    if (!(gap >= kGap * (others.high - others.low))) continue;
    // A magnitude of components that all are the fill.
    const double sample = component < 0 ? value / std::sqrt(double(field.components)) : value;
    const double known = inUse(sample);
    const double largest = std::max(std::abs(others.low), std::abs(others.high));
    const bool far = others.low < others.high && component >= 0 && largest > 0.0 &&
                     std::abs(value) / largest >= kFar;
    if (std::isnan(known) && !far) continue;
    return SuspectedFill{far || component >= 0 ? sample : known,
                         double(others.equal) / double(statistics.count), others.low, others.high};
  }
  return {};
}

}  // namespace vestige
