// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/run_order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace vestige {
namespace {

constexpr int kMaxLevels = IntervalPartition::kMaxIntervals + 2;
constexpr int kMaxRuns = 96;     ///< longer walks say nothing that a mixture does not
constexpr int kRounds = 3;       ///< of fitting lengths; more does not help
constexpr int kTrialRounds = 1;  ///< ... when starts are compared
constexpr int kMaxStarts = 100;  ///< start and end pairs that are tried on one ray
/// A neighbour's start and end are taken over when they fit to this share of the chord.
constexpr double kGoodFit = 0.04;

/// The stored facts of a ray by level: the channels that occur, in order of value.
struct Levels {
  int levels = 0;
  std::array<RayInterval, kMaxLevels> at;
  double front = 0.0, back = 0.0;  ///< depth of both ends
};

/// A succession of runs and their lengths.
struct Walk {
  int runs = 0;
  std::array<int, kMaxRuns> level;
  std::array<double, kMaxRuns> length;
  double misfit = 0.0;  ///< root mean square error of the levels' mean depths, by length
};

using Crossings = std::array<int, kMaxLevels>;

/// How often the ray crosses between neighbouring levels if it starts and ends in these: a run
/// begins and ends at a crossing, but for the first and the last. False where that cannot be.
bool crossingsOf(const Levels& ray, int start, int end, Crossings& crossings) {
  int below = 0;
  for (int i = 0; i < ray.levels; ++i) {
    const int above = 2 * ray.at[std::size_t(i)].runs - below - (i == start) - (i == end);
    if (i + 1 < ray.levels ? above < 1 : above != 0) return false;
    crossings[std::size_t(i)] = below = above;
  }
  return true;
}

/// The trail through all crossings that turns as late as it can: large swings come before small
/// ones, as in anatomy and flow. Fleury's rule keeps from burning a bridge that is still needed.
void layWalk(const Levels& ray, int start, Crossings left, Walk& walk) {
  int position = start, direction = 1;
  walk.runs = 0;
  for (;;) {
    walk.level[std::size_t(walk.runs++)] = position;
    const int up = position + 1 < ray.levels ? left[std::size_t(position)] : 0;
    const int down = position > 0 ? left[std::size_t(position) - 1] : 0;
    if (up + down == 0) return;
    // A way with one crossing left is a bridge: it may be taken only when nothing remains behind.
    const bool mayUp = up > 1 || (up == 1 && down == 0);
    const bool mayDown = down > 1 || (down == 1 && up == 0);
    if (direction > 0 ? !mayUp && (mayDown || up == 0) : mayDown || up == 0) {
      direction = -1;
    } else {
      direction = 1;
    }
    if (direction > 0) {
      --left[std::size_t(position)];
      ++position;
    } else {
      --left[std::size_t(position) - 1];
      --position;
    }
    if (walk.runs == kMaxRuns) return;
  }
}

/// Lengths of the runs that give each level its length and, as nearly as can be, its mean depth:
/// from equal shares, by tilting each level's shares toward its mean depth, and by stretching what
/// lies between levels of one run, whose places are known.
void fitLengths(const Levels& ray, int rounds, Walk& walk) {
  const auto levelOf = [&](int j) { return std::size_t(walk.level[std::size_t(j)]); };
  for (int j = 0; j < walk.runs; ++j) {
    const RayInterval& level = ray.at[levelOf(j)];
    walk.length[std::size_t(j)] = double(level.length) / level.runs;
  }
  std::array<double, kMaxRuns> middle;
  std::array<double, kMaxLevels> mean, spread, sum;
  for (int round = 0;; ++round) {
    mean.fill(0.0);
    spread.fill(0.0);
    double at = ray.front;
    for (int j = 0; j < walk.runs; ++j) {
      const double length = walk.length[std::size_t(j)];
      middle[std::size_t(j)] = at + 0.5 * length;
      at += length;
      mean[levelOf(j)] += length * middle[std::size_t(j)];
    }
    for (int i = 0; i < ray.levels; ++i)
      mean[std::size_t(i)] /= double(ray.at[std::size_t(i)].length);
    if (round == rounds) break;
    for (int j = 0; j < walk.runs; ++j) {
      const double off = middle[std::size_t(j)] - mean[levelOf(j)];
      spread[levelOf(j)] += walk.length[std::size_t(j)] * off * off;
    }
    // Tilt.
    for (int j = 0; j < walk.runs; ++j) {
      const std::size_t i = levelOf(j);
      if (ray.at[i].runs < 2 || spread[i] <= 0.0) continue;
      const double wanted = double(ray.at[i].depth) - mean[i];
      const double off = middle[std::size_t(j)] - mean[i];
      walk.length[std::size_t(j)] *=
          std::clamp(1.0 + wanted * off * double(ray.at[i].length) / spread[i], 0.2, 5.0);
    }
    // Stretch between anchors.
    double from = ray.front;
    for (int j = 0; j < walk.runs;) {
      int next = j;
      double inside = 0.0;
      while (next < walk.runs && ray.at[levelOf(next)].runs > 1) {
        inside += walk.length[std::size_t(next++)];
      }
      const bool last = next == walk.runs;
      const RayInterval* anchor = last ? nullptr : &ray.at[levelOf(next)];
      const double to = last ? ray.back : double(anchor->depth) - 0.5 * double(anchor->length);
      if (inside > 0.0 && to > from) {
        for (int k = j; k < next; ++k) walk.length[std::size_t(k)] *= (to - from) / inside;
      }
      if (last) break;
      from = double(anchor->depth) + 0.5 * double(anchor->length);
      j = next + 1;
    }
    // Keep each level's length.
    sum.fill(0.0);
    for (int j = 0; j < walk.runs; ++j) sum[levelOf(j)] += walk.length[std::size_t(j)];
    for (int j = 0; j < walk.runs; ++j) {
      const std::size_t i = levelOf(j);
      if (sum[i] > 0.0) walk.length[std::size_t(j)] *= double(ray.at[i].length) / sum[i];
    }
  }
  double error = 0.0, weight = 0.0;
  for (int i = 0; i < ray.levels; ++i) {
    const double off = mean[std::size_t(i)] - double(ray.at[std::size_t(i)].depth);
    error += double(ray.at[std::size_t(i)].length) * off * off;
    weight += double(ray.at[std::size_t(i)].length);
  }
  walk.misfit = std::sqrt(error / weight);
}

/// The levels of a ray that is whole, by value.
Levels levelsOf(std::span<const RayInterval> intervals, const IntervalPartition& partition) {
  Levels ray;
  ray.levels = int(intervals.size());
  const auto key = [&](int channel) { return channel == partition.below() ? -1 : channel; };
  std::copy(intervals.begin(), intervals.end(), ray.at.begin());
  std::sort(
      ray.at.begin(), ray.at.begin() + ray.levels,
      [&](const RayInterval& a, const RayInterval& b) { return key(a.channel) < key(b.channel); });
  double length = 0.0, moment = 0.0;
  for (const RayInterval& interval : intervals) {
    length += double(interval.length);
    moment += double(interval.length) * double(interval.depth);
  }
  ray.front = moment / length - 0.5 * length;
  ray.back = ray.front + length;
  return ray;
}

/// Lays and fits the walk between two levels; false where there is none.
bool tryLevels(const Levels& ray, int start, int end, int runs, int rounds, Walk& walk) {
  walk.misfit = std::numeric_limits<double>::infinity();
  Crossings crossings;
  if (!crossingsOf(ray, start, end, crossings)) return false;
  layWalk(ray, start, crossings, walk);
  if (walk.runs != runs) return false;
  fitLengths(ray, rounds, walk);
  return true;
}

bool tryEnds(const Levels& ray, const RunOrderer::Ends& ends, int runs, int rounds, Walk& walk) {
  walk.misfit = std::numeric_limits<double>::infinity();
  int start = -1, end = -1;
  for (int i = 0; i < ray.levels; ++i) {
    if (ray.at[std::size_t(i)].channel == ends.first) start = i;
    if (ray.at[std::size_t(i)].channel == ends.last) end = i;
  }
  return start >= 0 && end >= 0 && tryLevels(ray, start, end, runs, rounds, walk);
}

/// The channels between which the walk fits best.
RunOrderer::Ends bestEnds(const Levels& ray, int runs) {
  RunOrderer::Ends best;
  double misfit = std::numeric_limits<double>::infinity();
  Walk walk;
  int tried = 0;
  for (int start = 0; start < ray.levels; ++start) {
    for (int end = 0; end < ray.levels && tried < kMaxStarts; ++end) {
      if (!tryLevels(ray, start, end, runs, kTrialRounds, walk)) continue;
      ++tried;
      if (walk.misfit >= misfit) continue;
      misfit = walk.misfit;
      best = {ray.at[std::size_t(start)].channel, ray.at[std::size_t(end)].channel};
    }
  }
  return best;
}

}  // namespace

void orderByMeanDepth(std::span<RayInterval> ray, std::vector<Piece>& pieces) {
  // Insertion sort: the lists are short, and neighbours in value are often neighbours in depth.
  for (std::size_t i = 1; i < ray.size(); ++i) {
    const RayInterval moving = ray[i];
    std::size_t j = i;
    for (; j > 0 && ray[j - 1].depth > moving.depth; --j) ray[j] = ray[j - 1];
    ray[j] = moving;
  }
  for (const RayInterval& interval : ray) {
    pieces.push_back({interval.channel, interval.length, interval.runs > 1});
  }
}

void RunOrderer::order(std::span<RayInterval> intervals, std::vector<Piece>& pieces) {
  int runs = 0;
  bool several = false;
  for (const RayInterval& interval : intervals) {
    runs += interval.runs;
    several = several || interval.runs > 1;
  }
  if (!several || runs > kMaxRuns) {
    orderByMeanDepth(intervals, pieces);
    return;
  }
  const Levels ray = levelsOf(intervals, partition_);
  Walk walk;
  // Neighbouring rays mostly start and end alike, and fit about as well.
  const double chord = ray.back - ray.front;
  if (!tryEnds(ray, ends_, runs, kRounds, walk) ||
      walk.misfit > chord * std::max(kGoodFit, 1.25 * misfit_)) {
    ends_ = bestEnds(ray, runs);
    if (!tryEnds(ray, ends_, runs, kRounds, walk)) {
      orderByMeanDepth(intervals, pieces);
      return;
    }
    misfit_ = walk.misfit / chord;
  }
  for (int j = 0; j < walk.runs; ++j) {
    const RayInterval& level = ray.at[std::size_t(walk.level[std::size_t(j)])];
    pieces.push_back({level.channel, float(walk.length[std::size_t(j)]), level.runs > 1});
  }
}

}  // namespace vestige
