// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "proxy/format/layout/analytic_layers_layout.h"

namespace vestige::test {

/// A way to store layers in OpenEXR: what the choice of the product's own was made among.
struct LayeredStorage {
  std::string name;  ///< of its lines
  enum class Compression { Zip, Piz, Dwaa } compression = Compression::Zip;
  float level = 4.0f;    ///< of zip (1..9) and of DWAA (larger is smaller and worse)
  bool floats = false;   ///< colours and optical depths as float instead of half
  bool integers = true;  ///< steps of storage as small integers, as the product has them
};

/// Zip, PIZ and DWAA at several levels, halves and floats.
const std::vector<LayeredStorage>& layeredStorages();

/// Layers that went through a file, and its bytes.
struct StoredAs {
  AnalyticLayerPlanes planes;
  std::size_t bytes = 0;
};

/// `planes` as the product would store them.
StoredAs storeLayers(const ProxyHeader& header, const AnalyticLayerPlanes& planes,
                     const LayeredStorage& storage);

}  // namespace vestige::test
