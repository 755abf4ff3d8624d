// SPDX-License-Identifier: BSD-3-Clause
// The inner loops. Built with -ffp-contract=off -fno-math-errno: every clone below, and so every
// x86-64 processor, gives the same bits.
#include "mini-sim/lattice_kernel.h"

#include <cmath>

#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define MINISIM_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define MINISIM_CLONES
#endif
#define MINISIM_INLINE inline __attribute__((always_inline))

namespace minisim {
namespace {

template <typename Real>
struct Vector {
  Real x, y, z;
};

template <typename Real>
struct SymmetricTensor {
  Real xx, yy, zz, xy, xz, yz;
};

/// The third-order moments that D3Q19 can carry.
template <typename Real>
struct ThirdMoments {
  Real xxy, xyy, xxz, xzz, yyz, yzz;
};

/// Density (less 1), momentum and momentum flux (less its value at rest) of one cell.
template <typename Real>
struct FlowMoments {
  Real density;
  Vector<Real> momentum;
  SymmetricTensor<Real> flux;
};

template <typename Real>
MINISIM_INLINE FlowMoments<Real> flowMoments(const std::array<Real*, kFlowDirections>& f, int n) {
  // Sums and differences of the nine opposite pairs: even and odd moments need only those.
  const Real sx = f[1][n] + f[2][n], dx = f[1][n] - f[2][n];
  const Real sy = f[3][n] + f[4][n], dy = f[3][n] - f[4][n];
  const Real sz = f[5][n] + f[6][n], dz = f[5][n] - f[6][n];
  const Real sxy = f[7][n] + f[8][n], dxy = f[7][n] - f[8][n];
  const Real sxY = f[9][n] + f[10][n], dxY = f[9][n] - f[10][n];
  const Real sxz = f[11][n] + f[12][n], dxz = f[11][n] - f[12][n];
  const Real sxZ = f[13][n] + f[14][n], dxZ = f[13][n] - f[14][n];
  const Real syz = f[15][n] + f[16][n], dyz = f[15][n] - f[16][n];
  const Real syZ = f[17][n] + f[18][n], dyZ = f[17][n] - f[18][n];
  const Real inXy = sxy + sxY, inXz = sxz + sxZ, inYz = syz + syZ;
  FlowMoments<Real> m;
  m.density = f[0][n] + ((sx + sy) + sz) + ((inXy + inXz) + inYz);
  m.momentum = {dx + (dxy + dxY) + (dxz + dxZ), dy + (dxy - dxY) + (dyz + dyZ),
                dz + (dxz - dxZ) + (dyz - dyZ)};
  m.flux = {sx + (inXy + inXz), sy + (inXy + inYz), sz + (inXz + inYz),
            sxy - sxY,          sxz - sxZ,          syz - syZ};
  return m;
}

/// Writes the populations of one cell with the given moments, opposites exchanged. `s` is the
/// momentum flux less density / 3, `a` the third Hermite moments: f_i - w_i = w_i (density +
/// 3 c_i.j + 9/2 (c_i c_i - 1/3) : s + third order); the third order is written out per direction.
template <typename Real>
MINISIM_INLINE void writeFlow(const std::array<Real*, kFlowDirections>& f, int n, Real density,
                              const Vector<Real>& j, const SymmetricTensor<Real>& s,
                              const ThirdMoments<Real>& a) {
  const Real w1 = Real(flowWeight(1)), w2 = Real(flowWeight(7));
  const Real base = density - Real(1.5) * (s.xx + s.yy + s.zz);
  const Real hxx = Real(4.5) * s.xx, hyy = Real(4.5) * s.yy, hzz = Real(4.5) * s.zz;
  const Real hxy = Real(9) * s.xy, hxz = Real(9) * s.xz, hyz = Real(9) * s.yz;
  const Real jx = Real(3) * j.x, jy = Real(3) * j.y, jz = Real(3) * j.z;
  const Real xxy = Real(9) * a.xxy, xyy = Real(9) * a.xyy, xxz = Real(9) * a.xxz;
  const Real xzz = Real(9) * a.xzz, yyz = Real(9) * a.yyz, yzz = Real(9) * a.yzz;
  const auto pair = [&](int i, Real w, Real even, Real odd) {
    f[i + 1][n] = w * (even + odd);
    f[i][n] = w * (even - odd);
  };
  f[0][n] = Real(flowWeight(0)) * base;
  pair(1, w1, base + hxx, jx - (xyy + xzz));
  pair(3, w1, base + hyy, jy - (xxy + yzz));
  pair(5, w1, base + hzz, jz - (xxz + yyz));
  const Real xy = base + (hxx + hyy), xz = base + (hxx + hzz), yz = base + (hyy + hzz);
  pair(7, w2, xy + hxy, (jx + xyy) + (jy + xxy));
  pair(9, w2, xy - hxy, (jx + xyy) - (jy + xxy));
  pair(11, w2, xz + hxz, (jx + xzz) + (jz + xxz));
  pair(13, w2, xz - hxz, (jx + xzz) - (jz + xxz));
  pair(15, w2, yz + hyz, (jy + yzz) + (jz + yyz));
  pair(17, w2, yz - hyz, (jy + yzz) - (jz + yyz));
}

/// Temperature, its flux and its second moments along the axes.
template <typename Real>
struct HeatMoments {
  Real temperature;
  Vector<Real> flux;
  Vector<Real> second;
};

template <typename Real>
MINISIM_INLINE HeatMoments<Real> heatMoments(const std::array<Real*, kHeatDirections>& g, int n) {
  HeatMoments<Real> m;
  m.second = {g[1][n] + g[2][n], g[3][n] + g[4][n], g[5][n] + g[6][n]};
  m.temperature = g[0][n] + (m.second.x + m.second.y + m.second.z);
  m.flux = {g[1][n] - g[2][n], g[3][n] - g[4][n], g[5][n] - g[6][n]};
  return m;
}

/// Writes the temperature's populations with these moments, opposites exchanged.
template <typename Real>
MINISIM_INLINE void writeHeat(const std::array<Real*, kHeatDirections>& g, int n,
                              const HeatMoments<Real>& m) {
  const Real half = Real(0.5);
  g[0][n] = m.temperature - (m.second.x + m.second.y + m.second.z);
  g[2][n] = half * (m.second.x + m.flux.x);
  g[1][n] = half * (m.second.x - m.flux.x);
  g[4][n] = half * (m.second.y + m.flux.y);
  g[3][n] = half * (m.second.y - m.flux.y);
  g[6][n] = half * (m.second.z + m.flux.z);
  g[5][n] = half * (m.second.z - m.flux.z);
}

/// Velocity from momentum with half of the step's force [Guo 2002]; the damping force
/// -damping * density * velocity is implicit.
template <typename Real>
MINISIM_INLINE Vector<Real> velocityOf(const FlowMoments<Real>& m, Real lift, Real damping) {
  const Real scale = Real(1) / ((Real(1) + m.density) * (Real(1) + Real(0.5) * damping));
  return {m.momentum.x * scale, m.momentum.y * scale, (m.momentum.z + Real(0.5) * lift) * scale};
}

template <typename Real, bool kHeated>
MINISIM_INLINE void collideCells(const RowPointers<Real>& row, int count,
                                 const RowPhysics<Real>& p) {
  const RowPointers<Real> at = row;
  const Real tau0 = p.relaxationTime, heatExcess0 = p.heatRelaxationTime - Real(0.5);
  const Real smagorinsky = p.smagorinsky, eddyHeat = p.eddyHeat, damping = p.damping;
  const Real buoyancy = p.buoyancy, hot = p.hot;
  const Real* heating = p.heating;
#pragma GCC ivdep
  for (int n = 0; n < count; ++n) {
    const FlowMoments<Real> m = flowMoments(at.flow, n);
    const HeatMoments<Real> h = heatMoments(at.heat, n);
    const Real lift = buoyancy * h.temperature;
    const Vector<Real> u = velocityOf(m, lift, damping);
    const Real density = Real(1) + m.density;
    const Vector<Real> j = {density * u.x, density * u.y, density * u.z};
    const Vector<Real> force = {-damping * j.x, -damping * j.y, lift - damping * j.z};

    // uF + Fu, halved: the force's share of the momentum flux.
    const SymmetricTensor<Real> work = {u.x * force.x,
                                        u.y * force.y,
                                        u.z * force.z,
                                        Real(0.5) * (u.x * force.y + u.y * force.x),
                                        Real(0.5) * (u.x * force.z + u.z * force.x),
                                        Real(0.5) * (u.y * force.z + u.z * force.y)};
    // Viscous stress: flux beyond equilibrium. Only this moment is kept (regularised collision,
    // Latt and Chopard 2006).
    const Real pressure = m.density * Real(1.0 / 3);
    const SymmetricTensor<Real> stress = {m.flux.xx - pressure - j.x * u.x + work.xx,
                                          m.flux.yy - pressure - j.y * u.y + work.yy,
                                          m.flux.zz - pressure - j.z * u.z + work.zz,
                                          m.flux.xy - j.x * u.y + work.xy,
                                          m.flux.xz - j.x * u.z + work.xz,
                                          m.flux.yz - j.y * u.z + work.yz};
    // Smagorinsky: relaxation time from the local stress [Hou 1996].
    const Real norm2 =
        stress.xx * stress.xx + stress.yy * stress.yy + stress.zz * stress.zz +
        Real(2) * (stress.xy * stress.xy + stress.xz * stress.xz + stress.yz * stress.yz);
    const Real tau = Real(0.5) * (tau0 + std::sqrt(tau0 * tau0 + smagorinsky * std::sqrt(norm2)));
    const Real keep = Real(1) - Real(1) / tau;
    const SymmetricTensor<Real> flux = {
        j.x * u.x + work.xx + keep * stress.xx, j.y * u.y + work.yy + keep * stress.yy,
        j.z * u.z + work.zz + keep * stress.zz, j.x * u.y + work.xy + keep * stress.xy,
        j.x * u.z + work.xz + keep * stress.xz, j.y * u.z + work.yz + keep * stress.yz};
    const Vector<Real> momentum = {j.x + Real(0.5) * force.x, j.y + Real(0.5) * force.y,
                                   j.z + Real(0.5) * force.z};
    // Third moments follow from the lower ones (recursive regularisation, Malaspinas 2015; for
    // D3Q19 [Jacob 2018]); without them fast shear at small viscosity is unstable.
    const auto third = [&](Real ua, Real ub, Real jb, Real aa, Real ab) {
      return ua * ua * jb + keep * (Real(2) * ua * ab + ub * aa);
    };
    const ThirdMoments<Real> thirds = {
        third(u.x, u.y, j.y, stress.xx, stress.xy), third(u.y, u.x, j.x, stress.yy, stress.xy),
        third(u.x, u.z, j.z, stress.xx, stress.xz), third(u.z, u.x, j.x, stress.zz, stress.xz),
        third(u.y, u.z, j.z, stress.yy, stress.yz), third(u.z, u.y, j.y, stress.zz, stress.yz)};
    writeFlow(at.flow, n, m.density, momentum, flux, thirds);

    // Temperature: two relaxation times. The flux's gives the diffusivity; the second moments' is
    // tied to it by (tau_odd - 1/2)(tau_even - 1/2) = 1/4, the product at which advection stays
    // stable however small the diffusivity [Ginzburg 2010].
    const Real excess = heatExcess0 + eddyHeat * (tau - tau0);
    const Real keepOdd = Real(1) - Real(1) / (Real(0.5) + excess);
    const Real keepEven = Real(1) - Real(1) / (Real(0.5) + Real(0.25) / excess);
    const Real t = h.temperature;
    Real after = t - damping * t;
    if constexpr (kHeated) after += heating[n] * (hot - t);
    const Real quarter = Real(kHeatSoundSpeedSquared);
    const Vector<Real> second = {quarter + u.x * u.x, quarter + u.y * u.y, quarter + u.z * u.z};
    writeHeat(at.heat, n,
              {after,
               {after * u.x + keepOdd * (h.flux.x - t * u.x),
                after * u.y + keepOdd * (h.flux.y - t * u.y),
                after * u.z + keepOdd * (h.flux.z - t * u.z)},
               {after * second.x + keepEven * (h.second.x - t * second.x),
                after * second.y + keepEven * (h.second.y - t * second.y),
                after * second.z + keepEven * (h.second.z - t * second.z)}});
  }
}

template <typename Real>
MINISIM_INLINE void momentsOfCells(const RowPointers<Real>& row, int count,
                                   const RowPhysics<Real>& p, const RowMoments<Real>& out) {
  if (out.temperature)
    for (int n = 0; n < count; ++n) out.temperature[n] = heatMoments(row.heat, n).temperature;
  if (!out.density && !out.velocity[0]) return;
  for (int n = 0; n < count; ++n) {
    const FlowMoments<Real> m = flowMoments(row.flow, n);
    if (out.density) out.density[n] = Real(1) + m.density;
    if (!out.velocity[0]) continue;
    const Real lift = p.buoyancy * heatMoments(row.heat, n).temperature;
    const Vector<Real> u = velocityOf(m, lift, p.damping);
    out.velocity[0][n] = u.x;
    out.velocity[1][n] = u.y;
    out.velocity[2][n] = u.z;
  }
}

}  // namespace

MINISIM_CLONES void collideRow(const RowPointers<float>& row, int count,
                               const RowPhysics<float>& physics) {
  if (physics.heating)
    collideCells<float, true>(row, count, physics);
  else
    collideCells<float, false>(row, count, physics);
}

MINISIM_CLONES void collideRow(const RowPointers<double>& row, int count,
                               const RowPhysics<double>& physics) {
  if (physics.heating)
    collideCells<double, true>(row, count, physics);
  else
    collideCells<double, false>(row, count, physics);
}

MINISIM_CLONES void momentsOfRow(const RowPointers<float>& row, int count,
                                 const RowPhysics<float>& physics, const RowMoments<float>& out) {
  momentsOfCells(row, count, physics, out);
}

MINISIM_CLONES void momentsOfRow(const RowPointers<double>& row, int count,
                                 const RowPhysics<double>& physics, const RowMoments<double>& out) {
  momentsOfCells(row, count, physics, out);
}

}  // namespace minisim
