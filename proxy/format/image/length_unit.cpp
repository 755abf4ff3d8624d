// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/image/length_unit.h"

#include <cmath>

namespace vestige {

double lengthUnitFor(const Box& domain) {
  const double diagonal = domain.diagonal();
  if (!(diagonal > 0.0) || !std::isfinite(diagonal)) return 1.0;
  const int exponent = std::ilogb(diagonal);
  return std::abs(exponent) > 16 ? std::ldexp(1.0, exponent) : 1.0;
}

void scaleLengths(Camera& camera, double factor) {
  camera.position *= factor;
  camera.viewHeight *= factor;
  camera.nearDepth *= factor;
  camera.farDepth *= factor;
}

void scaleLengths(Box& box, double factor) {
  box.low *= factor;
  box.high *= factor;
}

void scaleLengths(TransferFunction& function, double factor) {
  TransferFunction scaled(function.opacityPoints(), function.referenceLength() * factor,
                          function.colormap(), function.colorLow(), function.colorHigh());
  scaled.setFactors(function.factors());
  function = std::move(scaled);
}

void scaleLengths(Customization& customization, double factor) {
  const auto scale = [factor](SeedParameters& parameters) {
    if (parameters.function && parameters.function->referenceLength)
      *parameters.function->referenceLength *= factor;
  };
  for (SeedPrimitive& seed : customization.seeds) {
    seed.position *= factor;
    seed.extent *= factor;
    scale(seed.parameters);
  }
  for (SeedParameters& corner : customization.corners) scale(corner);
}

void scaleLengths(ProxyHeader& header, double factor) {
  scaleLengths(header.camera, factor);
  scaleLengths(header.domain, factor);
  if (header.base) scaleLengths(*header.base, factor);
  if (header.customization) scaleLengths(*header.customization, factor);
  for (double& depth : header.slabDepths) depth *= factor;
  for (TransferFunction& look : header.looks) scaleLengths(look, factor);
  if (header.features) header.features->referenceLength *= factor;
  if (!header.grid) return;
  for (FieldAxis& axis : header.grid->axes) {
    axis.first *= factor;
    axis.spacing *= factor;
    for (double& node : axis.nodes) node *= factor;
  }
}

bool isLength(std::string_view kind, std::string_view part) {
  if (kind == kind::kLength) return part == "length" || part == "depth";
  if (kind == kind::kLayered) return part == "boundaries";
  return kind == kind::kFeatures && (part == "integral" || part == "depth");
}

bool isLength(std::string_view kind, std::string_view part, std::string_view channel) {
  return kind == kind::kDepth ? channel == "Z" : isLength(kind, part);
}

}  // namespace vestige
