// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/customization/natural_neighbours.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <set>
#include <tuple>

#include "proxy/base/error.h"

namespace vestige {
namespace {

struct Scene {
  glm::ivec3 nodes{1};
  std::vector<GridSeed> seeds;
  std::vector<NodeValues> rows;

  std::size_t indexOf(glm::ivec3 p) const {
    return std::size_t((p.z * nodes.y + p.y) * nodes.x + p.x);
  }
  std::vector<NodeValues> interpolated(SeedMetric metric, int threads = 0) const {
    return naturalNeighbours(nodes, seeds, rows, metric, threads);
  }
};

/// The eight corners share row 0; `count` others stand anywhere, some of them with equal values.
Scene randomScene(glm::ivec3 nodes, int count, unsigned randomSeed) {
  std::mt19937 random(randomSeed);
  Scene scene;
  scene.nodes = nodes;
  scene.rows.push_back({1.0f, 1.0f});
  std::set<std::tuple<int, int, int>> taken;
  const auto add = [&](glm::ivec3 p, int row) {
    if (taken.insert({p.x, p.y, p.z}).second) scene.seeds.push_back({p, row});
  };
  for (int c = 0; c < 8; ++c) {
    add({c & 1 ? nodes.x - 1 : 0, c & 2 ? nodes.y - 1 : 0, c & 4 ? nodes.z - 1 : 0}, 0);
  }
  std::uniform_real_distribution<float> value(-1.0f, 1.0f);
  for (int i = 0; i < count; ++i) {
    NodeValues values;
    for (float& v : values) v = value(random);
    if (i % 3 > 0 || i == 0) scene.rows.push_back(values);
    add({int(random() % unsigned(nodes.x)), int(random() % unsigned(nodes.y)),
         int(random() % unsigned(nodes.z))},
        int(scene.rows.size()) - 1);
  }
  return scene;
}

int distance(glm::ivec3 a, glm::ivec3 b, SeedMetric metric) {
  const glm::ivec3 d = a - b;
  return metric == SeedMetric::Euclidean ? d.x * d.x + d.y * d.y + d.z * d.z
                                         : std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
}

template <typename Visit>
void forEachNode(glm::ivec3 nodes, const Visit& visit) {
  for (int z = 0; z < nodes.z; ++z)
    for (int y = 0; y < nodes.y; ++y)
      for (int x = 0; x < nodes.x; ++x) visit(glm::ivec3(x, y, z));
}

/// The paper's Alg. 1 and 2: every node looks at every node.
std::vector<NodeValues> everyNodeLooksAtEveryNode(const Scene& scene, SeedMetric metric) {
  std::vector<std::size_t> nearest;
  forEachNode(scene.nodes, [&](glm::ivec3 v) {
    std::size_t best = 0;
    for (std::size_t s = 1; s < scene.seeds.size(); ++s) {
      if (distance(v, scene.seeds[s].node, metric) < distance(v, scene.seeds[best].node, metric))
        best = s;
    }
    nearest.push_back(best);
  });
  std::vector<NodeValues> result;
  forEachNode(scene.nodes, [&](glm::ivec3 q) {
    std::vector<int> counts(scene.rows.size());
    forEachNode(scene.nodes, [&](glm::ivec3 v) {
      const GridSeed& seed = scene.seeds[nearest[scene.indexOf(v)]];
      if (distance(q, v, metric) <= distance(v, seed.node, metric)) ++counts[std::size_t(seed.row)];
    });
    int total = 0;
    for (int count : counts) total += count;
    NodeValues values;
    for (std::size_t c = 0; c < values.size(); ++c) {
      double sum = 0.0;
      for (std::size_t row = 0; row < counts.size(); ++row)
        sum += double(counts[row]) * double(scene.rows[row][c]);
      values[c] = float(sum / total);
    }
    const auto at = std::find_if(scene.seeds.begin(), scene.seeds.end(),
                                 [&](const GridSeed& seed) { return seed.node == q; });
    result.push_back(at == scene.seeds.end() ? values : scene.rows[std::size_t(at->row)]);
  });
  return result;
}

constexpr SeedMetric kMetrics[] = {SeedMetric::Euclidean, SeedMetric::Manhattan};

TEST(NaturalNeighbours, EqualThePapersDirectCountBitForBit) {
  for (const SeedMetric metric : kMetrics) {
    for (unsigned i = 0; i < 12; ++i) {
      const glm::ivec3 nodes(2 + int(i * 5 % 11), 3 + int(i * 7 % 9), 1 + int(i % 8));
      const Scene scene = randomScene(nodes, int(i), i);
      EXPECT_EQ(scene.interpolated(metric), everyNodeLooksAtEveryNode(scene, metric)) << i;
    }
  }
}

TEST(NaturalNeighbours, DoNotDependOnTheNumberOfThreads) {
  const Scene scene = randomScene({20, 17, 23}, 14, 3);
  EXPECT_EQ(scene.interpolated(SeedMetric::Euclidean, 1),
            scene.interpolated(SeedMetric::Euclidean, 5));
}

TEST(NaturalNeighbours, AreExactAtSeedsAndStayInTheRangeOfTheirValues) {
  for (const SeedMetric metric : kMetrics) {
    const Scene scene = randomScene({24, 24, 24}, 20, 5);
    const auto values = scene.interpolated(metric);
    for (const GridSeed& seed : scene.seeds)
      EXPECT_EQ(values[scene.indexOf(seed.node)], scene.rows[std::size_t(seed.row)]);
    for (std::size_t c = 0; c < 8; ++c) {
      const auto less = [c](const NodeValues& a, const NodeValues& b) { return a[c] < b[c]; };
      const auto [low, high] = std::minmax_element(scene.rows.begin(), scene.rows.end(), less);
      for (const NodeValues& v : values) {
        ASSERT_GE(v[c], (*low)[c]);
        ASSERT_LE(v[c], (*high)[c]);
      }
    }
  }
}

TEST(NaturalNeighbours, ChangeLittleFromNodeToNodeAndLessOnFinerGrids) {
  // Seeds at the same places of a unit cube; the greatest step between neighbouring nodes.
  for (const SeedMetric metric : kMetrics) {
    double previous = 1.0;
    for (const int n : {17, 33, 65}) {
      Scene scene = randomScene({n, n, n}, 0, 1);
      for (const glm::ivec3 p : {glm::ivec3(1, 2, 2), {3, 1, 2}, {2, 3, 3}}) {
        scene.rows.push_back({float(scene.rows.size() % 2)});
        scene.seeds.push_back({p * ((n - 1) / 4), int(scene.rows.size()) - 1});
      }
      const auto values = scene.interpolated(metric);
      double greatest = 0.0;
      forEachNode(scene.nodes - glm::ivec3(1, 0, 0), [&](glm::ivec3 p) {
        const float a = values[scene.indexOf(p)][0];
        const float b = values[scene.indexOf(p + glm::ivec3(1, 0, 0))][0];
        greatest = std::max(greatest, std::abs(double(a) - double(b)));
      });
      EXPECT_LT(greatest, 0.75 * previous) << n;
      previous = greatest;
    }
    EXPECT_LT(previous, 0.15);
  }
}

TEST(NaturalNeighbours, AreLocal) {
  // A wall of seeds between two halves: what is behind it does not matter.
  Scene scene = randomScene({33, 9, 9}, 0, 1);
  scene.rows.push_back({0.5f});
  for (int y = 0; y < 9; y += 2)
    for (int z = 0; z < 9; z += 2) scene.seeds.push_back({{16, y, z}, 1});
  scene.rows.push_back({0.25f});
  scene.seeds.push_back({{28, 4, 4}, 2});
  for (const SeedMetric metric : kMetrics) {
    const auto before = scene.interpolated(metric);
    Scene changed = scene;
    changed.rows[2] = {7.0f};
    const auto after = changed.interpolated(metric);
    EXPECT_NE(before, after);
    forEachNode({14, 9, 9}, [&](glm::ivec3 p) {
      EXPECT_EQ(before[scene.indexOf(p)], after[scene.indexOf(p)]);
    });
  }
}

TEST(NaturalNeighbours, AreOddAroundAPlaneOfSymmetry) {
  // 0 at the low x face's corners, 1 at the high one's, and a pair of seeds to match.
  for (const SeedMetric metric : kMetrics) {
    Scene scene;
    scene.nodes = {22, 13, 13};
    scene.rows = {{0.0f}, {1.0f}};
    for (int c = 0; c < 8; ++c)
      scene.seeds.push_back({{c & 1 ? 21 : 0, c & 2 ? 12 : 0, c & 4 ? 12 : 0}, c & 1});
    scene.seeds.push_back({{6, 4, 5}, 0});
    scene.seeds.push_back({{15, 4, 5}, 1});
    const auto values = scene.interpolated(metric);
    forEachNode(scene.nodes, [&](glm::ivec3 p) {
      // Nodes as near to a seed on either side count for the first: odd but for them.
      const float here = values[scene.indexOf(p)][0];
      const float there = values[scene.indexOf({21 - p.x, p.y, p.z})][0];
      EXPECT_NEAR(here + there, 1.0f, 0.05f);
    });
  }
}

TEST(NaturalNeighbours, RefuseWhatMakesNoGrid) {
  const Scene scene = randomScene({8, 8, 8}, 0, 1);
  const auto refuses = [&](Scene wrong, const std::string& sentence) {
    try {
      wrong.interpolated(SeedMetric::Euclidean);
      ADD_FAILURE() << sentence;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::InvalidArgument);
      EXPECT_EQ(error.what(), sentence);
    }
  };
  Scene wrong = scene;
  wrong.nodes = {8, 129, 8};
  refuses(wrong, "seeds are interpolated on 1 to 128 nodes an axis, not 8 x 129 x 8");
  wrong.nodes = {0, 8, 8};
  refuses(wrong, "seeds are interpolated on 1 to 128 nodes an axis, not 0 x 8 x 8");
  wrong = scene;
  wrong.seeds.clear();
  refuses(wrong, "there are no seeds to interpolate between");
  wrong = scene;
  wrong.seeds[3].node.y = 8;
  refuses(wrong, "a seed at node 7, 8, 0 is outside a grid of 8 x 8 x 8");
  wrong = scene;
  wrong.seeds[7].row = 1;
  refuses(wrong, "a seed has row 1 of 1");
  wrong = scene;
  wrong.seeds.push_back(wrong.seeds[7]);
  refuses(wrong, "two seeds stand on node 7, 7, 7");
}

}  // namespace
}  // namespace vestige
