// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/volume/surface_palette.h"

#include <array>

#include "proxy/base/error.h"

namespace vestige {
namespace {

/// sRGB: sand, ivory, blue, brick, green, violet, gold, teal.
constexpr std::array<const char*, kMaxIsosurfaces> kPalette{
    "#d9a47f", "#f4ecdc", "#5b8fc4", "#b4483a", "#71a35c", "#8d6bb1", "#e2b13c", "#2f8f8b"};

}  // namespace

std::vector<Isosurface> surfacesOf(const Look& look, const TransferFunction& function) {
  std::vector<SurfaceLook> looks = look.isosurfaces;
  if (looks.empty()) {
    for (const double value : function.opacityPeaks()) {
      if (looks.size() < kMaxIsosurfaces) looks.push_back({value, 1.0});
    }
  }
  if (looks.empty()) {
    throw Error(ErrorCode::Config,
                "look key 'isosurfaces' is missing, and the opacity has no peak to take instead");
  }
  std::vector<Isosurface> surfaces;
  for (const SurfaceLook& each : looks) {
    const std::string own = each.color.empty() ? kPalette[surfaces.size()] : each.color;
    const auto srgb = colorFromHex(own);
    surfaces.push_back(
        {each.value, srgb ? linearFromSrgb(*srgb) : function.color(each.value), each.opacity});
  }
  return surfaces;
}

}  // namespace vestige
