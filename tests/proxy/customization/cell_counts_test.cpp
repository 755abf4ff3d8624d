// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/customization/cell_counts.h"

#include <gtest/gtest.h>

#include <random>

namespace vestige {
namespace {

int distance(glm::ivec3 a, glm::ivec3 b, SeedMetric metric) {
  const glm::ivec3 d = a - b;
  return measured(metric, d.x) + measured(metric, d.y) + measured(metric, d.z);
}

/// Nodes of a seed's cell for which q is no farther than the seed.
int directCount(std::span<const GridSeed> seeds, std::span<const CellRun> runs, int seed,
                glm::ivec3 q, SeedMetric metric) {
  int count = 0;
  for (const CellRun& run : runs) {
    if (run.seed != seed) continue;
    for (int x = run.first; x < run.end; ++x) {
      const glm::ivec3 v(x, run.y, run.z);
      if (distance(q, v, metric) <= distance(v, seeds[std::size_t(seed)].node, metric)) ++count;
    }
  }
  return count;
}

void expectDirectCounts(glm::ivec3 nodes, const std::vector<GridSeed>& seeds, SeedMetric metric,
                        std::span<const int> slices) {
  const auto runs = voronoiRuns(nodes, seeds, metric);
  const CellCounts cells(nodes, metric, seeds, runs);
  SliceCounter counter(cells);
  std::mt19937 random(1);
  for (const int z : slices) {
    for (const CellCounts::Cell& cell : cells.cells()) {
      counter.add(cell, z);
      for (int i = 0; i < 12; ++i) {
        const glm::ivec3 q(int(random() % unsigned(nodes.x)), int(random() % unsigned(nodes.y)), z);
        ASSERT_EQ(counter.row(q.y)[q.x], directCount(seeds, runs, cell.seed.row, q, metric))
            << q.x << ' ' << q.y << ' ' << q.z;
      }
      counter.clear();
      for (int y = 0; y < nodes.y; ++y)
        for (int x = 0; x < nodes.x; ++x) ASSERT_EQ(counter.row(y)[x], 0);
    }
  }
}

constexpr SeedMetric kMetrics[] = {SeedMetric::Euclidean, SeedMetric::Manhattan};

TEST(CellCounts, AreTrueForACellOfMoreNodesThanSixteenBitsHold) {
  for (const SeedMetric metric : kMetrics) {
    expectDirectCounts({49, 45, 47}, {{{3, 40, 20}, 0}}, metric, std::vector{0, 20, 46});
    expectDirectCounts({49, 45, 47}, {{{24, 0, 46}, 0}, {{48, 44, 46}, 1}}, metric,
                       std::vector{5, 46});
  }
}

TEST(CellCounts, AreTrueOnTheLongestRowsAndTheThinnestGrids) {
  for (const SeedMetric metric : kMetrics) {
    expectDirectCounts({128, 3, 128}, {{{0, 0, 0}, 0}, {{127, 2, 127}, 1}}, metric,
                       std::vector{0, 1, 64, 127});
    expectDirectCounts({128, 128, 1}, {{{127, 0, 0}, 0}}, metric, std::vector{0});
    expectDirectCounts({1, 128, 5}, {{{0, 127, 4}, 0}, {{0, 3, 0}, 1}}, metric, std::vector{0, 4});
    expectDirectCounts({1, 1, 1}, {{{0, 0, 0}, 0}}, metric, std::vector{0});
  }
}

TEST(CellCounts, AreSortedByTheRowOfValuesThenBySeed) {
  const std::vector<GridSeed> seeds = {{{1, 1, 1}, 1}, {{8, 8, 8}, 0}, {{1, 8, 1}, 1}};
  const auto runs = voronoiRuns({10, 10, 10}, seeds, SeedMetric::Euclidean);
  const CellCounts cells({10, 10, 10}, SeedMetric::Euclidean, seeds, runs);
  std::vector<GridSeed> order;
  std::size_t nodes = 0;
  for (const CellCounts::Cell& cell : cells.cells()) {
    order.push_back(cell.seed);
    for (std::size_t i = cell.begin; i < cell.end; ++i)
      nodes += std::size_t(cells.runs()[i].last - cells.runs()[i].first + 1);
  }
  EXPECT_EQ(order, (std::vector<GridSeed>{seeds[1], seeds[0], seeds[2]}));
  EXPECT_EQ(nodes, 1000u);
}

}  // namespace
}  // namespace vestige
