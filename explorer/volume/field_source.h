// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "explorer/volume/grid_painter.h"
#include "proxy/format/layout/field_layout.h"

namespace vestige {

/// A stored field on a grid in the world, as LookGrid has it.
struct PlacedField {
  ProxyHeader header;
  glm::ivec3 size{0};
  glm::dmat4 worldFromGrid{1.0};
  glm::dvec3 low{0.0}, high{1.0};
  std::vector<float> values;  ///< value = number * unit + zero; NaN = no data
  double valueUnit = 1.0, valueZero = 0.0;
  std::array<std::vector<double>, 3> nodes;  ///< of uneven axes, as GridAxes has them
};
/// Throws Format for a proxy that does not decode.
PlacedField placedField(const ProxyImage& image);

/// A stored field (kind "field") on the GPU, sample for sample as it is stored. Made, used and
/// destroyed in Device::run.
class FieldSource {
 public:
  /// Throws Format for a proxy that does not decode, Gl for a grid that OpenGL cannot hold.
  explicit FieldSource(const ProxyImage& image);

  const ProxyHeader& header() const { return header_; }
  LookGrid& grid() { return grid_; }
  VolumeView draw(const Look& look, const TransferFunction& function, const Camera& camera,
                  ImageSize size);
  /// What it is and how true, in a sentence.
  std::string note() const;

 private:
  ProxyHeader header_;
  LookGrid grid_;
  GridPainter painter_;
};

}  // namespace vestige
