// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>
#include <vector>

#include "proxy/format/exr/exr_file.h"
#include "proxy/format/image/field_grid.h"
#include "proxy/format/image/proxy_image.h"

namespace vestige {

/// The view under which fields are stored: no camera's, as a field can be seen from everywhere.
inline constexpr const char* kFieldView = "volume";

/// How a field is reduced before it is stored (docs/archive-format.md, "Stored fields").
struct FieldReduction {
  int factor = 1;          ///< samples that are averaged along each axis, 1 .. 16
  double tolerance = 0.0;  ///< largest error of compression, in the field's units, > 0
};

/// A field in memory: (f - low) / (high - low) at the nodes of the axes, x fastest; NaN = no data.
struct FieldSamples {
  std::array<FieldAxis, 3> axes;
  double low = 0.0, high = 1.0;
  std::vector<float> values;
};

/// The mean of each `factor`^3 samples that have data, at their middle; no data where fewer than
/// half have any. Past the last sample of an even axis the field goes on as it ends.
FieldSamples reduced(FieldSamples field, int factor);

/// The field proxy: compressed by zfp with a fixed accuracy, in slabs of four layers, the stream
/// one byte a pixel. Throws InvalidArgument naming the value that makes no sense.
ProxyImage fieldImage(ProxyHeader header, FieldSamples field, const FieldReduction& reduction);

/// Decodes a field proxy. Throws Format naming what is wrong: sizes are checked against the stream
/// before anything is allocated.
FieldSamples fieldSamples(const ProxyImage& image);

}  // namespace vestige
