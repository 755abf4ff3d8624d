// SPDX-License-Identifier: BSD-3-Clause
#include "mini-sim/thermal_lattice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace {

using minisim::Edge;
using minisim::Fields;
using minisim::LatticeSettings;
using minisim::ThermalLattice;

constexpr double kTwoPi = 2.0 * std::numbers::pi;

/// One thread: thousands of steps of so few cells are not worth a team's barriers.
LatticeSettings small() {
  LatticeSettings settings;
  settings.threads = 1;
  return settings;
}

template <typename Real>
void run(ThermalLattice<Real>& lattice, int steps) {
  for (int i = 0; i < steps; ++i) lattice.step();
}

/// Decay rate of a Taylor-Green vortex of n x n cells in the plane across `axis`, over the rate
/// 2 nu k^2 of its velocity; 1 = exact.
template <typename Real>
double taylorGreenRate(int n, int axis, double viscosity, double speed) {
  LatticeSettings settings = small();
  settings.size = {n, n, n};
  settings.size[axis] = 1;
  settings.viscosity = viscosity;
  ThermalLattice<Real> lattice(settings);
  const double k = kTwoPi / n;
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  lattice.initialise([&](int x, int y, int z) {
    const std::array<int, 3> cell = {x, y, z};
    const double s = k * (cell[a] + 0.5), t = k * (cell[b] + 0.5);
    typename ThermalLattice<Real>::State state;
    state.velocity[a] = speed * std::sin(s) * std::cos(t);
    state.velocity[b] = -speed * std::cos(s) * std::sin(t);
    state.density = 1.0 + 0.75 * speed * speed * (std::cos(2 * s) + std::cos(2 * t));
    return state;
  });
  const int settle = 50, steps = 400;
  run(lattice, settle);
  const double before = lattice.totals().kineticEnergy;
  run(lattice, steps);
  const double rate = 0.5 * std::log(before / lattice.totals().kineticEnergy) / steps;
  return rate / (2.0 * viscosity * k * k);
}

TEST(ThermalLattice, TaylorGreenVortexDecaysAtTheAnalyticRateInEveryPlane) {
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(taylorGreenRate<double>(48, axis, 0.01, 0.02), 1.0, 2e-3) << "across axis " << axis;
    EXPECT_NEAR(taylorGreenRate<float>(48, axis, 0.01, 0.02), 1.0, 2e-3) << "across axis " << axis;
  }
}

TEST(ThermalLattice, TaylorGreenErrorFallsWithTheSquareOfTheCellSize) {
  // Diffusive scaling: the speed falls with the cell size, so the Mach error falls along.
  const double coarse = std::abs(taylorGreenRate<double>(16, 2, 0.05, 0.04) - 1.0);
  const double fine = std::abs(taylorGreenRate<double>(32, 2, 0.05, 0.02) - 1.0);
  EXPECT_LT(fine, coarse / 3.0) << coarse << " with 16 cells, " << fine << " with 32";
}

TEST(ThermalLattice, SineOfTemperatureDiffusesAtTheAnalyticRate) {
  for (int axis = 0; axis < 3; ++axis) {
    LatticeSettings settings = small();
    settings.size = {1, 2, 3};
    settings.size[axis] = 64;
    settings.diffusivity = 0.02;
    ThermalLattice<double> lattice(settings);
    const double k = kTwoPi / 64;
    const auto wave = [&](int x, int y, int z) {
      return std::sin(k * (std::array<int, 3>{x, y, z}[axis] + 0.5));
    };
    lattice.initialise([&](int x, int y, int z) {
      ThermalLattice<double>::State state;
      state.temperature = 1.0 + 0.5 * wave(x, y, z);
      return state;
    });
    const auto amplitude = [&] {
      Fields<double> fields;
      lattice.gather(minisim::kTemperature, fields);
      double sum = 0.0;
      const auto& n = settings.size;
      for (int z = 0; z < n[2]; ++z)
        for (int y = 0; y < n[1]; ++y)
          for (int x = 0; x < n[0]; ++x)
            sum += wave(x, y, z) * fields.temperature[(z * n[1] + y) * n[0] + x];
      return sum;
    };
    run(lattice, 50);
    const double before = amplitude();
    run(lattice, 300);
    const double rate = std::log(before / amplitude()) / 300;
    EXPECT_NEAR(rate / (settings.diffusivity * k * k), 1.0, 2e-3) << "along axis " << axis;
  }
}

TEST(ThermalLattice, TemperatureIsCarriedByTheFlow) {
  LatticeSettings settings = small();
  settings.size = {64, 4, 4};
  settings.diffusivity = 0.005;
  ThermalLattice<double> lattice(settings);
  const double k = kTwoPi / 64, speed = 0.1;
  lattice.initialise([&](int x, int, int) {
    ThermalLattice<double>::State state;
    state.velocity[0] = speed;
    state.temperature = std::cos(k * x);
    return state;
  });
  run(lattice, 320);  // half a period
  Fields<double> fields;
  lattice.gather(minisim::kTemperature, fields);
  const double decay = std::exp(-settings.diffusivity * k * k * 320);
  for (int x = 0; x < 64; ++x)
    EXPECT_NEAR(fields.temperature[x], decay * std::cos(k * (x - speed * 320)), 0.01) << x;
}

TEST(ThermalLattice, PoiseuilleFlowBetweenWallsIsAParabola) {
  // Driven by buoyancy between walls across x: a uniform temperature lifts uniformly.
  LatticeSettings settings = small();
  settings.size = {24, 1, 1};
  settings.edges = {Edge::Wall, Edge::Periodic, Edge::Periodic};
  settings.viscosity = 0.1;
  settings.buoyancy = 1e-5;
  ThermalLattice<double> lattice(settings);
  lattice.initialise([](int, int, int) {
    ThermalLattice<double>::State state;
    state.temperature = 1.0;
    return state;
  });
  run(lattice, 12000);
  Fields<double> fields;
  lattice.gather(minisim::kVelocity, fields);
  const double peak = settings.buoyancy * 12.0 * 12.0 / (2.0 * settings.viscosity);
  for (int x = 0; x < 24; ++x) {
    const double s = (x + 0.5 - 12.0) / 12.0;
    EXPECT_NEAR(fields.velocity[2][x] / peak, 1.0 - s * s, 0.01) << x;
  }
}

TEST(ThermalLattice, MassAndHeatAreConservedInAClosedBox) {
  for (Edge edge : {Edge::Periodic, Edge::Wall}) {
    LatticeSettings settings = small();
    settings.size = {19, 16, 13};
    settings.edges = {edge, edge, edge};
    settings.viscosity = settings.diffusivity = 0.01;
    settings.buoyancy = 1e-3;
    settings.smagorinsky = 0.1;
    ThermalLattice<double> lattice(settings);
    lattice.initialise([](int x, int y, int z) {
      ThermalLattice<double>::State state;
      state.temperature = std::hypot(x - 9, y - 8, z - 3) < 4.0 ? 1.0 : 0.0;
      return state;
    });
    const auto before = lattice.totals();
    run(lattice, 301);
    const auto after = lattice.totals();
    EXPECT_GT(after.kineticEnergy, 0.1) << "the test needs a flow";
    EXPECT_NEAR(after.mass / before.mass, 1.0, 1e-12);
    EXPECT_NEAR(after.heat / before.heat, 1.0, 1e-12);
  }
}

TEST(ThermalLattice, MirroredStartGivesTheMirroredFlow) {
  // Catches every mistaken neighbour: rows of one, two and more cells, walls and both parities.
  LatticeSettings settings = small();
  settings.size = {8, 6, 7};
  settings.edges = {Edge::Wall, Edge::Periodic, Edge::Wall};
  settings.buoyancy = 1e-3;
  ThermalLattice<double> one(settings), other(settings);
  const auto start = [](int x, int y, int z) {
    ThermalLattice<double>::State state;
    state.temperature = x == 2 && y == 1 && z == 1 ? 1.0 : 0.0;
    state.velocity = {0.01 * std::sin(y + 2.0 * z), 0.01 * x, 0.0};
    return state;
  };
  one.initialise(start);
  other.initialise([&](int x, int y, int z) {
    auto state = start(7 - x, 5 - y, z);
    state.velocity[0] = -state.velocity[0];
    state.velocity[1] = -state.velocity[1];
    return state;
  });
  Fields<double> a, b;
  for (int steps : {1, 1, 15}) {
    run(one, steps);
    run(other, steps);
    one.gather(minisim::kAllFields, a);
    other.gather(minisim::kAllFields, b);
    for (int z = 0; z < 7; ++z)
      for (int y = 0; y < 6; ++y)
        for (int x = 0; x < 8; ++x) {
          const std::size_t at = (z * 6 + y) * 8 + x, mirrored = (z * 6 + 5 - y) * 8 + 7 - x;
          ASSERT_NEAR(a.temperature[at], b.temperature[mirrored], 1e-14);
          ASSERT_NEAR(a.velocity[0][at], -b.velocity[0][mirrored], 1e-14);
          ASSERT_NEAR(a.velocity[2][at], b.velocity[2][mirrored], 1e-14);
          ASSERT_NEAR(a.vorticity[at], b.vorticity[mirrored], 1e-13);
        }
  }
}

TEST(ThermalLattice, GatherGivesOnlyWhatIsAskedFor) {
  LatticeSettings settings = small();
  settings.size = {5, 4, 3};
  ThermalLattice<float> lattice(settings);
  Fields<float> fields;
  lattice.gather(minisim::kDensity, fields);
  EXPECT_EQ(fields.density, std::vector<float>(60, 1.0f));
  EXPECT_TRUE(fields.temperature.empty() && fields.velocity[0].empty() && fields.vorticity.empty());
}

TEST(ThermalLattice, RigidRotationHasTwiceItsRateAsVorticity) {
  const std::array<int, 3> size = {6, 5, 4};
  std::array<std::vector<double>, 3> velocity;
  for (auto& component : velocity) component.assign(120, 0.0);
  for (int z = 0; z < 4; ++z)
    for (int y = 0; y < 5; ++y)
      for (int x = 0; x < 6; ++x) {
        velocity[0][(z * 5 + y) * 6 + x] = -0.3 * y;
        velocity[1][(z * 5 + y) * 6 + x] = 0.3 * x;
      }
  std::vector<double> vorticity;
  minisim::vorticityMagnitude(size, {Edge::Wall, Edge::Wall, Edge::Wall}, velocity, vorticity, 1);
  for (double value : vorticity) EXPECT_NEAR(value, 0.6, 1e-14);
}

TEST(ThermalLattice, SettingsThatMakeNoSenseAreRefusedByName) {
  const auto refused = [](auto change) -> std::string {
    LatticeSettings settings = small();
    settings.size = {4, 4, 4};
    change(settings);
    try {
      ThermalLattice<float> lattice(settings);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(refused([](auto& s) { s.size[1] = 0; }),
            "a lattice of 4 x 0 x 4 cells: every extent must be at least 1");
  EXPECT_EQ(refused([](auto& s) { s.viscosity = 0.0; }),
            "the viscosity must be above 0, not 0.000000");
  EXPECT_EQ(refused([](auto& s) { s.diffusivity = std::nan(""); }),
            "the diffusivity must be above 0, not nan");
  EXPECT_EQ(refused([](auto& s) { s.spongeLayers = 5; }),
            "the sponge must have 0 to 4 layers, not 5");
  ThermalLattice<float> lattice({.size = {4, 4, 4}});
  EXPECT_THROW(lattice.setHeating(std::vector<float>(15, 0.1f), 1.0), std::invalid_argument);
  EXPECT_THROW(lattice.setHeating(std::vector<float>(16, 1.1f), 1.0), std::invalid_argument);
}

}  // namespace
