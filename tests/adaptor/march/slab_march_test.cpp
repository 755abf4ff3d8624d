// SPDX-License-Identifier: BSD-3-Clause
//
// Slabs are stretches of the march: they add up to it, meet at their faces, and do not depend on
// how a domain is cut into blocks.
#include <cmath>
#include <numeric>
#include <vector>

#include "proxy/format/layout/proxy_layout.h"
#include "tests/adaptor/march/march_fixture.h"

namespace vestige {
namespace {

std::vector<double> evenDepths(const MarchRequest& request, int slabs) {
  const DepthRange range = depthRange(request.camera, request.domain);
  std::vector<double> depths;
  for (int s = 0; s <= slabs; ++s)
    depths.push_back(std::lerp(range.low, range.high, s / double(slabs)));
  return depths;
}

MarchRequest lengthsOnly(MarchRequest request) {
  request.attenuation = request.mip = request.reference = false;
  request.isovalues.clear();
  return request;
}

/// A field with flat regions, so that bricks are skipped and tiles are empty, and with a hole.
Scene flatAndHoled() {
  return Scene::even({41, 37, 33}, kUnit, [](glm::dvec3 p) {
    if (glm::length(p - glm::dvec3(0.7, 0.3, 0.6)) < 0.12) return kNaN;
    return 0.05 + std::max(0.0, 0.4 - glm::length(p - glm::dvec3(0.4, 0.5, 0.5))) * 2.0;
  });
}

TEST_P(March, SlabsAddUpToTheWholeRay) {
  for (const Scene& scene : {Scene::even({33, 29, 25}, kUnit, waves), flatAndHoled()}) {
    for (const Camera& camera :
         {frameBox(kUnit, {0, 1, 0}, {0, 0, 1}, 32.0 / 24.0), oblique(kUnit)}) {
      const MarchRequest request = lengthsOnly(requestAll(kUnit, 0.1, 0.8, 7, camera));
      const RayImage whole = marchWhole(marcher, scene, request);
      const std::size_t pixels = whole.size.pixels();
      for (int count : {1, 5}) {
        const auto depths = evenDepths(request, count);
        const auto slabs = marchSlabs(marcher, scene, request, depths, scene.whole(), 0);
        std::vector<float> length(whole.length.size());
        std::size_t hits = 0;
        for (std::size_t s = 0; s < slabs.size(); ++s) {
          ASSERT_EQ(slabs[s].cells.size(), pixels);
          for (std::size_t i = 0; i < pixels; ++i) {
            const SlabCell& cell = slabs[s].cells[i];
            const auto lengths = slabs[s].lengthsOf(cell);
            for (std::size_t k = 0; k < lengths.size(); ++k) {
              const int channel = request.partition.channelAt(cell.lowest + int(k));
              length[std::size_t(channel) * pixels + i] += lengths[k];
            }
            length[std::size_t(request.partition.noData()) * pixels + i] += cell.noData;
            if (lengths.empty()) continue;
            ++hits;
            ASSERT_GT(lengths.front(), 0.0f);
            ASSERT_GT(lengths.back(), 0.0f);
            for (const auto& [moment, own] : {std::pair{cell.lowMoment, lengths.front()},
                                              std::pair{cell.highMoment, lengths.back()}}) {
              if (own < 1e-4f) continue;
              ASSERT_GE(moment / own, depths[s] - 1e-3);
              ASSERT_LE(moment / own, depths[s + 1] + 1e-3);
            }
            // A face on a sample beside a gap is at the end of the one, at the start of the other.
            const int noData = request.partition.noData();
            const int before = s > 0 ? slabs[s - 1].cells[i].last : SlabCell::kNone;
            if (before != SlabCell::kNone && before != noData && cell.first != noData) {
              ASSERT_EQ(before, cell.first) << "a face belongs to both";
            }
          }
        }
        EXPECT_GT(hits, pixels / 4);
        EXPECT_LE(greatestDifference(length, whole.length), 1e-5);
      }
    }
  }
}

TEST_P(March, SlabsDoNotDependOnTheBlocks) {
  const Scene scene = Scene::even({33, 29, 25}, kUnit, waves);
  const MarchRequest request = lengthsOnly(requestAll(kUnit, 0.1, 0.8, 7, oblique(kUnit)));
  const auto depths = evenDepths(request, 6);
  const auto whole = marchSlabs(marcher, scene, request, depths, scene.whole(), 0);
  const Cuts cuts{{{0, 11, 32}, {0, 15, 28}, {0, 9, 24}}};
  const auto blocks = marchSlabs(marcher, scene, request, depths, cuts, 1);
  std::size_t compared = 0;
  for (std::size_t s = 0; s < whole.size(); ++s) {
    for (std::size_t i = 0; i < whole[s].cells.size(); ++i) {
      const SlabCell &a = whole[s].cells[i], &b = blocks[s].cells[i];
      for (int rank = 0; rank < request.partition.channels() - 1; ++rank) {
        const auto at = [&](const SlabRays& slab, const SlabCell& cell) {
          const auto lengths = slab.lengthsOf(cell);
          const bool there = !lengths.empty() && rank >= cell.lowest && rank <= cell.highest;
          return there ? lengths[std::size_t(rank - cell.lowest)] : 0.0f;
        };
        ASSERT_NEAR(at(whole[s], a), at(blocks[s], b), 1e-5) << s << " " << i << " " << rank;
        ++compared;
      }
      if (a.lowest != SlabCell::kNone && a.lowest == b.lowest && a.highest == b.highest) {
        ASSERT_NEAR(a.lowMoment, b.lowMoment, 1e-5);
        ASSERT_NEAR(a.highMoment, b.highMoment, 1e-5);
      }
    }
  }
  EXPECT_GT(compared, 0u);
}

TEST_P(March, PixelsThatAreNodesAreReadDirectly) {
  // A camera that is off the nodes by more than is let pass sees nearly the same.
  const Scene scene = Scene::even({24, 24, 24}, kUnit, waves);
  for (const glm::dvec3 forward : {glm::dvec3(0, 1, 0), {-1, 0, 0}, {0, 0, 1}}) {
    Camera camera = frameBox(kUnit, forward, {forward.z, 0, 1.0 - std::abs(forward.z)}, 1.0);
    camera.viewHeight = 24.0 / 23.0 * (1.0 - 1e-5);
    MarchRequest request = lengthsOnly(requestAll(kUnit, 0.1, 0.8, 7, camera, {24, 24}));
    request.stepLength = 1.0 / 23.0;
    const auto depths = evenDepths(request, 4);
    const auto direct = marchSlabs(marcher, scene, request, depths, scene.whole(), 0);
    request.camera.viewHeight *= 1.0 - 2.5e-3;
    const auto general = marchSlabs(marcher, scene, request, depths, scene.whole(), 0);
    double sum = 0.0;
    std::size_t count = 0, far = 0;
    for (std::size_t s = 0; s + 1 < depths.size(); ++s) {
      for (std::size_t i = 0; i < direct[s].cells.size(); ++i) {
        const SlabCell &a = direct[s].cells[i], &b = general[s].cells[i];
        ASSERT_NE(a.lowest, SlabCell::kNone);
        for (int rank = 0; rank < 9; ++rank) {
          const auto at = [&](const SlabRays& slab, const SlabCell& cell) {
            const bool there = rank >= cell.lowest && rank <= cell.highest;
            return there ? slab.lengthsOf(cell)[std::size_t(rank - cell.lowest)] : 0.0f;
          };
          const double difference = std::abs(at(direct[s], a) - at(general[s], b));
          sum += difference;
          far += difference > 0.02;  // where a ray grazes a bound
          count += at(direct[s], a) > 0.0f;
        }
      }
    }
    EXPECT_LT(sum / double(count), 3e-3) << forward.x << forward.y << forward.z;
    EXPECT_LT(double(far), 0.02 * double(count));
  }
}

TEST_P(March, PassingOverBricksChangesNoSlab) {
  const Scene scene = flatAndHoled();
  MarchRequest request = lengthsOnly(requestAll(kUnit, 0.1, 0.8, 7, oblique(kUnit), {64, 48}));
  const auto depths = evenDepths(request, 4);
  const auto passed = marchSlabs(marcher, scene, request, depths, scene.whole(), 0);
  request.skipEmptySpace = false;
  const auto plain = marchSlabs(marcher, scene, request, depths, scene.whole(), 0);
  for (std::size_t s = 0; s < plain.size(); ++s) {
    EXPECT_LE(greatestDifference(passed[s].lengths, plain[s].lengths), 2e-6);
    for (std::size_t i = 0; i < plain[s].cells.size(); ++i) {
      ASSERT_EQ(passed[s].cells[i].first, plain[s].cells[i].first);
      ASSERT_EQ(passed[s].cells[i].last, plain[s].cells[i].last);
      ASSERT_EQ(passed[s].cells[i].lowest, plain[s].cells[i].lowest);
    }
  }
}

}  // namespace
}  // namespace vestige
