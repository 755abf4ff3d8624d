// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "proxy/camera/raster.h"

namespace vestige {

/// Deterministic PNG bytes (RGBA, or RGB where every alpha is 255), fast compression.
std::vector<std::byte> encodePng(const Raster& raster);
/// Throws Io, or Format with file and reason; at most 32768 pixels a side.
Raster readPng(const std::filesystem::path& path);
/// Writes through a temporary file and a rename. Throws Io / NoSpace.
void writePng(const std::filesystem::path& path, const Raster& raster);

}  // namespace vestige
