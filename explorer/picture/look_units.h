// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "explorer/picture/look.h"

namespace vestige {

/// A look with all of its places and lengths multiplied: an archive that is read in another unit of
/// length (Archive::setLengthUnit) is drawn alike with 1 / that unit.
Look withScaledLengths(Look look, double factor);

}  // namespace vestige
