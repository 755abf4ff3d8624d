// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "explorer/renderer/renderer.h"

namespace vestige {

/// All that an archive holds of what a pixel of a picture shows: the pixel's colour; the values of
/// the look's fields along its ray, of stored fields or else of stacks, and where opacity is first
/// seen; and what the proxies say whose stored rays are this ray: lengths, depths, slabs of stacks,
/// light. `rendered` is the picture of `look`; `depth`: only the sample and the slab at that planar
/// depth. Throws InvalidArgument naming a pixel outside of the picture or a depth outside of the
/// domain. Keys: docs/exploring.md.
nlohmann::json probePixel(const Archive& archive, const Look& look, const Rendered& rendered, int x,
                          int y, std::optional<double> depth = {});
/// The same for people.
std::string probeText(const nlohmann::json& probed);

}  // namespace vestige
