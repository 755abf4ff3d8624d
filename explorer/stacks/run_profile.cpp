// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/stacks/run_profile.h"

#include <algorithm>
#include <cmath>

namespace vestige {
namespace {

/// On its way to a turn a field that crossed an interval with mean slope s has this share of it
/// left at the bound; measured on CT, turbulent and smooth fields alike.
constexpr float kSlowing = 0.9f;
/// Runs that turn on both sides of a bound say nothing of the slope but that neither is crossed:
/// mean widths per the length of both.
constexpr float kWiggle = 3.0f;
/// A turn's estimated height is believed up to here; from kFirstDoubt on less and less.
constexpr float kHighest = 0.95f;
constexpr float kFirstDoubt = 1.0f;
constexpr float kLastDoubt = 2.5f;
/// Where a plateau lies from the bound it is reached from when the histogram does not say.
constexpr float kPlateau = 0.6f;

/// A plateau that is reached from slope d at a parabola's end takes 2 |rise| / |d|.
void setPlateau(ProfileSegment& segment, float plateau) {
  const auto share = [&](float bound, float slope) {
    const float rise = std::abs(plateau - bound);
    return rise > 0.0f && slope != 0.0f ? std::min(2.0f * rise / std::abs(slope), 1.0f) : 0.0f;
  };
  segment.plateau = plateau;
  segment.t0 = share(segment.y0, segment.d0);
  segment.t1 = share(segment.y1, segment.d1);
  const float both = segment.t0 + segment.t1;
  if (both > 1.0f) {
    segment.t0 /= both;
    segment.t1 /= both;
  }
}

enum class Shape { Rising, Falling, Turning, Open, Gap };

}  // namespace

void RunProfile::findPeaks(const IntervalPartition& partition, const FieldStatistics& statistics) {
  const auto& bins = statistics.histogram;
  const double width =
      (statistics.high - statistics.low) / double(std::max<std::size_t>(bins.size(), 1));
  if (!(width > 0.0)) return;
  constexpr int kLeastBins = 6;
  for (int k = 0; k < partition.intervals(); ++k) {
    const auto r = std::size_t(k) + 1;
    double sum = 0.0, squares = 0.0, moment = 0.0;
    int count = 0;
    for (std::size_t b = 0; b < bins.size(); ++b) {
      const double y = (statistics.low + (double(b) + 0.5) * width - low_[r]) / width_[r];
      if (!(y >= 0.0 && y <= 1.0)) continue;
      const double n = double(bins[b]);
      ++count;
      sum += n;
      squares += n * n;
      moment += n * n * y;
    }
    if (count < kLeastBins || !(sum > 0.0)) continue;
    // 1 for an even distribution, the number of bins for a single peak.
    const double concentration = squares * count / (sum * sum);
    peak_[r] = {float(moment / squares), float(std::clamp(concentration - 1.0, 0.0, 1.0))};
  }
}

/// `bound`: 0 or 1, where the run was entered; `guess`: distance from there.
float RunProfile::plateauOf(int rank, float bound, float guess) const {
  const float own = bound == 0.0f ? guess : 1.0f - guess;
  const Peak& peak = peak_[std::size_t(rank)];
  return own + peak.weight * (peak.y - own);
}

RunProfile::RunProfile(const IntervalPartition& partition, const FieldStatistics& statistics)
    : noData_(partition.rankOf(partition.noData())) {
  const auto bounds = partition.bounds();
  const int intervals = partition.intervals();
  const double mean = (partition.high() - partition.low()) / intervals;
  for (int k = 0; k < intervals; ++k) {
    low_[std::size_t(k) + 1] = bounds[std::size_t(k)];
    width_[std::size_t(k) + 1] = bounds[std::size_t(k) + 1] - bounds[std::size_t(k)];
  }
  const auto last = std::size_t(intervals);
  width_[0] = width_[1];
  low_[0] = low_[1] - width_[0];
  width_[last + 1] = width_[last];
  low_[last + 1] = bounds[last];
  for (std::size_t r = 0; r < relative_.size(); ++r) {
    relative_[r] = mean > 0.0 ? float(width_[r] / mean) : 1.0f;
  }
  findPeaks(partition, statistics);
}

const std::vector<ProfileSegment>& RunProfile::of(const RunLists& runs, std::size_t pixel) {
  const std::size_t begin = runs.first[pixel], end = runs.first[pixel + 1];
  const std::size_t count = end - begin;
  segments_.resize(count);
  slope_.assign(count + 1, 0.0f);
  const auto rank = [&](std::size_t i) { return runs.rankAt(begin + i); };
  // Which way each run goes; slopes of those that cross their interval.
  const auto shapeOf = [&](std::size_t i) {
    const int own = rank(i);
    if (own == noData_) return Shape::Gap;
    if (i == 0 || i + 1 == count) return Shape::Open;
    const int before = rank(i - 1), after = rank(i + 1);
    if (before == noData_ || after == noData_) return Shape::Open;
    return (before < own) == (after < own) ? Shape::Turning
           : before < own                  ? Shape::Rising
                                           : Shape::Falling;
  };
  const auto crossing = [](Shape s) { return s == Shape::Rising || s == Shape::Falling; };
  const auto steepness = [&](std::size_t i) {
    return relative_[std::size_t(rank(i))] / std::max(runs.length[begin + i], 1e-30f);
  };
  Shape left = count > 0 ? shapeOf(0) : Shape::Gap;
  for (std::size_t knot = 1; knot < count; ++knot) {
    const Shape right = shapeOf(knot);
    const std::size_t a = knot - 1, b = knot;
    if (left != Shape::Gap && right != Shape::Gap) {
      const float sign = rank(b) > rank(a) ? 1.0f : -1.0f;
      const float la = runs.length[begin + a], lb = runs.length[begin + b];
      float slope = 0.0f;
      if (crossing(left) && crossing(right)) {
        const float sa = steepness(a), sb = steepness(b);
        slope = 3.0f * (la + lb) / ((2.0f * lb + la) / sa + (lb + 2.0f * la) / sb);
      } else if (crossing(left)) {
        slope = kSlowing * steepness(a);
      } else if (crossing(right)) {
        slope = kSlowing * steepness(b);
      } else {
        slope = kWiggle / std::max(la + lb, 1e-30f);
      }
      slope_[knot] = sign * slope;
    }
    left = right;
  }
  for (std::size_t i = 0; i < count; ++i) {
    ProfileSegment& segment = segments_[i];
    segment = {rank(i), runs.length[begin + i], 0.0f, 0.0f, 0.0f, 0.0f};
    if (segment.rank == noData_) continue;
    const float scale = segment.length / relative_[std::size_t(segment.rank)];
    const float in = slope_[i] * scale, out = slope_[i + 1] * scale;
    const bool comes = i > 0 && rank(i - 1) != noData_;
    const bool goes = i + 1 < count && rank(i + 1) != noData_;
    if (comes) segment.y0 = rank(i - 1) < segment.rank ? 0.0f : 1.0f;
    if (goes) segment.y1 = rank(i + 1) < segment.rank ? 0.0f : 1.0f;
    if (comes && goes) {
      segment.d0 = in;
      segment.d1 = out;
      if (segment.y0 == segment.y1) {
        // Height of the cubic between equal ends, about (d0 - d1) / 8.
        const float height = 0.125f * std::abs(in - out);
        if (height > kFirstDoubt) {
          const float doubt = std::min((height - kFirstDoubt) / (kLastDoubt - kFirstDoubt), 1.0f);
          const float guess = kHighest + doubt * (kPlateau - kHighest);
          const float likely = plateauOf(segment.rank, segment.y0, guess);
          const float usual = segment.y0 == 0.0f ? guess : 1.0f - guess;
          setPlateau(segment, usual + doubt * (likely - usual));
        } else if (height > kHighest) {
          segment.d0 *= kHighest / height;
          segment.d1 *= kHighest / height;
        }
      }
    } else if (comes || goes) {
      // One end is open: straight on with the slope there, or to a plateau.
      const float bound = comes ? segment.y0 : segment.y1;
      const float reach = std::abs(comes ? in : out);
      const float plateau = plateauOf(segment.rank, bound, kPlateau);
      if (reach < std::abs(plateau - bound)) {
        (comes ? segment.y1 : segment.y0) = bound == 0.0f ? reach : 1.0f - reach;
        segment.d0 = segment.d1 = segment.y1 - segment.y0;
      } else {
        (comes ? segment.y1 : segment.y0) = plateau;
        segment.d0 = comes ? in : 0.0f;
        segment.d1 = goes ? out : 0.0f;
        setPlateau(segment, plateau);
      }
    } else {
      const Peak& peak = peak_[std::size_t(segment.rank)];
      segment.y0 = segment.y1 = 0.5f + peak.weight * (peak.y - 0.5f);
    }
  }
  return segments_;
}

}  // namespace vestige
