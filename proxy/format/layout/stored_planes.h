// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>

#include "proxy/camera/box.h"
#include "proxy/format/image/proxy_image.h"

namespace vestige {

// What the layouts of all kinds share: how planes of a view are checked, named and rounded.

inline constexpr double kFractionStep = 0x1p-12;
inline constexpr double kDepthLevels = 2046.0;  ///< of mean depth over the domain

/// Throws InvalidArgument, naming `what`, unless its values are `count` planes of this size.
void requirePlanes(const char* what, std::size_t values, std::size_t count, ImageSize size);
/// Plane i of planes that follow each other.
std::span<const float> planeOf(std::span<const float> planes, std::size_t i, ImageSize size);
/// The header's partition; InvalidArgument when it has none.
const IntervalPartition& partitionOf(const ProxyHeader& header);
/// The domain's diagonal, 1 where it has no finite one above 0.
double diagonalOf(const Box& domain);
/// "slab07", the part of a slab of a stack.
std::string slabName(int slab);

}  // namespace vestige
