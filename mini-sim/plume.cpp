// SPDX-License-Identifier: BSD-3-Clause
#include "mini-sim/plume.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace minisim {
namespace {

/// Uniform in [-1, 1), a function of seed and place alone (splitmix64's finaliser), so that neither
/// the order nor the thread in which cells are visited matters.
double noise(std::uint64_t seed, std::uint64_t place) {
  std::uint64_t v = seed * 0x9e3779b97f4a7c15u + place * 0xd1342543de82ef95u + 0x9e3779b97f4a7c15u;
  v = (v ^ (v >> 30)) * 0xbf58476d1ce4e5b9u;
  v = (v ^ (v >> 27)) * 0x94d049bb133111ebu;
  v ^= v >> 31;
  return double(v >> 11) * 0x1p-52 - 1.0;
}

constexpr double kHeatingRate = 0.03;     // per step, inside the patch
constexpr double kUnevenness = 0.35;      // relative noise of that rate
constexpr double kBreeze = 0.1;           // root mean square, in free-fall velocities
constexpr double kBreezeWaveNumber = 7;   // largest, in periods of the box
constexpr double kFirstPuffHeight = 1.8;  // of the warm air over the patch, in patch radii

/// A sum of seeded plane waves, each across its own direction: a divergence-free velocity with root
/// mean square 1 that breaks the symmetry on the scale of the plume's edges.
class Breeze {
 public:
  Breeze(std::uint64_t seed, const std::array<int, 3>& size) {
    for (int m = 0; m < int(waves_.size()); ++m) {
      Wave& wave = waves_[m];
      double kk = 0.0, ka = 0.0, aa = 0.0;
      for (int axis = 0; axis < 3; ++axis) {
        // Whole periods, so that the sides match.
        const double periods = std::round(kBreezeWaveNumber * noise(seed, 8 * m + axis));
        wave.k[axis] = periods * 2.0 * std::numbers::pi / size[axis];
        wave.amplitude[axis] = noise(seed, 8 * m + 3 + axis);
        kk += wave.k[axis] * wave.k[axis];
        ka += wave.k[axis] * wave.amplitude[axis];
      }
      for (int axis = 0; axis < 3; ++axis) {
        if (kk > 0.0) wave.amplitude[axis] -= wave.k[axis] * ka / kk;
        aa += wave.amplitude[axis] * wave.amplitude[axis];
      }
      wave.phase = std::numbers::pi * noise(seed, 8 * m + 6);
      const double scale = aa > 0.0 ? std::sqrt(2.0 / (aa * waves_.size())) : 0.0;
      for (double& amplitude : wave.amplitude) amplitude *= scale;
    }
  }

  std::array<double, 3> at(int x, int y, int z) const {
    std::array<double, 3> sum = {0.0, 0.0, 0.0};
    for (const Wave& w : waves_) {
      const double value = std::sin(w.k[0] * x + w.k[1] * y + w.k[2] * z + w.phase);
      for (int axis = 0; axis < 3; ++axis) sum[axis] += w.amplitude[axis] * value;
    }
    return sum;
  }

 private:
  struct Wave {
    std::array<double, 3> k, amplitude;
    double phase;
  };
  std::array<Wave, 32> waves_;
};

/// 1 inside, 0 outside, `sharpness` per unit at 1.
double inside(double r, double sharpness) { return 0.5 * (1.0 - std::tanh(sharpness * (r - 1.0))); }

}  // namespace

LatticeSettings plumeSettings(const PlumeParameters& p) {
  const auto require = [](bool condition, const char* name, double value) {
    if (!condition)
      throw std::invalid_argument(std::string(name) + " cannot be " + std::to_string(value));
  };
  require(p.rayleigh > 0.0 && std::isfinite(p.rayleigh), "the Rayleigh number", p.rayleigh);
  require(p.prandtl > 0.0 && std::isfinite(p.prandtl), "the Prandtl number", p.prandtl);
  require(p.speed > 0.0 && p.speed <= 0.3, "the free-fall speed", p.speed);
  require(p.patchRadius > 0.0 && p.patchRadius <= 0.5, "the patch radius", p.patchRadius);
  const double height = p.size[2];
  LatticeSettings s;
  s.size = p.size;
  s.edges = {Edge::Periodic, Edge::Periodic, Edge::Wall};
  s.buoyancy = p.speed * p.speed / height;
  s.viscosity = p.speed * height * std::sqrt(p.prandtl / p.rayleigh);
  s.diffusivity = s.viscosity / p.prandtl;
  s.smagorinsky = p.smagorinsky;
  s.turbulentPrandtl = 0.33;
  s.spongeLayers = p.size[2] / 8;
  s.spongeRate = 0.05;
  s.threads = p.threads;
  return s;
}

template <typename Real>
ThermalLattice<Real> makePlume(const PlumeParameters& p) {
  ThermalLattice<Real> lattice(plumeSettings(p));
  const int nx = p.size[0], ny = p.size[1], nz = p.size[2];
  const double radius = p.patchRadius * std::min(nx, ny);
  const auto across = [=](int at, int size) { return (at + 0.5 - 0.5 * size) / radius; };

  const int layers = std::clamp(nz / 42, 1, nz);
  std::vector<Real> rates(std::size_t(nx) * ny * layers);
  for (std::size_t at = 0; at < rates.size(); ++at) {
    const double r = std::hypot(across(int(at % nx), nx), across(int(at / nx % ny), ny));
    rates[at] = Real(kHeatingRate * inside(r, 4.0) * (1.0 + kUnevenness * noise(~p.seed, at)));
  }
  lattice.setHeating(std::move(rates), 1.0);

  const Breeze breeze(p.seed, p.size);
  lattice.initialise([&](int x, int y, int z) {
    typename ThermalLattice<Real>::State state;
    const double fromWall = std::min(z + 0.5, nz - z - 0.5) / (0.1 * nz);  // no wind along walls
    state.velocity = breeze.at(x, y, z);
    for (double& v : state.velocity) v *= kBreeze * p.speed * std::min(1.0, fromWall);
    const double height = (z + 0.5) / (radius * kFirstPuffHeight);
    state.temperature = inside(std::hypot(across(x, nx), across(y, ny), height), 4.0);
    return state;
  });
  return lattice;
}

template ThermalLattice<float> makePlume(const PlumeParameters&);
template ThermalLattice<double> makePlume(const PlumeParameters&);

}  // namespace minisim
