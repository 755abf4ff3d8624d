// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

namespace vestige::test {

/// The temperature of the mini simulation on n^3 cells, x fastest, once its plume has reached the
/// upper half of the box.
std::vector<float> plumeTemperature(int n);
/// The magnitude of its vorticity then, 1 / step.
std::vector<float> plumeVorticity(int n);

}  // namespace vestige::test
