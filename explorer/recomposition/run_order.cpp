// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/recomposition/run_order.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace vestige {
namespace {

// Vectors are inlined everywhere: no ABI is at stake.
#pragma GCC diagnostic ignored "-Wpsabi"

constexpr int kMostChannels = IntervalPartition::kMaxIntervals + 3;
constexpr int kSlabs = 6;       ///< a chord of open order; more add less than 0.1 dB
constexpr int kIterations = 3;  ///< of the entropy fit; more add less than 0.1 dB
constexpr int kMostStretches = 2 * kMostChannels + 1;
constexpr int kMostSlabs = kMostStretches + kSlabs;
constexpr float kLeastShare = 0.03f;  ///< of a channel's length, for a segment of its own

/// Channels side by side, eight at a time.
constexpr int kLanes = 8;
using Lanes = float __attribute__((vector_size(4 * kLanes)));
using Ints = std::int32_t __attribute__((vector_size(4 * kLanes)));

inline Lanes clamped(const Lanes& x, float low, float high) {
  const Lanes raised = x > low ? x : Lanes{} + low;
  return raised < high ? raised : Lanes{} + high;
}

/// 2^x to 1e-4 for x < 127.
inline Lanes exp2Roughly(const Lanes& x) {
  const Lanes bounded = x > -120.0f ? x : Lanes{} - 120.0f;
  const Ints whole = __builtin_convertvector(bounded + 128.0f, Ints) - 128;  // floor: sum positive
  const Lanes f = bounded - __builtin_convertvector(whole, Lanes);
  const Lanes mantissa =
      1.0f + f * (0.69304753f + f * (0.24130380f + f * (0.05203285f + f * 0.01361582f)));
  return mantissa * std::bit_cast<Lanes>((whole + 127) << 23);
}

/// log2(x) to 1e-2 for x > 0: good enough to start from, as every step corrects the last.
inline Lanes log2Roughly(const Lanes& x) {
  const Ints bits = std::bit_cast<Ints>(x);
  const Lanes m = std::bit_cast<Lanes>((bits & 0x7fffff) | 0x3f800000);
  return __builtin_convertvector((bits >> 23) - 127, Lanes) - 1.6491321f +
         m * (1.9950470f - 0.3369148f * m);
}

inline Lanes swapped(const Lanes& v, const Ints& order) { return __builtin_shuffle(v, order); }
inline float sumOf(const Lanes& v) {
  const Lanes a = v + swapped(v, Ints{4, 5, 6, 7, 0, 1, 2, 3});
  const Lanes b = a + swapped(a, Ints{2, 3, 0, 1, 6, 7, 4, 5});
  return b[0] + b[1];
}
inline float greatestOf(const Lanes& v) {
  const Lanes u = swapped(v, Ints{4, 5, 6, 7, 0, 1, 2, 3});
  const Lanes a = v > u ? v : u;
  const Lanes w = swapped(a, Ints{2, 3, 0, 1, 6, 7, 4, 5});
  const Lanes b = a > w ? a : w;
  return std::max(b[0], b[1]);
}

/// Below, the intervals, above: their order along the value axis.
int levelOf(int channel, const IntervalPartition& partition) {
  return channel == partition.below() ? -1 : channel;  // above is L + 1, beyond L - 1 already
}

/// A ray whose channels are sorted by level, and what becomes of it. Depths are measured from the
/// entry in units of the chord. Holds up to kWidth * kLanes channels.
template <int kWidth>
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
    const auto lower = [&](const RayInterval& a, const RayInterval& b) {
      return levelOf(a.channel, partition_) < levelOf(b.channel, partition_);
    };
    if (!std::is_sorted(ray_.begin(), sorted, lower)) std::sort(ray_.begin(), sorted, lower);
    const double perChord = 1.0 / chord_, perPlanar = 1.0 / planar;
    for (int i = 0; i < count_; ++i) {
      at(share_, i) = float(ray_[i].length * perChord);
      at(mean_, i) = std::clamp(float((ray_[i].depth - entry) * perPlanar), 0.0f, 1.0f);
    }
    return true;
  }

  void cut() {
    cuts_[0] = 0.0f;
    cutCount_ = 1;
    findCrossings();
    addCut(1.0f);
    std::sort(cuts_.begin(), cuts_.begin() + cutCount_);
    slabs_ = 0;
    float from = 0.0f;
    for (int i = 1; i < cutCount_; ++i) {
      if (cuts_[i] - from < 1e-5f) continue;
      addStretch(from, cuts_[i]);
      from = cuts_[i];
    }
  }

  void fit() {
    for (int v = 0; v < kWidth; ++v) {
      height_[v] = log2Roughly(share_[v]);
      slope_[v] = Lanes{};
    }
    closedSums();
    for (int iteration = 0; iteration < kIterations; ++iteration) improve();
    spread();
    keepLengths();
  }

  void emit(std::vector<Segment>& segments) const {
    const std::size_t emitted = segments.size();
    for (int s = 0; s < slabs_; ++s) {
      const Slab& slab = slab_[s];
      if (!slab.open()) {
        emitClosed(slab, emitted, segments);
        continue;
      }
      const std::size_t begin = segments.size();
      for (int i = slab.low; i <= slab.high; ++i) {
        const float amount = at(slab.weights, i) * float(chord_);
        if (!(amount > 0.0f) || ray_[i].channel == partition_.noData()) continue;
        segments.push_back({ray_[i].channel, amount, true, true});
      }
      if (segments.size() > begin) segments.back().mixed = false;
    }
  }

 private:
  using Row = std::array<Lanes, kWidth>;  ///< one number a channel

  struct Slab {
    float from, to;
    int low, high;  ///< the channels that it may hold
    Row weights;    ///< in chords; of open slabs
    bool open() const { return low != high; }
    float thickness() const { return to - from; }
    float middle() const { return 0.5f * (from + to); }
  };

  static float at(const Row& row, int i) { return row[i / kLanes][i % kLanes]; }
  /// A reference to an element, which vectors do not give.
  struct Element {
    Lanes& lanes;
    int lane;
    void operator=(float value) { lanes[lane] = value; }
    operator float() const { return lanes[lane]; }
  };
  static Element at(Row& row, int i) { return {row[i / kLanes], i % kLanes}; }

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
    std::array<int, kMostChannels> crossings;
    std::fill_n(crossings.begin(), valued_, -1);
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
      whole += at(share_, i);
      wholeMoment += at(share_, i) * at(mean_, i);
    }
    for (int i = 0; i + 1 < valued_; ++i) {
      share += at(share_, i);
      moment += at(share_, i) * at(mean_, i);
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

  /// Between two cuts the channels are an interval of indices, as bounds are nested. What that
  /// leaves open is divided further, as the shares may change along it.
  void addStretch(float from, float to) {
    const float middle = 0.5f * (from + to);
    int low = 0, high = count_ - 1;
    for (int c = 0; c < crossingCount_; ++c) {
      const Crossing& crossing = crossing_[std::size_t(c)];
      const bool inside = middle >= crossing.from && middle < crossing.to;
      if (inside == crossing.above)
        low = std::max(low, crossing.index + 1);
      else
        high = std::min(high, crossing.index);
    }
    if (low > high) {  // rounding can make a sliver contradict itself
      low = 0;
      high = count_ - 1;
    }
    const int parts = low == high ? 1 : std::max(2, int(float(kSlabs) * (to - from) + 0.5f));
    for (int part = 0; part < parts; ++part) {
      Slab& slab = slab_[std::size_t(slabs_++)];
      slab.from = from + (to - from) * float(part) / float(parts);
      slab.to = part + 1 == parts ? to : from + (to - from) * float(part + 1) / float(parts);
      slab.low = low;
      slab.high = high;
    }
  }

  /// What step 1 has placed already.
  void closedSums() {
    closedSum_ = closedFirst_ = closedSecond_ = Row{};
    for (int s = 0; s < slabs_; ++s) {
      const Slab& slab = slab_[s];
      if (slab.open()) continue;
      const float z = slab.middle() - 0.5f;
      const auto add = [&](Row& row, float value) {
        at(row, slab.low) = at(row, slab.low) + value;
      };
      add(closedSum_, slab.thickness());
      add(closedFirst_, slab.thickness() * z);
      add(closedSecond_, slab.thickness() * z * z);
    }
  }

  /// Step 2. The distribution of largest entropy is p_i(z) = 2^(h_i + s_i z) / Σ_j 2^(h_j + s_j z).
  Row sharesIn(const Slab& slab) const {
    const float z = slab.middle() - 0.5f;
    const Ints low = Ints{} + slab.low, high = Ints{} + slab.high;
    Row value;
    Lanes most = Lanes{} - 1e30f;
    for (int v = 0; v < kWidth; ++v) {
      const Ints index = kIndex + v * kLanes;
      const Lanes raw = height_[v] + slope_[v] * z;
      value[v] = (index >= low) & (index <= high) ? raw : Lanes{} - 1e30f;
      most = most > value[v] ? most : value[v];
    }
    const float greatest = greatestOf(most);
    Lanes sum{};
    for (int v = 0; v < kWidth; ++v) {
      const Lanes power = exp2Roughly(value[v] - greatest);
      value[v] = value[v] > -1e29f ? power : Lanes{};
      sum += value[v];
    }
    const float scale = slab.thickness() / sumOf(sum);
    for (int v = 0; v < kWidth; ++v) value[v] *= scale;
    return value;
  }

  /// A Newton step on the slope and a scaling of the height of each channel by itself.
  void improve() {
    Row sum = closedSum_, first = closedFirst_, second = closedSecond_;
    for (int s = 0; s < slabs_; ++s) {
      const Slab& slab = slab_[s];
      if (!slab.open()) continue;
      const float z = slab.middle() - 0.5f;
      const Row shares = sharesIn(slab);
      for (int v = 0; v < kWidth; ++v) {
        sum[v] += shares[v];
        first[v] += shares[v] * z;
        second[v] += shares[v] * (z * z);
      }
    }
    constexpr float kPerLog2 = 1.442695f;
    for (int v = 0; v < kWidth; ++v) {
      const Ints there = sum[v] > 1e-20f;
      const Lanes total = there ? sum[v] : Lanes{} + 1.0f;
      const Lanes mean = first[v] / total;
      const Lanes spread = second[v] / total - mean * mean;
      const Lanes variance = spread > 1e-4f ? spread : Lanes{} + 1e-4f;
      const Lanes step = kPerLog2 * clamped((mean_[v] - 0.5f - mean) / variance, -20.0f, 20.0f);
      const Lanes slope = clamped(slope_[v] + step, -500.0f, 500.0f);
      const Lanes height =
          clamped(height_[v] + log2Roughly(share_[v] / total) - step * mean, -400.0f, 400.0f);
      slope_[v] = there ? slope : slope_[v];
      height_[v] = there ? height : height_[v];
    }
  }

  void spread() {
    total_ = closedSum_;
    for (int s = 0; s < slabs_; ++s) {
      Slab& slab = slab_[s];
      if (!slab.open()) continue;
      slab.weights = sharesIn(slab);
      for (int v = 0; v < kWidth; ++v) total_[v] += slab.weights[v];
    }
  }

  /// Lengths are known exactly and shall stay so: scale them, and gather what is too little for a
  /// segment of its own into the channel's next slab.
  void keepLengths() {
    Row carried{};
    std::array<Ints, kWidth> latest;
    for (int v = 0; v < kWidth; ++v) {
      scale_[v] = total_[v] > 0.0f ? share_[v] / total_[v] : Lanes{};
      latest[v] = Ints{} - 1;
    }
    for (int s = 0; s < slabs_; ++s) {
      Slab& slab = slab_[s];
      if (!slab.open()) continue;
      for (int v = 0; v < kWidth; ++v) {
        carried[v] += slab.weights[v] * scale_[v];
        const Ints enough = (carried[v] >= kLeastShare * share_[v]) & (carried[v] > 0.0f);
        slab.weights[v] = enough ? carried[v] : Lanes{};
        carried[v] = enough ? Lanes{} : carried[v];
        latest[v] = enough ? Ints{} + s : latest[v];
      }
    }
    for (int i = 0; i < count_; ++i) {
      float rest = at(carried, i);
      int slab = latest[std::size_t(i / kLanes)][i % kLanes];
      if (!(at(total_, i) > 0.0f)) rest = at(share_, i);  // squeezed out by the cuts
      if (!(rest > 0.0f)) continue;
      if (slab < 0) slab = slabAt(at(mean_, i));
      place(slab_[std::size_t(slab)], i, rest);
    }
  }

  int slabAt(float depth) const {
    int slab = 0;
    while (slab + 1 < slabs_ && slab_[std::size_t(slab)].to <= depth) ++slab;
    return slab;
  }

  /// Adds to a channel in a slab, even where step 1 had no room for it.
  void place(Slab& slab, int i, float amount) {
    if (!slab.open()) {
      if (slab.low == i) return;  // its scale carries it
      slab.weights = Row{};
      at(slab.weights, slab.low) = slab.thickness() * at(scale_, slab.low);
    }
    slab.low = std::min(slab.low, i);
    slab.high = std::max(slab.high, i);
    at(slab.weights, i) = at(slab.weights, i) + amount;
  }

  void emitClosed(const Slab& slab, std::size_t emitted, std::vector<Segment>& segments) const {
    const int channel = ray_[slab.low].channel;
    const float amount = slab.thickness() * at(scale_, slab.low) * float(chord_);
    if (!(amount > 0.0f) || channel == partition_.noData()) return;
    // Where the ray is in this channel already, and in no other, the segment goes on.
    if (segments.size() > emitted && segments.back().channel == channel &&
        !segments.back().ambiguous)
      segments.back().amount += amount;
    else
      segments.push_back({channel, amount, false, false});
  }

  static constexpr Ints kIndex{0, 1, 2, 3, 4, 5, 6, 7};
  std::span<RayInterval> ray_;
  RayEnds ends_;
  const IntervalPartition& partition_;
  int count_, valued_ = 0;
  double chord_ = 0.0;
  Row share_{}, mean_{}, height_, slope_, closedSum_, closedFirst_, closedSecond_, total_, scale_;
  int cutCount_ = 0, crossingCount_ = 0, slabs_ = 0;
  std::array<float, kMostStretches + 1> cuts_;
  std::array<Crossing, kMostChannels> crossing_;
  std::array<Slab, kMostSlabs> slab_;
};

template <int kWidth>
inline void orderWith(std::span<RayInterval> ray, const RayEnds& ends,
                      const IntervalPartition& partition, std::vector<Segment>& segments) {
  RayModel<kWidth> model(ray, ends, partition);
  if (!model.measure()) return;
  model.cut();
  model.fit();
  model.emit(segments);
}

inline void orderOpenRay(std::span<RayInterval> ray, const RayEnds& ends,
                         const IntervalPartition& partition, std::vector<Segment>& segments) {
  constexpr std::size_t kMost = (kMostChannels + kLanes - 1) / kLanes;
  if (ray.size() <= kLanes)
    orderWith<1>(ray, ends, partition, segments);
  else if (ray.size() <= 2 * kLanes)
    orderWith<2>(ray, ends, partition, segments);
  else
    orderWith<kMost>(ray, ends, partition, segments);
}

// Wider registers halve the time; results are the same, as nothing is fused or reordered.
#if defined(__x86_64__) && defined(__GNUC__)
__attribute__((target("avx2"), flatten)) void orderOpenRayWide(std::span<RayInterval> ray,
                                                               const RayEnds& ends,
                                                               const IntervalPartition& partition,
                                                               std::vector<Segment>& segments) {
  orderOpenRay(ray, ends, partition, segments);
}
const bool kWideRegisters = __builtin_cpu_supports("avx2");
#else
constexpr bool kWideRegisters = false;
constexpr auto orderOpenRayWide = orderOpenRay;
#endif

}  // namespace

void orderByMeanDepth(std::span<RayInterval> ray, std::vector<Segment>& segments) {
  // Insertion sort: the lists are short, and neighbours in value are often neighbours in depth.
  for (std::size_t i = 1; i < ray.size(); ++i) {
    const RayInterval moving = ray[i];
    std::size_t j = i;
    for (; j > 0 && ray[j - 1].depth > moving.depth; --j) ray[j] = ray[j - 1];
    ray[j] = moving;
  }
  for (const RayInterval& interval : ray) {
    segments.push_back({interval.channel, interval.length, interval.runs > 1});
  }
}

void orderByRuns(std::span<RayInterval> ray, const RayEnds& ends,
                 const IntervalPartition& partition, std::vector<Segment>& segments) {
  if (std::all_of(ray.begin(), ray.end(), [](const RayInterval& i) { return i.runs <= 1; })) {
    const auto valued = std::partition(ray.begin(), ray.end(), [&](const RayInterval& i) {
      return i.channel != partition.noData();
    });
    orderByMeanDepth({ray.begin(), valued}, segments);
    return;
  }
  if (kWideRegisters)
    orderOpenRayWide(ray, ends, partition, segments);
  else
    orderOpenRay(ray, ends, partition, segments);
}

}  // namespace vestige
