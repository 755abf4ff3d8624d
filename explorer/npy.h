// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace vestige {

/// The bytes of a NumPy .npy file, version 1.0: little-endian float32 in C order. Throws
/// InvalidArgument when the shape does not hold exactly the values.
std::vector<std::byte> encodeNpy(std::span<const float> values, std::span<const std::size_t> shape);

}  // namespace vestige
