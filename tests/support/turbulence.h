// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

namespace vestige::test {

/// A real random-phase field on n^3 points of the periodic unit cube, scaled to [0, 1] (method
/// §10): amplitude |k|^(-11/6) exp(-(k/60)^2) a mode, phases from `seed` alone, so that other n
/// sample the same field (up to their Nyquist frequency).
std::vector<float> turbulence(int n, std::uint64_t seed);

}  // namespace vestige::test
