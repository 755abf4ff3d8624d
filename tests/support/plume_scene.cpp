// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/plume_scene.h"

#include "mini-sim/plume.h"

namespace vestige::test {

namespace {

minisim::Fields<float> plumeFields(int n, unsigned which) {
  constexpr double kFreeFallTimes = 4.0;
  minisim::PlumeParameters parameters;
  parameters.size = {n, n, n};
  auto lattice = minisim::makePlume<float>(parameters);
  const long steps = long(kFreeFallTimes * n / parameters.speed);
  while (lattice.stepsDone() < steps) lattice.step();
  minisim::Fields<float> fields;
  lattice.gather(which, fields);
  return fields;
}

}  // namespace

std::vector<float> plumeTemperature(int n) {
  return plumeFields(n, minisim::kTemperature).temperature;
}

std::vector<float> plumeVorticity(int n) { return plumeFields(n, minisim::kVorticity).vorticity; }

}  // namespace vestige::test
