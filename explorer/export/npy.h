// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace vestige {

enum class NpyType { Float32, Float64 };

/// What stands before the values of a NumPy .npy file, version 1.0: little-endian values in C
/// order follow.
std::string npyHeader(NpyType type, std::span<const std::size_t> shape);

}  // namespace vestige
