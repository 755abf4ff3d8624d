// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <array>
#include <glm/geometric.hpp>

#include "tests/support/sibson.h"

namespace vestige::test {
namespace {

TEST(Sibson, CoordinatesReproduceLinearFunctions) {
  const std::array<glm::dvec3, 9> seeds{glm::dvec3(0, 0, 0), {1, 0, 0}, {0, 1, 0},
                                        {1, 1, 0},           {0, 0, 1}, {1, 0, 1},
                                        {0, 1, 1},           {1, 1, 1}, {0.4, 0.6, 0.5}};
  const glm::dvec3 at(0.45, 0.55, 0.5);
  const std::vector<double> weights = SibsonCoordinates(seeds).at(at);
  ASSERT_EQ(weights.size(), seeds.size());
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < seeds.size(); ++i) sum += weights[i] * seeds[i];
  EXPECT_LT(glm::length(sum - at), 1e-9);
  EXPECT_TRUE(SibsonCoordinates(seeds).at({2, 2, 2}).empty());
}

TEST(Sibson, DiscreteNaturalNeighboursComeNearTheContinuousOnesAwayFromTheFaces) {
  for (const unsigned randomSeed : {1u, 2u, 3u}) {
    const double difference = differenceFromSibson(48, 40, randomSeed);
    EXPECT_GE(difference, 0.0) << "no probe is interior";
    EXPECT_LT(difference, 0.05);
  }
}

}  // namespace
}  // namespace vestige::test
