// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/random_transfer_function.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace vestige::test {
namespace {

/// Uniform in [low, high); the standard's distributions differ between libraries, this does not.
double uniform(std::mt19937_64& bits, double low, double high) {
  return low + (high - low) * (double(bits() >> 11) * 0x1p-53);
}

}  // namespace

RandomTransferFunction::RandomTransferFunction(std::uint64_t seed,
                                               const IntervalPartition& partition, double boxLength)
    : partition_(partition) {
  std::mt19937_64 bits(seed);
  const int intervals = partition.intervals();
  const int count = 1 + int(uniform(bits, 0.0, 3.0));
  for (int i = 0; i < count; ++i) {
    const double center = uniform(bits, 1.0, intervals - 1.0);
    const double width = uniform(bits, 0.4, 1.5);
    bumps_.push_back({center, width, uniform(bits, 1.0, 27.0) / boxLength});
  }
  for (int k = 0; k < intervals; ++k) {
    const double r = uniform(bits, 0.0, 1.0), g = uniform(bits, 0.0, 1.0);
    colors_.push_back({r, g, uniform(bits, 0.0, 1.0)});
  }
}

double RandomTransferFunction::bumpsAt(double u) const {
  double sum = 0.0;
  for (const Bump& bump : bumps_) {
    const double t = (u - bump.center) / bump.width;
    sum += bump.peak * std::exp(-0.5 * t * t);
  }
  return sum;
}

double RandomTransferFunction::position(double value) const {
  const auto bounds = partition_.bounds();
  const int k = partition_.channelOf(value);
  if (k >= partition_.intervals()) return -1.0;
  const auto i = std::size_t(k);
  return k + (value - bounds[i]) / (bounds[i + 1] - bounds[i]);
}

IntervalLook RandomTransferFunction::constant() const {
  IntervalLook look;
  for (int k = 0; k < partition_.channels(); ++k) {
    const bool inside = k < partition_.intervals();
    look.extinction.push_back(inside ? bumpsAt(k + 0.5) : 0.0);
    look.color.push_back(inside ? colors_[std::size_t(k)] : glm::dvec3(0.0));
  }
  return look;
}

double RandomTransferFunction::extinction(double value) const {
  const double u = position(value);
  return u < 0.0 ? 0.0 : bumpsAt(u);
}

glm::dvec3 RandomTransferFunction::color(double value) const {
  const int k = partition_.channelOf(value);
  return k < partition_.intervals() ? colors_[std::size_t(k)] : glm::dvec3(0.0);
}

IntervalLook RandomTransferFunction::meansOfContinuous() const {
  constexpr int kSamples = 256;
  IntervalLook look = constant();
  for (int k = 0; k < partition_.intervals(); ++k) {
    double sum = 0.0;
    for (int i = 0; i < kSamples; ++i) sum += bumpsAt(k + (i + 0.5) / kSamples);
    look.extinction[std::size_t(k)] = sum / kSamples;
  }
  return look;
}

double boxLength(const Box& box) { return std::max({box.size().x, box.size().y, box.size().z}); }

}  // namespace vestige::test
