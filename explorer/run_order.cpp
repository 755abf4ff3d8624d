// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/run_order.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace vestige {
namespace {

constexpr int kMostChannels = IntervalPartition::kMaxIntervals + 2;
constexpr int kSlabs = 6;       ///< more add less than 0.1 dB
constexpr int kIterations = 3;  ///< of the entropy fit; more add less than 0.1 dB
constexpr int kMostCuts = kSlabs + 2 * kMostChannels + 1;
constexpr float kLeastShare = 0.03f;  ///< of a channel's length, for a piece of its own

/// 2^x to 1e-4, without a branch, so that loops over channels become vector code.
inline float exp2Roughly(float x) {
  const float clamped = std::max(x, -120.0f);
  const auto whole = std::int32_t(clamped + 128.0f) - 128;  // floor: the sum is positive
  const float f = clamped - float(whole);
  const float mantissa =
      1.0f + f * (0.69304753f + f * (0.24130380f + f * (0.05203285f + f * 0.01361582f)));
  return mantissa * std::bit_cast<float>((whole + 127) << 23);
}

/// log2(x) to 1e-2 for x > 0: good enough to start from, as every step corrects the last.
inline float log2Roughly(float x) {
  const auto bits = std::bit_cast<std::int32_t>(x);
  const float m = std::bit_cast<float>((bits & 0x7fffff) | 0x3f800000);
  return float((bits >> 23) - 127) - 1.6491321f + m * (1.9950470f - 0.3369148f * m);
}

/// Below, the intervals, above: their order along the value axis.
int levelOf(int channel, const IntervalPartition& partition) {
  return channel == partition.below() ? -1 : channel;  // above is L + 1, beyond L - 1 already
}

/// A ray whose channels are sorted by level, and what becomes of it. Depths are measured from the
/// entry in units of the chord.
class RayModel {
 public:
  RayModel(std::span<RayInterval> ray, const RayEnds& ends, const IntervalPartition& partition)
      : ray_(ray), ends_(ends), partition_(partition), count_(int(ray.size())) {}

  /// False when there is no chord to speak of.
  bool measure() {
    double length = 0.0, moment = 0.0;
    for (const RayInterval& interval : ray_) {
      length += interval.length;
      moment += double(interval.length) * interval.depth;
    }
    if (!(length > 0.0)) return false;
    chord_ = length;
    const double planar = length * ends_.depthPerLength;
    const double entry = moment / length - 0.5 * planar;
    // No data stands outside the order of values: it fills its share, but is no neighbour.
    const auto sorted = std::partition(ray_.begin(), ray_.end(), [&](const RayInterval& i) {
      return i.channel != partition_.noData();
    });
    valued_ = int(sorted - ray_.begin());
    std::sort(ray_.begin(), sorted, [&](const RayInterval& a, const RayInterval& b) {
      return levelOf(a.channel, partition_) < levelOf(b.channel, partition_);
    });
    for (int i = 0; i < count_; ++i) {
      share_[i] = float(ray_[i].length / chord_);
      mean_[i] = std::clamp(float((ray_[i].depth - entry) / planar), 0.0f, 1.0f);
    }
    return true;
  }

  void cut() {
    cuts_[0] = 0.0f;
    cutCount_ = 1;
    for (int i = 1; i < kSlabs; ++i) addCut(float(i) / kSlabs);
    findCrossings();
    addCut(1.0f);
    std::sort(cuts_.begin(), cuts_.begin() + cutCount_);
    slabs_ = 0;
    for (int i = 1; i < cutCount_; ++i) {
      if (cuts_[i] - cuts_[slabs_] < 1e-5f) continue;
      cuts_[++slabs_] = cuts_[i];
    }
    boundSlabs();
  }

  void fit() {
    for (int i = 0; i < count_; ++i) {
      height_[i] = log2Roughly(share_[i]);
      slope_[i] = 0.0f;
    }
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      evaluate();
      improve();
    }
    evaluate();
    keepLengths();
  }

  void emit(std::vector<Piece>& pieces) const {
    const std::size_t emitted = pieces.size();
    for (int slab = 0; slab < slabs_; ++slab) {
      const std::size_t begin = pieces.size();
      const bool open = low_[slab] != high_[slab];
      for (int i = low_[slab]; i <= high_[slab]; ++i) {
        const float amount = weight(slab, i) * float(chord_);
        if (!(amount > 0.0f) || ray_[i].channel == partition_.noData()) continue;
        if (!open && joins(pieces, emitted, ray_[i].channel)) {
          pieces.back().amount += amount;
          continue;
        }
        pieces.push_back({ray_[i].channel, amount, open, open});
      }
      if (pieces.size() > begin) pieces.back().mixed = false;
    }
  }

 private:
  /// Whether the ray is in this channel already, and in no other.
  static bool joins(const std::vector<Piece>& pieces, std::size_t emitted, int channel) {
    return pieces.size() > emitted && pieces.back().channel == channel && !pieces.back().ambiguous;
  }

  float weight(int slab, int i) const { return weights_[std::size_t(slab * count_ + i)]; }

  int levelIndex(int channel) const {
    for (int i = 0; i < valued_; ++i) {
      if (ray_[i].channel == channel) return i;
    }
    return -1;
  }

  void addCut(float depth) {
    if (depth > 0.0f && depth <= 1.0f) cuts_[cutCount_++] = depth;
  }

  /// The superlevel set above ray_[index] is [from, to), or its complement.
  struct Crossing {
    int index;
    float from, to;
    bool above;
  };

  /// Step 1. Every run has two ends, each at a neighbour or at an end of the ray: with the counts
  /// of crossings c between neighbours, c_{i-1} + c_i = 2 runs_i - [first = i] - [last = i].
  void findCrossings() {
    crossingCount_ = 0;
    const int first = levelIndex(ends_.first), last = levelIndex(ends_.last);
    if (first < 0 || last < 0 || valued_ != count_) return;
    // A run too short to be stored breaks the chain; then trust it from either end up to there.
    std::array<int, kMostChannels + 1> crossings;
    crossings.fill(-1);
    const auto ended = [&](int i) { return (first == i) + (last == i); };
    const auto possible = [&](int i, int c) {
      const bool odd = (first <= i) != (last <= i);
      return c >= 1 && (c % 2 == 1) == odd && adjacent(i);
    };
    int c = 0;
    for (int i = 0; i + 1 < valued_; ++i) {
      c = 2 * ray_[i].runs - ended(i) - c;
      if (!possible(i, c)) break;
      crossings[i] = c;
    }
    c = 0;
    for (int i = valued_ - 1; i > 0; --i) {
      c = 2 * ray_[i].runs - ended(i) - c;
      if (!possible(i - 1, c)) break;
      if (crossings[i - 1] < 0) crossings[i - 1] = c;
    }
    float share = 0.0f, moment = 0.0f, whole = 0.0f, wholeMoment = 0.0f;
    for (int i = 0; i < valued_; ++i) {
      whole += share_[i];
      wholeMoment += share_[i] * mean_[i];
    }
    for (int i = 0; i + 1 < valued_; ++i) {
      share += share_[i];
      moment += share_[i] * mean_[i];
      locate(i, crossings[i], first <= i, share, moment, whole - share, wholeMoment - moment);
    }
  }

  bool adjacent(int i) const {
    const int below = levelOf(ray_[i].channel, partition_);
    const int above = levelOf(ray_[i + 1].channel, partition_);
    return above - below == 1 || ray_[i + 1].channel == partition_.above();
  }

  void locate(int i, int crossings, bool entersBelow, float below, float belowMoment, float above,
              float aboveMoment) {
    Crossing found{i, 0.0f, 1.0f, true};
    if (crossings == 1) {
      if (entersBelow)
        found.from = below;
      else
        found.to = above;
    } else if (crossings == 2) {  // one side of the bound is a single stretch
      const float length = entersBelow ? above : below;
      const float middle = entersBelow ? aboveMoment / above : belowMoment / below;
      found.from = middle - 0.5f * length;
      found.to = middle + 0.5f * length;
      found.above = entersBelow;
    } else {
      return;
    }
    crossing_[std::size_t(crossingCount_++)] = found;
    addCut(found.from);
    addCut(found.to);
  }

  /// The range of channels of each slab: an interval of indices, as bounds are nested.
  void boundSlabs() {
    for (int slab = 0; slab < slabs_; ++slab) {
      const float middle = 0.5f * (cuts_[slab] + cuts_[slab + 1]);
      int low = 0, high = count_ - 1;
      for (int c = 0; c < crossingCount_; ++c) {
        const Crossing& crossing = crossing_[std::size_t(c)];
        const bool inside = middle >= crossing.from && middle < crossing.to;
        if (inside == crossing.above)
          low = std::max(low, crossing.index + 1);
        else
          high = std::min(high, crossing.index);
      }
      const bool consistent = low <= high;  // rounding can make a sliver contradict itself
      low_[slab] = consistent ? low : 0;
      high_[slab] = consistent ? high : count_ - 1;
    }
    weights_.assign(std::size_t(slabs_ * count_), 0.0f);
  }

  /// Step 2. The distribution of largest entropy is p_i(z) = 2^(h_i + s_i z) / Σ_j 2^(h_j + s_j z).
  void evaluate() {
    std::array<float, kMostChannels + 1> value;
    for (int slab = 0; slab < slabs_; ++slab) {
      const int low = low_[slab], high = high_[slab];
      float* out = &weights_[std::size_t(slab * count_)];
      const float thickness = cuts_[slab + 1] - cuts_[slab];
      if (low == high) {
        out[low] = thickness;
        continue;
      }
      const float z = 0.5f * (cuts_[slab] + cuts_[slab + 1]) - 0.5f;
      float greatest = -1e30f;
      for (int i = low; i <= high; ++i) {
        value[i] = height_[i] + slope_[i] * z;
        greatest = std::max(greatest, value[i]);
      }
      float sum = 0.0f;
      for (int i = low; i <= high; ++i) value[i] = exp2Roughly(value[i] - greatest);
      for (int i = low; i <= high; ++i) sum += value[i];
      const float scale = thickness / sum;
      for (int i = low; i <= high; ++i) out[i] = scale * value[i];
    }
  }

  /// A Newton step on the slope and a scaling of the height of each channel by itself.
  void improve() {
    std::array<float, kMostChannels + 1> sum{}, first{}, second{};
    for (int slab = 0; slab < slabs_; ++slab) {
      const float z = 0.5f * (cuts_[slab] + cuts_[slab + 1]) - 0.5f;
      const float* in = &weights_[std::size_t(slab * count_)];
      for (int i = low_[slab]; i <= high_[slab]; ++i) {
        sum[i] += in[i];
        first[i] += in[i] * z;
        second[i] += in[i] * z * z;
      }
    }
    constexpr float kPerLog2 = 1.442695f;
    for (int i = 0; i < count_; ++i) {
      if (!(sum[i] > 1e-20f)) continue;
      const float mean = first[i] / sum[i];
      const float variance = std::max(second[i] / sum[i] - mean * mean, 1e-4f);
      const float step = kPerLog2 * std::clamp((mean_[i] - 0.5f - mean) / variance, -20.0f, 20.0f);
      slope_[i] = std::clamp(slope_[i] + step, -500.0f, 500.0f);
      height_[i] += log2Roughly(share_[i] / sum[i]) - step * mean;
      height_[i] = std::clamp(height_[i], -400.0f, 400.0f);
    }
  }

  /// Lengths are known exactly and shall stay so: scale them, and gather what is too little for a
  /// piece of its own into the channel's next slab.
  void keepLengths() {
    for (int i = 0; i < count_; ++i) {
      float sum = 0.0f, carried = 0.0f;
      int heaviest = -1;
      for (int slab = 0; slab < slabs_; ++slab) {
        float& w = weights_[std::size_t(slab * count_ + i)];
        sum += w;
        if (w > 0.0f && (heaviest < 0 || w > weight(heaviest, i))) heaviest = slab;
      }
      if (heaviest < 0) {  // squeezed out by the cuts: where its mean says
        heaviest = 0;
        while (heaviest + 1 < slabs_ && cuts_[heaviest + 1] <= mean_[i]) ++heaviest;
        low_[heaviest] = std::min(low_[heaviest], i);
        high_[heaviest] = std::max(high_[heaviest], i);
        weights_[std::size_t(heaviest * count_ + i)] = share_[i];
        continue;
      }
      const float scale = share_[i] / sum;
      int latest = heaviest;
      for (int slab = 0; slab < slabs_; ++slab) {
        float& w = weights_[std::size_t(slab * count_ + i)];
        if (low_[slab] == high_[slab]) {  // known, not shared: nothing to gather
          w *= scale;
          continue;
        }
        carried += w * scale;
        w = 0.0f;
        if (carried < kLeastShare * share_[i]) continue;
        w = carried;
        carried = 0.0f;
        latest = slab;
      }
      weights_[std::size_t(latest * count_ + i)] += carried;
    }
  }

  std::span<RayInterval> ray_;
  RayEnds ends_;
  const IntervalPartition& partition_;
  int count_, valued_ = 0;
  double chord_ = 0.0;
  std::array<float, kMostChannels + 1> share_, mean_, height_, slope_;
  int cutCount_ = 0, crossingCount_ = 0, slabs_ = 0;
  std::array<float, kMostCuts + 1> cuts_;
  std::array<Crossing, kMostChannels> crossing_;
  std::array<int, kMostCuts> low_, high_;
  static thread_local std::vector<float> weights_;  ///< [slab][channel], in chords
};

thread_local std::vector<float> RayModel::weights_;

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

void orderByRuns(std::span<RayInterval> ray, const RayEnds& ends,
                 const IntervalPartition& partition, std::vector<Piece>& pieces) {
  if (std::all_of(ray.begin(), ray.end(), [](const RayInterval& i) { return i.runs <= 1; })) {
    const auto valued = std::partition(ray.begin(), ray.end(), [&](const RayInterval& i) {
      return i.channel != partition.noData();
    });
    orderByMeanDepth({ray.begin(), valued}, pieces);
    return;
  }
  RayModel model(ray, ends, partition);
  if (!model.measure()) return;
  model.cut();
  model.fit();
  model.emit(pieces);
}

}  // namespace vestige
