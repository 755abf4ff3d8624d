// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "mini-sim/thermal_lattice.h"

namespace minisim {

/// A buoyant plume over a hot patch at the bottom centre of a box: walls below and above, periodic
/// sides, and under the ceiling a sponge that takes momentum and heat, as an open sky would.
struct PlumeParameters {
  std::array<int, 3> size = {128, 128, 128};
  double rayleigh = 2e8;      ///< g beta dT H^3 / (nu kappa), H = the height
  double prandtl = 0.71;      ///< nu / kappa: air
  double speed = 0.22;        ///< free-fall velocity sqrt(g beta dT H), cells per step
  double smagorinsky = 0.13;  ///< C_s
  double patchRadius = 0.1;   ///< in widths of the box
  std::uint64_t seed = 1;     ///< of the perturbation that breaks the symmetry
  int threads = 0;            ///< 0 = what OpenMP chooses
};

/// The lattice of a plume, in lattice units. Throws std::invalid_argument naming what makes no
/// sense.
LatticeSettings plumeSettings(const PlumeParameters& parameters);

/// A lattice with the fluid at rest but for the perturbation, and the heating switched on.
template <typename Real>
ThermalLattice<Real> makePlume(const PlumeParameters& parameters);

}  // namespace minisim
