// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "adaptor/ingest/block_set.h"

namespace vestige {

/// Writes a block and its fields as VTK XML ImageData, or RectilinearGrid if an axis has explicit
/// coordinates: raw appended data, straight from the host's memory, components side by side. Masks
/// become UInt8 arrays "vestige:mask", 1 = no data. Throws Io / NoSpace with path and reason.
void writeVtkXml(const std::filesystem::path& path, const Block& block);

}  // namespace vestige
