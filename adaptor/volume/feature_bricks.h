// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "adaptor/volume/brick_grid.h"
#include "proxy/classifier/classifier.h"

namespace vestige {

/// What a march of features may skip, as texels of the march (BrickGrid::texels): x = 0 where
/// no channel weighs more than Classifier::kNegligible on any segment that stays in the brick, else
/// -1. `fields`: the bricks of the classifier's fields, normalised, then of the gradient norm if it
/// needs one. `withNeighbours`: nor on any segment from there to a brick beside it.
std::vector<glm::vec4> vanishingBricks(const Classifier& classifier,
                                       std::span<const BrickGrid* const> fields,
                                       bool withNeighbours);

}  // namespace vestige
