// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/renderer/stated_error.h"

#include <fmt/format.h>

#include <algorithm>

#include "proxy/format/layout/proxy_layout.h"

namespace vestige {
namespace {

constexpr StatedError kAnything{false, 1.0, 1.0};

double shareOf(double part, double whole) {
  if (!(whole > 0.0)) return part > 0.0 ? 1.0 : 0.0;
  return std::clamp(part / whole, 0.0, 1.0);
}

/// The widest interval that a value of the step may lie in; below and above the bounds count too.
double intervalShare(const ProxyHeader& header) {
  if (!header.partition) return 1.0;
  const double low = header.statistics.low, high = header.statistics.high;
  const auto bounds = header.partition->bounds();
  double widest = std::max({0.0, bounds.front() - low, high - bounds.back()});
  for (std::size_t k = 0; k + 1 < bounds.size(); ++k) {
    if (bounds[k + 1] < low || bounds[k] > high) continue;
    widest = std::max(widest, std::min(high, bounds[k + 1]) - std::max(low, bounds[k]));
  }
  return shareOf(widest, high - low);
}

StatedError ofField(const ProxyHeader& header) {
  if (!header.grid) return kAnything;
  const FieldGrid& grid = *header.grid;
  // The run's own samples, drawn where they are.
  if (grid.reduction == 1) return {true, shareOf(grid.tolerance, grid.high - grid.low), 0.0};
  double place = 0.0;
  for (const FieldAxis& axis : grid.axes) {
    double widest = 0.0;
    for (int i = 1; i < axis.count; ++i) widest = std::max(widest, axis.at(i) - axis.at(i - 1));
    place = std::max(place, shareOf(0.5 * widest, axis.at(axis.count - 1) - axis.at(0)));
  }
  return {false, 1.0, place};
}

StatedError ofStack(const ProxyHeader& header) {
  double thickest = 0.0;
  for (std::size_t s = 0; s + 1 < header.slabDepths.size(); ++s) {
    thickest = std::max(thickest, header.slabDepths[s + 1] - header.slabDepths[s]);
  }
  const DepthRange range = depthRange(header.camera, header.domain);
  // A run whose samples stand closer than slabs may turn more often in one than a stack can tell.
  return {true, intervalShare(header), shareOf(thickest, range.high - range.low)};
}

}  // namespace

std::string StatedError::text() const {
  if (!bounded) return "nothing bounds what is missing";
  if (sum() == 0.0) return "exact";
  const std::string values = fmt::format("values within {:.3g} % of the range", 100.0 * value);
  if (place == 0.0) return values;
  return values + (place < 1.0 ? fmt::format(", places within {:.3g} % of the depth", 100.0 * place)
                               : std::string(", their order along a ray is not stored"));
}

StatedError statedError(const ProxyHeader& header, const Asked& asked) {
  if (header.kind == kind::kField) return ofField(header);
  if (header.kind == kind::kSliced) return ofStack(header);
  if (header.kind == kind::kLength) {
    return {!asked.turned, asked.turned ? 1.0 : intervalShare(header), 1.0};
  }
  const bool picture = header.kind == kind::kLayered || header.kind == kind::kReference;
  if (picture && !asked.turned && !asked.edited) return {};
  return kAnything;
}

SampleError sampleError(const ProxyHeader& header, double value) {
  if (header.grid)
    return {header.grid->tolerance,
            fmt::format("the tolerance of the stored field, {:.4g}", header.grid->tolerance)};
  if (!header.partition) return {};
  const IntervalPartition& partition = *header.partition;
  const int channel = partition.channelOf(value);
  if (channel == partition.noData()) return {};
  double low = std::min(header.statistics.low, partition.low()), high = partition.low();
  if (channel < partition.intervals()) {
    low = partition.bounds()[std::size_t(channel)];
    high = partition.bounds()[std::size_t(channel) + 1];
  } else if (channel == partition.above()) {
    low = partition.high();
    high = std::max(header.statistics.high, low);
  }
  return {high - low, fmt::format("its interval in the stacks, {:.6g} to {:.6g}", low, high)};
}

}  // namespace vestige
