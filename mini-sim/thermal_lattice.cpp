// SPDX-License-Identifier: BSD-3-Clause
#include "mini-sim/thermal_lattice.h"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <new>
#include <stdexcept>
#include <string>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace minisim {
namespace {

constexpr std::size_t kHugePage = std::size_t(2) << 20;
constexpr std::size_t kCacheLine = 64;

void require(bool condition, const std::string& sentence) {
  if (!condition) throw std::invalid_argument(sentence);
}

void check(const LatticeSettings& s) {
  for (int extent : s.size)
    require(extent >= 1, "a lattice of " + std::to_string(s.size[0]) + " x " +
                             std::to_string(s.size[1]) + " x " + std::to_string(s.size[2]) +
                             " cells: every extent must be at least 1");
  // Negated comparisons catch NaN.
  require(s.viscosity > 0.0 && std::isfinite(s.viscosity),
          "the viscosity must be above 0, not " + std::to_string(s.viscosity));
  require(s.diffusivity > 0.0 && std::isfinite(s.diffusivity),
          "the diffusivity must be above 0, not " + std::to_string(s.diffusivity));
  require(s.smagorinsky >= 0.0 && std::isfinite(s.smagorinsky),
          "the Smagorinsky constant must be at least 0, not " + std::to_string(s.smagorinsky));
  require(s.turbulentPrandtl > 0.0, "the turbulent Prandtl number must be above 0, not " +
                                        std::to_string(s.turbulentPrandtl));
  require(std::isfinite(s.buoyancy), "the buoyancy must be finite");
  require(s.spongeRate >= 0.0 && s.spongeRate <= 1.0,
          "the sponge rate must be in [0, 1], not " + std::to_string(s.spongeRate));
  require(s.spongeLayers >= 0 && s.spongeLayers <= s.size[2],
          "the sponge must have 0 to " + std::to_string(s.size[2]) + " layers, not " +
              std::to_string(s.spongeLayers));
}

template <typename Real>
Real* allocate(std::size_t count) {
  const std::size_t bytes = (count * sizeof(Real) + kHugePage - 1) / kHugePage * kHugePage;
  void* memory = std::aligned_alloc(kHugePage, bytes);
  if (!memory) throw std::bad_alloc();
#ifdef __linux__
  madvise(memory, bytes, MADV_HUGEPAGE);  // fewer TLB misses among 26 streams; only a wish
#endif
  return static_cast<Real*>(memory);
}

/// The neighbour's coordinate, or -1 behind a wall.
int neighbour(int at, int step, int size, Edge edge) {
  const int to = at + step;
  if (to >= 0 && to < size) return to;
  return edge == Edge::Wall ? -1 : to < 0 ? to + size : to - size;
}

}  // namespace

template <typename Real>
void ThermalLattice<Real>::Free::operator()(Real* memory) const {
  std::free(memory);
}

template <typename Real>
ThermalLattice<Real>::ThermalLattice(const LatticeSettings& settings) : settings_(settings) {
  check(settings_);
  cells_ = std::size_t(settings_.size[0]) * settings_.size[1] * settings_.size[2];
  // Five cache lines beyond a whole number of lines: populations of one cell fall into different
  // cache sets even when the extents are powers of two.
  const std::size_t line = kCacheLine / sizeof(Real);
  stride_ = (cells_ + line - 1) / line * line + 5 * line;
  populations_.reset(allocate<Real>((kFlowDirections + kHeatDirections) * stride_));
  damping_.assign(settings_.size[2], Real(0));
  for (int layer = 0; layer < settings_.spongeLayers; ++layer) {
    const double depth = (layer + 1.0) / settings_.spongeLayers;
    damping_[settings_.size[2] - settings_.spongeLayers + layer] =
        Real(settings_.spongeRate * depth * depth);
  }
  // Fluid at rest is all zeros, as populations are stored less their weights.
  const std::size_t layer = std::size_t(settings_.size[0]) * settings_.size[1];
  forLayers([&](int z) {
    for (int i = 0; i < kFlowDirections + kHeatDirections; ++i)
      std::fill_n(populations_.get() + i * stride_ + z * layer, layer, Real(0));
  });
}

template <typename Real>
template <typename Body>
void ThermalLattice<Real>::forLayers(const Body& body) const {
  const int layers = settings_.size[2];
  const int threads =
      std::min(layers, settings_.threads > 0 ? settings_.threads : omp_get_max_threads());
#pragma omp parallel for schedule(dynamic, 4) num_threads(threads)
  for (int z = 0; z < layers; ++z) body(z);
}

template <typename Real>
void ThermalLattice<Real>::initialise(const std::function<State(int, int, int)>& state) {
  Real* base = populations_.get();
  steps_ = 0;
  forLayers([&](int z) {
    for (int y = 0; y < settings_.size[1]; ++y)
      for (int x = 0; x < settings_.size[0]; ++x) {
        const State s = state(x, y, z);
        const auto& u = s.velocity;
        const double uu = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
        Real* cell = base + index(x, y, z);
        for (int i = 0; i < kFlowDirections; ++i) {
          const auto& c = kFlowVelocity[i];
          const double cu = c[0] * u[0] + c[1] * u[1] + c[2] * u[2];
          const double even = (s.density - 1.0) + s.density * (4.5 * cu * cu - 1.5 * uu);
          cell[i * stride_] = Real(flowWeight(i) * (even + s.density * 3.0 * cu));
          if (i < kHeatDirections) {
            const double share = i == 0 ? 1.0 - 3.0 * kHeatSoundSpeedSquared - uu
                                        : 0.5 * (kHeatSoundSpeedSquared + cu * cu + cu);
            cell[(kFlowDirections + i) * stride_] = Real(s.temperature * share);
          }
        }
      }
  });
}

template <typename Real>
void ThermalLattice<Real>::setHeating(std::vector<Real> rates, double hot) {
  const std::size_t layer = std::size_t(settings_.size[0]) * settings_.size[1];
  require(rates.size() % layer == 0 && rates.size() <= cells_,
          std::to_string(rates.size()) + " heating rates are not whole layers of " +
              std::to_string(layer) + " cells");
  for (Real rate : rates)
    require(rate >= Real(0) && rate <= Real(1),
            "a heating rate must be in [0, 1], not " + std::to_string(rate));
  heating_ = std::move(rates);
  hot_ = hot;
}

template <typename Real>
RowPointers<Real> ThermalLattice<Real>::pointersAt(int x, int y, int z) const {
  Real* base = populations_.get();
  const bool exchanged = steps_ % 2 == 1;  // after an even step, populations stand where they left
  RowPointers<Real> p;
  for (int i = 0; i < kFlowDirections; ++i) {
    const auto& c = kFlowVelocity[i];
    std::size_t at = index(x, y, z);
    int direction = i;
    if (exchanged) {
      const int fromX = neighbour(x, -c[0], settings_.size[0], settings_.edges[0]);
      const int fromY = neighbour(y, -c[1], settings_.size[1], settings_.edges[1]);
      const int fromZ = neighbour(z, -c[2], settings_.size[2], settings_.edges[2]);
      if (fromX >= 0 && fromY >= 0 && fromZ >= 0) {
        at = index(fromX, fromY, fromZ);
        direction = opposite(i);
      }  // else it bounced off a wall and stands at home
    }
    p.flow[i] = base + direction * stride_ + at;
    if (i < kHeatDirections) p.heat[i] = base + (kFlowDirections + direction) * stride_ + at;
  }
  return p;
}

template <typename Real>
RowPhysics<Real> ThermalLattice<Real>::physicsOf(int y, int z) const {
  const LatticeSettings& s = settings_;
  RowPhysics<Real> p;
  p.relaxationTime = Real(3.0 * s.viscosity + 0.5);
  p.heatRelaxationTime = Real(s.diffusivity / kHeatSoundSpeedSquared + 0.5);
  p.smagorinsky = Real(18.0 * std::sqrt(2.0) * s.smagorinsky * s.smagorinsky);
  // kappa_t = nu_t / Pr_t; nu = (tau - 1/2) / 3, kappa = (tau - 1/2) / 4.
  p.eddyHeat = Real((1.0 / 3.0) / (kHeatSoundSpeedSquared * s.turbulentPrandtl));
  p.buoyancy = Real(s.buoyancy);
  p.damping = damping_[z];
  const std::size_t row = index(0, y, z);
  p.heating = row < heating_.size() ? heating_.data() + row : nullptr;
  p.hot = Real(hot_);
  return p;
}

template <typename Real>
template <typename Visit>
void ThermalLattice<Real>::forStretches(int y, int z, const Visit& visit) const {
  const int nx = settings_.size[0];
  if (steps_ % 2 == 0) return visit(pointersAt(0, y, z), 0, nx);
  // Only the outermost cells of a row have neighbours in another place.
  visit(pointersAt(0, y, z), 0, 1);
  if (nx > 2) visit(pointersAt(1, y, z), 1, nx - 2);
  if (nx > 1) visit(pointersAt(nx - 1, y, z), nx - 1, 1);
}

template <typename Real>
void ThermalLattice<Real>::step() {
  forLayers([&](int z) {
    for (int y = 0; y < settings_.size[1]; ++y) {
      const RowPhysics<Real> row = physicsOf(y, z);
      forStretches(y, z, [&](const RowPointers<Real>& pointers, int x, int count) {
        RowPhysics<Real> physics = row;
        if (physics.heating) physics.heating += x;
        collideRow(pointers, count, physics);
      });
    }
  });
  ++steps_;
}

template <typename Real>
void ThermalLattice<Real>::gather(unsigned set, Fields<Real>& fields) const {
  const bool velocity = set & (kVelocity | kVorticity);
  fields.temperature.resize(set & kTemperature ? cells_ : 0);
  fields.density.resize(set & kDensity ? cells_ : 0);
  for (auto& component : fields.velocity) component.resize(velocity ? cells_ : 0);
  forLayers([&](int z) {
    for (int y = 0; y < settings_.size[1]; ++y) {
      const RowPhysics<Real> physics = physicsOf(y, z);
      forStretches(y, z, [&](const RowPointers<Real>& pointers, int x, int count) {
        const std::size_t at = index(x, y, z);
        const auto place = [&](std::vector<Real>& field) {
          return field.empty() ? nullptr : field.data() + at;
        };
        momentsOfRow(
            pointers, count, physics,
            {place(fields.temperature),
             place(fields.density),
             {place(fields.velocity[0]), place(fields.velocity[1]), place(fields.velocity[2])}});
      });
    }
  });
  if (set & kVorticity)
    vorticityMagnitude(settings_.size, settings_.edges, fields.velocity, fields.vorticity,
                       settings_.threads);
  else
    fields.vorticity.clear();
}

template <typename Real>
typename ThermalLattice<Real>::Totals ThermalLattice<Real>::totals() const {
  std::vector<Totals> layers(settings_.size[2]);  // summed in order: no thread shows in the result
  forLayers([&](int z) {
    const int nx = settings_.size[0];
    std::array<std::vector<Real>, 5> row;
    for (auto& values : row) values.resize(nx);
    Totals& sum = layers[z];
    for (int y = 0; y < settings_.size[1]; ++y) {
      const RowPhysics<Real> physics = physicsOf(y, z);
      forStretches(y, z, [&](const RowPointers<Real>& pointers, int x, int count) {
        momentsOfRow(pointers, count, physics,
                     {&row[0][x], &row[1][x], {&row[2][x], &row[3][x], &row[4][x]}});
      });
      for (int x = 0; x < nx; ++x) {
        const double rho = row[1][x], u = row[2][x], v = row[3][x], w = row[4][x];
        const double speed2 = u * u + v * v + w * w;
        sum.mass += rho;
        sum.heat += row[0][x];
        sum.kineticEnergy += 0.5 * rho * speed2;
        sum.greatestSpeed = std::fmax(sum.greatestSpeed, std::sqrt(speed2));
      }
    }
    sum.finite = std::isfinite(sum.mass + sum.heat + sum.kineticEnergy);
  });
  Totals all;
  for (const Totals& layer : layers) {
    all.mass += layer.mass;
    all.heat += layer.heat;
    all.kineticEnergy += layer.kineticEnergy;
    all.greatestSpeed = std::fmax(all.greatestSpeed, layer.greatestSpeed);
    all.finite = all.finite && layer.finite;
  }
  return all;
}

template class ThermalLattice<float>;
template class ThermalLattice<double>;

}  // namespace minisim
