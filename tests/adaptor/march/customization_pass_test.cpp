// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/volume/customization_pass.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "proxy/base/error.h"

namespace vestige {
namespace {

const Box kBox{glm::dvec3(-1.0, 0.0, 2.0), glm::dvec3(1.0, 1.5, 2.75)};

Customization randomCustomization(int resolution, int seeds, unsigned randomSeed) {
  std::mt19937 random(randomSeed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Customization customization;
  customization.resolution = resolution;
  for (int i = 0; i < seeds; ++i) {
    SeedPrimitive& seed = customization.seeds.emplace_back();
    for (int axis = 0; axis < 3; ++axis)
      seed.position[axis] = kBox.low[axis] + unit(random) * kBox.size()[axis];
    seed.parameters.opacity = 3.0 * unit(random);
    seed.parameters.gamma = 0.5 + unit(random);
    seed.parameters.shift = {unit(random) - 0.5, 0.0, unit(random) - 0.5};
    if (i % 4 == 1) seed.parameters = customization.seeds.front().parameters;
  }
  return customization;
}

/// The next float, either way, is near enough: see customization_pass.h.
void expectSame(const std::vector<glm::vec4>& a, const std::vector<glm::vec4>& b) {
  ASSERT_EQ(a.size(), b.size());
  constexpr float kFar = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (int c = 0; c < 4; ++c) {
      ASSERT_GE(a[i][c], std::nextafter(b[i][c], -kFar)) << i << ' ' << c;
      ASSERT_LE(a[i][c], std::nextafter(b[i][c], kFar)) << i << ' ' << c;
    }
  }
}

class CustomizationPass : public testing::Test {
 protected:
  std::shared_ptr<gl::Device> device = gl::Device::create("auto");
};

TEST_F(CustomizationPass, MakesTheVolumeOfTheCpuInBothMetricsAtSeveralResolutions) {
  for (const SeedMetric metric : {SeedMetric::Euclidean, SeedMetric::Manhattan}) {
    for (const auto& [resolution, seeds] :
         {std::pair(32, 0), {32, 1}, {32, 20}, {45, 9}, {64, 40}}) {
      Customization customization = randomCustomization(resolution, seeds, unsigned(seeds));
      customization.metric = metric;
      const CustomVolume wanted = customVolume(customization, kBox);
      const CustomVolume volume = customVolume(*device, customization, kBox);
      EXPECT_EQ(volume.nodes, wanted.nodes);
      expectSame(volume.optics, wanted.optics);
      expectSame(volume.values, wanted.values);
    }
  }
}

TEST_F(CustomizationPass, CountsTheSameNodes) {
  // Of two values, 0 and 1, the mean is the share of nodes: count / total to a float's 24 bits
  // tells all fractions of fewer than 4096 nodes apart.
  std::mt19937 random(7);
  for (const SeedMetric metric : {SeedMetric::Euclidean, SeedMetric::Manhattan}) {
    for (const glm::ivec3 nodes :
         {glm::ivec3(15, 16, 17), {33, 11, 11}, {128, 5, 6}, {1, 64, 63}}) {
      std::vector<GridSeed> seeds = {{{0, 0, 0}, 0}};
      std::vector<NodeValues> rows(8);
      for (int row = 0; row < 8; ++row) {
        rows[std::size_t(row)][std::size_t(row)] = 1.0f;
        const glm::ivec3 p(int(random() % unsigned(nodes.x)), 1 + row % (nodes.y - 1) / 2 * 2,
                           row % nodes.z);
        if (row > 0 && p.z > 0) seeds.push_back({p, row});
      }
      EXPECT_EQ(naturalNeighbours(*device, nodes, seeds, rows, metric),
                naturalNeighbours(nodes, seeds, rows, metric));
    }
  }
}

TEST_F(CustomizationPass, RefusesWhatTheCpuRefuses) {
  const std::vector<NodeValues> rows(1);
  const std::vector<GridSeed> twice = {{{1, 2, 3}, 0}, {{1, 2, 3}, 0}};
  try {
    naturalNeighbours(*device, {4, 4, 4}, twice, rows, SeedMetric::Euclidean);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::InvalidArgument);
    EXPECT_STREQ(error.what(), "two seeds stand on node 1, 2, 3");
  }
}

}  // namespace
}  // namespace vestige
