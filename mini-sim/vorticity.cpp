// SPDX-License-Identifier: BSD-3-Clause
#include <omp.h>

#include <cmath>

#include "mini-sim/thermal_lattice.h"

namespace minisim {
namespace {

/// The two cells whose difference is the slope at a cell, and one over their distance.
struct Slope {
  int before, after;
  double perCell;
};

Slope slopeAt(int at, int size, Edge edge) {
  if (size == 1) return {0, 0, 0.0};
  if (at > 0 && at < size - 1) return {at - 1, at + 1, 0.5};
  if (edge == Edge::Periodic) return {(at + size - 1) % size, (at + 1) % size, 0.5};
  return at == 0 ? Slope{0, 1, 1.0} : Slope{size - 2, size - 1, 1.0};
}

}  // namespace

template <typename Real>
void vorticityMagnitude(const std::array<int, 3>& size, const std::array<Edge, 3>& edges,
                        const std::array<std::vector<Real>, 3>& velocity, std::vector<Real>& out,
                        int threads) {
  const auto [nx, ny, nz] = size;
  const std::size_t rows = nx, layer = rows * ny;
  const Real *u = velocity[0].data(), *v = velocity[1].data(), *w = velocity[2].data();
  out.resize(layer * nz);
  Real* result = out.data();
  const int team = threads > 0 ? threads : omp_get_max_threads();
#pragma omp parallel for schedule(static) num_threads(team)
  for (int z = 0; z < size[2]; ++z) {
    const Slope sz = slopeAt(z, size[2], edges[2]);
    for (int y = 0; y < size[1]; ++y) {
      const Slope sy = slopeAt(y, size[1], edges[1]);
      const std::size_t at = z * layer + y * rows;
      const std::size_t south = z * layer + sy.before * rows, north = z * layer + sy.after * rows;
      const std::size_t down = sz.before * layer + y * rows, up = sz.after * layer + y * rows;
      const Real perY = Real(sy.perCell), perZ = Real(sz.perCell);
      const auto cell = [&](int x, int west, int east, Real perX) {
        const Real a = (w[north + x] - w[south + x]) * perY - (v[up + x] - v[down + x]) * perZ;
        const Real b = (u[up + x] - u[down + x]) * perZ - (w[at + east] - w[at + west]) * perX;
        const Real c = (v[at + east] - v[at + west]) * perX - (u[north + x] - u[south + x]) * perY;
        result[at + x] = std::sqrt(a * a + b * b + c * c);
      };
      for (int x = 1; x < size[0] - 1; ++x) cell(x, x - 1, x + 1, Real(0.5));
      for (int x : {0, size[0] - 1}) {
        const Slope sx = slopeAt(x, size[0], edges[0]);
        cell(x, sx.before, sx.after, Real(sx.perCell));
      }
    }
  }
}

template void vorticityMagnitude(const std::array<int, 3>&, const std::array<Edge, 3>&,
                                 const std::array<std::vector<float>, 3>&, std::vector<float>&,
                                 int);
template void vorticityMagnitude(const std::array<int, 3>&, const std::array<Edge, 3>&,
                                 const std::array<std::vector<double>, 3>&, std::vector<double>&,
                                 int);

}  // namespace minisim
