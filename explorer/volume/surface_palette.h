// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "explorer/picture/look.h"
#include "explorer/volume/volume_pass.h"

namespace vestige {

/// The surfaces that a look draws: its own, or opaque ones where the function's opacity peaks.
/// Those without a colour take one each, in their order, from a palette that is told apart under
/// light and by lightness alone: skin and bone first. Throws Config when there is none.
std::vector<Isosurface> surfacesOf(const Look& look, const TransferFunction& function);

}  // namespace vestige
