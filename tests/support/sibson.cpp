// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/sibson.h"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Delaunay_triangulation_cell_base_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>
#include <CGAL/natural_neighbor_coordinates_3.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <random>
#include <utility>

#include "proxy/customization/natural_neighbours.h"

namespace vestige::test {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Vertex = CGAL::Triangulation_vertex_base_with_info_3<std::size_t, Kernel>;
using Triangulation = CGAL::Delaunay_triangulation_3<
    Kernel,
    CGAL::Triangulation_data_structure_3<Vertex, CGAL::Delaunay_triangulation_cell_base_3<Kernel>>>;

/// How many nodes are in the cell of a new seed at `q`; 0 if a face of the grid is.
int interiorCell(std::span<const GridSeed> seeds, int n, glm::ivec3 q) {
  const auto squared = [](glm::ivec3 d) { return d.x * d.x + d.y * d.y + d.z * d.z; };
  int nodes = 0;
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const glm::ivec3 v(x, y, z);
        const int own = squared(v - q);
        const bool mine = std::all_of(seeds.begin(), seeds.end(), [&](const GridSeed& seed) {
          return own <= squared(v - seed.node);
        });
        if (!mine) continue;
        if (std::min({x, y, z}) == 0 || std::max({x, y, z}) == n - 1) return 0;
        ++nodes;
      }
  return nodes;
}

}  // namespace

struct SibsonCoordinates::Impl {
  Triangulation triangulation;
  std::size_t seeds = 0;
};

SibsonCoordinates::SibsonCoordinates(std::span<const glm::dvec3> seeds)
    : impl_(std::make_unique<Impl>()) {
  for (const glm::dvec3& seed : seeds)
    impl_->triangulation.insert({seed.x, seed.y, seed.z})->info() = impl_->seeds++;
}

SibsonCoordinates::~SibsonCoordinates() = default;

std::vector<double> SibsonCoordinates::at(glm::dvec3 at) const {
  std::vector<std::pair<Triangulation::Vertex_handle, double>> found;
  double norm = 0.0;
  const auto result = CGAL::sibson_natural_neighbor_coordinates_3(
      impl_->triangulation, Kernel::Point_3(at.x, at.y, at.z), std::back_inserter(found), norm);
  if (!result.third || !(norm > 0.0)) return {};
  std::vector<double> weights(impl_->seeds);
  for (const auto& [vertex, weight] : found) weights[vertex->info()] += weight / norm;
  return weights;
}

double differenceFromSibson(int n, int count, unsigned randomSeed) {
  std::mt19937 random(randomSeed);
  const auto node = [&] { return int(random() % unsigned(n)); };
  std::vector<GridSeed> seeds;
  std::vector<NodeValues> rows;
  std::vector<glm::dvec3> points;
  const auto add = [&](glm::ivec3 at) {
    for (const GridSeed& seed : seeds)
      if (seed.node == at) return;
    seeds.push_back({at, int(rows.size())});
    rows.push_back({float(random() % 1001u) / 1000.0f});
    points.emplace_back(at);
  };
  for (int i = 0; i < 8; ++i) add({i & 1 ? n - 1 : 0, i & 2 ? n - 1 : 0, i & 4 ? n - 1 : 0});
  while (int(seeds.size()) < count + 8) add({node(), node(), node()});
  const SibsonCoordinates sibson(points);
  const auto values = naturalNeighbours({n, n, n}, seeds, rows, SeedMetric::Euclidean);
  double greatest = -1.0;
  for (int probes = 0, tries = 0; probes < 200 && tries < 4000; ++tries) {
    const glm::ivec3 q(node(), node(), node());
    if (interiorCell(seeds, n, q) < kLeastCell) continue;
    const std::vector<double> weights = sibson.at(q);
    if (weights.empty()) continue;
    ++probes;
    double wanted = 0.0;
    for (std::size_t i = 0; i < weights.size(); ++i) wanted += weights[i] * double(rows[i][0]);
    const float made = values[std::size_t((q.z * n + q.y) * n + q.x)][0];
    greatest = std::max(greatest, std::abs(wanted - double(made)));
  }
  return greatest;
}

}  // namespace vestige::test
