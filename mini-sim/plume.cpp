// SPDX-License-Identifier: BSD-3-Clause
#include "mini-sim/plume.h"

#include <algorithm>
#include <cmath>
#include <complex>
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
    for (int axis = 0; axis < 3; ++axis) phases_[axis].resize(size[axis]);
    for (int m = 0; m < kWaves; ++m) {
      std::array<double, 3> k{}, amplitude{};
      double kk = 0.0, ka = 0.0, aa = 0.0;
      for (int axis = 0; axis < 3; ++axis) {
        // Whole periods, so that the sides match.
        const double periods = std::round(kBreezeWaveNumber * noise(seed, 8 * m + axis));
        k[axis] = periods * 2.0 * std::numbers::pi / size[axis];
        amplitude[axis] = noise(seed, 8 * m + 3 + axis);
        kk += k[axis] * k[axis];
        ka += k[axis] * amplitude[axis];
      }
      for (int axis = 0; axis < 3; ++axis) {
        if (kk > 0.0) amplitude[axis] -= k[axis] * ka / kk;
        aa += amplitude[axis] * amplitude[axis];
      }
      const double scale = aa > 0.0 ? std::sqrt(2.0 / (aa * kWaves)) : 0.0;
      const double start = std::numbers::pi * noise(seed, 8 * m + 6);
      for (int axis = 0; axis < 3; ++axis) {
        amplitude_[axis][m] = scale * amplitude[axis];
        for (int i = 0; i < size[axis]; ++i)
          phases_[axis][i][m] = std::polar(1.0, k[axis] * i + (axis == 0 ? start : 0.0));
      }
    }
  }

  std::array<double, 3> at(int x, int y, int z) const {
    std::array<double, 3> sum = {0.0, 0.0, 0.0};
    const auto &inX = phases_[0][x], &inY = phases_[1][y], &inZ = phases_[2][z];
    for (int m = 0; m < kWaves; ++m) {
      // Im(e^{ix} e^{iy} e^{iz}) = sin(x + y + z): far cheaper than a sine per wave and cell.
      const double re = inX[m].real() * inY[m].real() - inX[m].imag() * inY[m].imag();
      const double im = inX[m].real() * inY[m].imag() + inX[m].imag() * inY[m].real();
      const double value = re * inZ[m].imag() + im * inZ[m].real();
      for (int axis = 0; axis < 3; ++axis) sum[axis] += amplitude_[axis][m] * value;
    }
    return sum;
  }

 private:
  static constexpr int kWaves = 32;
  std::array<std::vector<std::array<std::complex<double>, kWaves>>, 3> phases_;
  std::array<std::array<double, kWaves>, 3> amplitude_{};
};

/// 1 inside of 1, 0 outside, with a smooth edge.
double inside(double r) { return r > 3.0 ? 0.0 : 0.5 * (1.0 - std::tanh(4.0 * (r - 1.0))); }

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
    rates[at] = Real(kHeatingRate * inside(r) * (1.0 + kUnevenness * noise(~p.seed, at)));
  }
  lattice.setHeating(std::move(rates), 1.0);

  const Breeze breeze(p.seed, p.size);
  lattice.initialise([&](int x, int y, int z) {
    typename ThermalLattice<Real>::State state;
    const double fromWall = std::min(z + 0.5, nz - z - 0.5) / (0.1 * nz);  // no wind along walls
    state.velocity = breeze.at(x, y, z);
    for (double& v : state.velocity) v *= kBreeze * p.speed * std::min(1.0, fromWall);
    const double height = (z + 0.5) / (radius * kFirstPuffHeight);
    state.temperature = inside(std::hypot(across(x, nx), across(y, ny), height));
    return state;
  });
  return lattice;
}

template ThermalLattice<float> makePlume(const PlumeParameters&);
template ThermalLattice<double> makePlume(const PlumeParameters&);

}  // namespace minisim
