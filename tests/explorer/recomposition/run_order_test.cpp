// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/recomposition/run_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace vestige {
namespace {

const auto kPartition = IntervalPartition::uniform(0.0, 1.0, 8);
constexpr double kEntry = 3.0;

/// What is stored of a ray that runs through these channels for these lengths.
struct Stored {
  std::vector<RayInterval> intervals;
  RayEnds ends;
};

Stored stored(const std::vector<Segment>& truth) {
  Stored ray;
  ray.ends.first = truth.front().channel;
  ray.ends.last = truth.back().channel;
  double at = kEntry;
  std::vector<double> length(16), moment(16);
  std::vector<int> runs(16);
  for (const Segment& segment : truth) {
    const auto k = std::size_t(segment.channel);
    length[k] += segment.amount;
    moment[k] += segment.amount * (at + 0.5 * segment.amount);
    ++runs[k];
    at += segment.amount;
  }
  for (int k = 0; k < kPartition.channels(); ++k) {
    const auto i = std::size_t(k);
    if (runs[i])
      ray.intervals.push_back({k, float(length[i]), float(moment[i] / length[i]), runs[i]});
  }
  return ray;
}

std::vector<Segment> ordered(Stored ray) {
  std::vector<Segment> segments;
  orderByRuns(ray.intervals, ray.ends, kPartition, segments);
  return segments;
}

void expectSame(const std::vector<Segment>& a, const std::vector<Segment>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].channel, b[i].channel) << "segment " << i;
    EXPECT_NEAR(a[i].amount, b[i].amount, 1e-4) << "segment " << i;
    EXPECT_FALSE(a[i].ambiguous) << "segment " << i;
  }
}

/// A continuous ray: a walk over neighbouring channels with random lengths.
std::vector<Segment> randomWalk(std::uint64_t seed, int runs) {
  std::mt19937_64 bits(seed);
  std::vector<Segment> truth;
  int k = int(bits() % 8);
  for (int i = 0; i < runs; ++i) {
    truth.push_back({k, float(0.05 + double(bits() % 1000) / 1000.0)});
    k = k == 0 ? 1 : k == 7 ? 6 : k + (bits() % 2 ? 1 : -1);
  }
  return truth;
}

TEST(RunOrder, IsExactOnAMonotoneRay) {
  const std::vector<Segment> truth{{6, 0.4f}, {5, 0.1f}, {4, 0.9f}, {3, 0.2f}};
  expectSame(ordered(stored(truth)), truth);
}

TEST(RunOrder, IsExactThroughOneHumpWithinAnother) {
  const std::vector<Segment> truth{{0, 0.4f}, {1, 0.1f}, {2, 0.3f}, {3, 0.2f},
                                   {2, 0.5f}, {1, 0.7f}, {0, 0.25f}};
  expectSame(ordered(stored(truth)), truth);
}

TEST(RunOrder, IsExactThroughADipFromChannelToChannel) {
  const std::vector<Segment> truth{{5, 0.4f}, {4, 0.1f}, {3, 0.3f},
                                   {4, 0.2f}, {5, 0.5f}, {6, 0.7f}};
  expectSame(ordered(stored(truth)), truth);
}

TEST(RunOrder, KnowsWhatIsCertainBesideWhatIsNot) {
  // 0 | 1 2 1 2 1 2 | 0: where the wiggle between 1 and 2 lies is known, its runs are not.
  const std::vector<Segment> truth{{0, 0.5f}, {1, 0.1f}, {2, 0.1f}, {1, 0.1f},
                                   {2, 0.1f}, {1, 0.1f}, {0, 0.3f}};
  const auto segments = ordered(stored(truth));
  EXPECT_EQ(segments.front().channel, 0);
  EXPECT_NEAR(segments.front().amount, 0.5, 1e-4);
  EXPECT_FALSE(segments.front().ambiguous);
  EXPECT_EQ(segments.back().channel, 0);
  EXPECT_NEAR(segments.back().amount, 0.3, 1e-4);
  for (std::size_t i = 1; i + 1 < segments.size(); ++i) EXPECT_TRUE(segments[i].ambiguous);
}

TEST(RunOrder, KeepsEveryLength) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Stored ray = stored(randomWalk(seed, 30));
    for (const bool ends : {true, false}) {
      Stored known = ray;
      if (!ends) known.ends = {};
      const auto segments = ordered(known);
      for (const RayInterval& interval : ray.intervals) {
        double length = 0.0;
        for (const Segment& segment : segments) {
          if (segment.channel == interval.channel) length += segment.amount;
        }
        ASSERT_NEAR(length, interval.length, 1e-4 * interval.length) << "seed " << seed;
      }
      ASSERT_FALSE(segments.back().mixed) << "a mixture ends with the ray at the latest";
    }
  }
}

TEST(RunOrder, KeepsMeanDepthsNearly) {
  double worst = 0.0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Stored ray = stored(randomWalk(seed, 30));
    std::vector<double> moment(16), length(16);
    double at = kEntry, chord = 0.0;
    const auto segments = ordered(ray);
    for (std::size_t begin = 0; begin < segments.size();) {
      std::size_t end = begin;
      double stretch = segments[end].amount;
      while (segments[end].mixed) stretch += segments[++end].amount;
      for (; begin <= end; ++begin) {
        length[std::size_t(segments[begin].channel)] += segments[begin].amount;
        moment[std::size_t(segments[begin].channel)] +=
            segments[begin].amount * (at + 0.5 * stretch);
      }
      at += stretch;
      chord += stretch;
    }
    double error = 0.0;
    for (const RayInterval& interval : ray.intervals) {
      const auto k = std::size_t(interval.channel);
      const double off = moment[k] / length[k] - interval.depth;
      error += off * off * interval.length;
    }
    worst = std::max(worst, std::sqrt(error / chord) / chord);
  }
  EXPECT_LT(worst, 0.05) << "of the chord, root mean square over its length";
}

TEST(RunOrder, LeavesNoDataOutButRoomForIt) {
  const int hole = kPartition.noData();
  const std::vector<Segment> truth{{2, 0.5f}, {3, 0.2f}, {hole, 0.4f}, {3, 0.3f}, {2, 0.1f}};
  const auto segments = ordered(stored(truth));
  double length = 0.0;
  for (const Segment& segment : segments) {
    EXPECT_NE(segment.channel, hole);
    length += segment.amount;
  }
  EXPECT_NEAR(length, 1.1, 1e-4);
}

TEST(RunOrder, SurvivesFactsThatContradictEachOther) {
  // Run counts and ends that no continuous ray has, lengths of nothing, depths from elsewhere.
  Stored ray{{{0, 1e-8f, 3.0f, 3}, {3, 0.5f, 90.0f, 2}, {4, 0.5f, -7.0f, 2047}}, {4, 0, 1.0f}};
  for (const Segment& segment : ordered(ray)) EXPECT_TRUE(std::isfinite(segment.amount));
  Stored empty{{}, {}};
  EXPECT_TRUE(ordered(empty).empty());
}

}  // namespace
}  // namespace vestige
