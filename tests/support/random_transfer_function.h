// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "proxy/camera/box.h"
#include "proxy/transfer/interval_partition.h"
#include "proxy/transfer/transfer_function.h"

namespace vestige::test {

/// The random transfer functions of method §10, from a seed alone: one to three Gaussian bumps
/// exp(-((u - centre) / width)^2 / 2) over u, the position in intervals (0 at the partition's low
/// bound, L at its high one), and one colour an interval.
class RandomTransferFunction {
 public:
  /// `boxLength` is the world length that the peak optical depths are meant across.
  RandomTransferFunction(std::uint64_t seed, const IntervalPartition& partition, double boxLength);

  /// The `constant` function: the bumps at the middle of each interval; below and above are
  /// transparent.
  IntervalLook constant() const;
  /// The `continuous` function: the bumps at the value itself (0 outside the partition) and ...
  double extinction(double value) const;
  /// ... the colour of the value's interval, linear RGB.
  glm::dvec3 color(double value) const;
  /// What an explorer knows of the continuous function: its mean over each interval.
  IntervalLook meansOfContinuous() const;

 private:
  struct Bump {
    double center, width, peak;  ///< intervals, intervals, 1 / world unit
  };
  double bumpsAt(double u) const;
  double position(double value) const;

  IntervalPartition partition_;
  std::vector<Bump> bumps_;
  std::vector<glm::dvec3> colors_;  ///< [intervals]
};

/// The longest side of a box: what boxLength stands for in every figure.
double boxLength(const Box& box);

}  // namespace vestige::test
