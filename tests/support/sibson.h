// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

namespace vestige::test {

/// Sibson's natural-neighbour coordinates by CGAL's exact Delaunay triangulation: cells continue
/// without end, so that near the hull of the seeds they are not those of a clipped diagram.
class SibsonCoordinates {
 public:
  explicit SibsonCoordinates(std::span<const glm::dvec3> seeds);
  ~SibsonCoordinates();
  /// One weight a seed, sum 1; empty where `at` is outside of the hull.
  std::vector<double> at(glm::dvec3 at) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Greatest difference between naturalNeighbours on a grid of n^3 nodes, of `count` random seeds
/// with values in [0, 1] and of corners, and Sibson's interpolation, over 200 random nodes whose
/// own cell does not meet a face of the grid and has at least kLeastCell nodes.
inline constexpr int kLeastCell = 64;
double differenceFromSibson(int n, int count, unsigned randomSeed);

}  // namespace vestige::test
