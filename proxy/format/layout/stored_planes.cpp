// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/layout/stored_planes.h"

#include <fmt/format.h>

#include <cmath>

#include "proxy/base/error.h"

namespace vestige {

void requirePlanes(const char* what, std::size_t values, std::size_t count, ImageSize size) {
  if (values != count * size.pixels())
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("{} has {} values, {} planes of {} x {} need {}", what, values, count,
                            size.width, size.height, count * size.pixels()));
}

std::span<const float> planeOf(std::span<const float> planes, std::size_t i, ImageSize size) {
  return planes.subspan(i * size.pixels(), size.pixels());
}

const IntervalPartition& partitionOf(const ProxyHeader& header) {
  if (!header.partition)
    throw Error(
        ErrorCode::InvalidArgument,
        fmt::format("the {} proxy of field '{}' has no intervals", header.kind, header.field));
  return *header.partition;
}

double diagonalOf(const Box& domain) {
  const double diagonal = domain.diagonal();
  return diagonal > 0.0 && std::isfinite(diagonal) ? diagonal : 1.0;
}

std::string slabName(int slab) { return fmt::format("slab{:02d}", slab); }

}  // namespace vestige
