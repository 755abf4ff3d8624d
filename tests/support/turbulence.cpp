// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/turbulence.h"

#include <fftw3.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

namespace vestige::test {
namespace {

/// splitmix64's finaliser: a well mixed number of a number.
std::uint64_t mixed(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// The phase of mode (kx, ky, kz), in [0, 2π).
double phase(int kx, int ky, int kz, std::uint64_t seed) {
  const auto part = [](int k) { return std::uint64_t(k + 4096); };
  const std::uint64_t bits = mixed(seed + mixed(part(kx) << 40 | part(ky) << 20 | part(kz)));
  return 2.0 * std::numbers::pi * double(bits >> 11) * 0x1p-53;
}

int signedFrequency(int i, int n) { return i <= n / 2 ? i : i - n; }

}  // namespace

std::vector<float> turbulence(int n, std::uint64_t seed) {
  // Half of the spectrum in the layout of a real FFT, padded rows in place: kx is the short axis.
  const auto half = std::size_t(n / 2 + 1), side = std::size_t(n);
  const std::unique_ptr<fftwf_complex[], void (*)(void*)> modes(
      fftwf_alloc_complex(half * side * side), fftwf_free);
  for (int z = 0; z < n; ++z) {
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x <= n / 2; ++x) {
        const int ky = signedFrequency(y, n), kz = signedFrequency(z, n);
        fftwf_complex& mode =
            modes[(std::size_t(z) * side + std::size_t(y)) * half + std::size_t(x)];
        const double k = std::sqrt(double(x) * x + double(ky) * ky + double(kz) * kz);
        // The mean goes with the scaling, the Nyquist modes have no partner to be real with.
        const bool skipped = k == 0.0 || 2 * x == n || 2 * ky == n || 2 * kz == n;
        const double amplitude =
            skipped ? 0.0 : std::pow(k, -11.0 / 6.0) * std::exp(-(k / 60.0) * (k / 60.0));
        // In the plane x = 0 modes k and -k are both stored and must be conjugate.
        const bool mirrored = x == 0 && (kz < 0 || (kz == 0 && ky < 0));
        const double angle = mirrored ? -phase(0, -ky, -kz, seed) : phase(x, ky, kz, seed);
        mode[0] = float(amplitude * std::cos(angle));
        mode[1] = float(amplitude * std::sin(angle));
      }
    }
  }
  auto* values = reinterpret_cast<float*>(modes.get());
  const fftwf_plan plan =
      fftwf_plan_dft_c2r_3d(n, n, n, modes.get(), values, FFTW_ESTIMATE | FFTW_DESTROY_INPUT);
  fftwf_execute(plan);
  fftwf_destroy_plan(plan);

  std::vector<float> field(side * side * side);
  for (std::size_t row = 0; row < side * side; ++row) {
    std::copy_n(values + row * 2 * half, side, field.data() + row * side);
  }
  const auto [low, high] = std::minmax_element(field.begin(), field.end());
  const float base = *low, range = *high - *low;
  for (float& value : field) value = (value - base) / range;
  return field;
}

}  // namespace vestige::test
