// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/plume_scene.h"

#include "mini-sim/plume.h"

namespace vestige::test {

std::vector<float> plumeTemperature(int n) {
  constexpr double kFreeFallTimes = 4.0;
  minisim::PlumeParameters parameters;
  parameters.size = {n, n, n};
  auto lattice = minisim::makePlume<float>(parameters);
  const long steps = long(kFreeFallTimes * n / parameters.speed);
  while (lattice.stepsDone() < steps) lattice.step();
  minisim::Fields<float> fields;
  lattice.gather(minisim::kTemperature, fields);
  return std::move(fields.temperature);
}

}  // namespace vestige::test
