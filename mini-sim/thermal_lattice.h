// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "mini-sim/lattice_kernel.h"

namespace minisim {

/// What happens at the two ends of an axis: the other end follows, or a wall stands half a cell
/// beyond the outermost cells, without slip and without heat flux (bounce-back).
enum class Edge { Periodic, Wall };

/// Lattice units throughout: cell = time step = 1, density at rest 1.
struct LatticeSettings {
  std::array<int, 3> size = {64, 64, 64};
  std::array<Edge, 3> edges = {Edge::Periodic, Edge::Periodic, Edge::Periodic};
  double viscosity = 0.01;
  double diffusivity = 0.01;
  double smagorinsky = 0.0;       ///< C_s; 0 = no subgrid model
  double turbulentPrandtl = 0.7;  ///< of the subgrid model
  double buoyancy = 0.0;          ///< acceleration along +z per unit of temperature
  int spongeLayers = 0;           ///< of the top, where motion and heat die away ...
  double spongeRate = 0.0;        ///< ... at this rate per step at the very top
  int threads = 0;                ///< 0 = what OpenMP chooses
};

/// Fields, x fastest; those not asked for are empty.
template <typename Real>
struct Fields {
  std::vector<Real> temperature, density, vorticity;
  std::array<std::vector<Real>, 3> velocity;
};
enum FieldSet : unsigned {
  kTemperature = 1,
  kDensity = 2,
  kVelocity = 4,
  kVorticity = 8,  ///< magnitude; gathers the velocity too
  kAllFields = 15
};

/// Weakly compressible flow (D3Q19, regularised collision, optional Smagorinsky model) that carries
/// a temperature (D3Q7) and is lifted by it (Boussinesq), on one lattice updated in place. The
/// bits of the result do not depend on the number of threads nor on the processor.
template <typename Real>
class ThermalLattice {
 public:
  /// Fluid at rest, temperature 0. Throws std::invalid_argument naming the value that makes no
  /// sense, std::bad_alloc when the lattice does not fit.
  explicit ThermalLattice(const LatticeSettings& settings);

  struct State {
    double density = 1.0;
    std::array<double, 3> velocity = {0.0, 0.0, 0.0};
    double temperature = 0.0;
  };
  /// Sets every cell to its equilibrium with `state(x, y, z)`, which is called from several
  /// threads; the next step is the first.
  void initialise(const std::function<State(int, int, int)>& state);

  /// In the lowest layers temperature goes to `hot` at rates[(z ny + y) nx + x] per step, each in
  /// [0, 1]; as many layers as there are rates.
  void setHeating(std::vector<Real> rates, double hot);

  void step();
  long stepsDone() const { return steps_; }

  /// The fields of `set` at the present time, resized as needed.
  void gather(unsigned set, Fields<Real>& fields) const;

  /// Sums over all cells in double, independent of the number of threads.
  struct Totals {
    double mass = 0.0, heat = 0.0, kineticEnergy = 0.0;
    double greatestSpeed = 0.0;
    bool finite = true;
  };
  Totals totals() const;

  const LatticeSettings& settings() const { return settings_; }
  std::size_t cells() const { return cells_; }
  std::size_t bytes() const { return (kFlowDirections + kHeatDirections) * stride_ * sizeof(Real); }

 private:
  RowPointers<Real> pointersAt(int x, int y, int z) const;
  RowPhysics<Real> physicsOf(int y, int z) const;
  /// Calls visit(pointers, x, count) for stretches of cells that share their pointers.
  template <typename Visit>
  void forStretches(int y, int z, const Visit& visit) const;
  std::size_t index(int x, int y, int z) const {
    return (std::size_t(z) * settings_.size[1] + y) * settings_.size[0] + x;
  }
  template <typename Body>
  void forLayers(const Body& body) const;

  struct Free {
    void operator()(Real* memory) const;
  };
  LatticeSettings settings_;
  std::size_t cells_ = 0;
  std::size_t stride_ = 0;  ///< from one direction's population to the next
  std::unique_ptr<Real[], Free> populations_;
  std::vector<Real> damping_;  ///< per layer
  std::vector<Real> heating_;
  double hot_ = 0.0;
  long steps_ = 0;
};

/// |curl v| by central differences, one-sided at walls; spacing 1. Sizes are nx ny nz each.
template <typename Real>
void vorticityMagnitude(const std::array<int, 3>& size, const std::array<Edge, 3>& edges,
                        const std::array<std::vector<Real>, 3>& velocity, std::vector<Real>& out,
                        int threads);

extern template class ThermalLattice<float>;
extern template class ThermalLattice<double>;

}  // namespace minisim
