// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "proxy/format/exr/exr_file.h"

namespace vestige {

/// What the numbers of a channel are.
struct ExportChannel {
  std::string name, meaning;
  std::string units;                ///< the field's, "world length", or "1"
  std::optional<double> low, high;  ///< of an interval's values; absent = open, or none
};

/// An array of numbers as they are meant: in the field's and in world units, NaN = there is
/// nothing. It comes in blocks, so that no more than one is held.
struct ExportArray {
  std::string part;   ///< a name within the proxy; empty: the proxy is one array
  std::string outer;  ///< what the blocks are: "slab", "z", "cluster"; empty: there is one
  std::size_t blocks = 1;
  bool pictures = true;  ///< each channel of a block is a plane of `size`, row by row from the top
                         ///< (fields: y rising); else one number
  ImageSize size;
  bool isDouble = false;  ///< worth more than a float
  std::vector<ExportChannel> channels;
  bool oneChannel = false;  ///< the shape has no dimension of channels
  /// Of x, y (pixels or samples) and of blocks that are samples.
  std::vector<std::vector<double>> axes;
  std::string axesMeaning;
  std::vector<double> slabDepths;  ///< planar, of the faces between slabs
  double error = 0.0;              ///< largest of storage, in the channels' units
  std::function<std::vector<double>(std::size_t block)> values;  ///< [channel][y][x]

  /// In C order, and the names of these dimensions.
  std::vector<std::size_t> shape() const;
  std::vector<std::string> dimensions() const;
};

/// All that a proxy holds, of any kind. Throws as its readers do.
std::vector<ExportArray> exportArrays(const ExrFile& file);

}  // namespace vestige
