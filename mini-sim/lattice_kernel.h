// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

namespace minisim {

/// The D3Q19 directions: rest, then pairs (2k+1, 2k+2) that are opposite to one another.
inline constexpr int kFlowDirections = 19;
inline constexpr std::array<std::array<int, 3>, kFlowDirections> kFlowVelocity = {{
    {0, 0, 0},  {1, 0, 0},   {-1, 0, 0},  {0, 1, 0},  {0, -1, 0}, {0, 0, 1},   {0, 0, -1},
    {1, 1, 0},  {-1, -1, 0}, {1, -1, 0},  {-1, 1, 0}, {1, 0, 1},  {-1, 0, -1}, {1, 0, -1},
    {-1, 0, 1}, {0, 1, 1},   {0, -1, -1}, {0, 1, -1}, {0, -1, 1},
}};
/// D3Q7, the first seven of them, carries the temperature.
inline constexpr int kHeatDirections = 7;

constexpr int opposite(int direction) {
  return direction == 0 ? 0 : direction % 2 == 1 ? direction + 1 : direction - 1;
}
constexpr double flowWeight(int i) { return i == 0 ? 1.0 / 3 : i < 7 ? 1.0 / 18 : 1.0 / 36; }
inline constexpr double kHeatSoundSpeedSquared = 0.25;

/// Where the populations that arrive at a row of cells stand: direction i of cell x at
/// flow[i][x] and heat[i][x]. Populations that leave in direction i go to [opposite(i)][x]: this
/// exchange, with pointers that alternate between two patterns, streams in place ("AA pattern",
/// [Bailey 2009]). Every place belongs to one cell of the grid, so rows may be done in any
/// order and by any thread. The flow is stored less its weights (f_i - w_i), which keeps float
/// accurate near rest.
template <typename Real>
struct RowPointers {
  std::array<Real*, kFlowDirections> flow;
  std::array<Real*, kHeatDirections> heat;
};

/// What is the same for all cells of a row; lattice units (cell = step = 1).
template <typename Real>
struct RowPhysics {
  Real relaxationTime;      ///< tau of the flow, 3 nu + 1/2
  Real heatRelaxationTime;  ///< tau of the temperature without eddies, 4 kappa + 1/2
  Real smagorinsky;         ///< 18 sqrt(2) C_s^2; 0 = no subgrid model
  Real eddyHeat;            ///< rise of the temperature's tau per rise of the flow's
  Real buoyancy;            ///< acceleration along +z per unit of temperature
  Real damping;             ///< rate at which momentum and temperature decay (sponge)
  const Real* heating;      ///< per cell, rate at which temperature goes to `hot`; or null
  Real hot;
};

/// One time step of `count` consecutive cells: moments, collision, exchange.
void collideRow(const RowPointers<float>& row, int count, const RowPhysics<float>& physics);
void collideRow(const RowPointers<double>& row, int count, const RowPhysics<double>& physics);

/// Temperature, density and velocity of `count` cells; each output may be null.
template <typename Real>
struct RowMoments {
  Real* temperature;
  Real* density;
  std::array<Real*, 3> velocity;
};
void momentsOfRow(const RowPointers<float>& row, int count, const RowPhysics<float>& physics,
                  const RowMoments<float>& out);
void momentsOfRow(const RowPointers<double>& row, int count, const RowPhysics<double>& physics,
                  const RowMoments<double>& out);

}  // namespace minisim
