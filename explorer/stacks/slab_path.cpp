// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/stacks/slab_path.h"

#include <algorithm>
#include <cstdlib>

namespace vestige {
namespace {

/// A leg of a path: ranks first, first + way, ... last; a turning rank belongs to the leg before.
struct Leg {
  int first, last, way;
  bool has(int rank) const {
    return way > 0 ? rank >= first && rank <= last : rank <= first && rank >= last;
  }
};

}  // namespace

void SlabPath::push(int rank, float levels) {
  if (levels > 0.0f) visits_[std::size_t(count_++)] = {std::uint8_t(rank), levels};
}

void SlabPath::insertGap(int rank, float levels) {
  int at = -1;
  float before = 0.0f, all = 0.0f;
  for (int i = 0; i < count_; ++i) {
    all += visits_[std::size_t(i)].levels;
    if (at < 0 && i > 0 &&
        std::abs(visits_[std::size_t(i)].rank - visits_[std::size_t(i) - 1].rank) > 1) {
      at = i;
    }
  }
  if (at < 0) {
    for (at = 0; before + visits_[std::size_t(at)].levels < 0.5f * all; ++at) {
      before += visits_[std::size_t(at)].levels;
    }
    // Divide the visit in the middle.
    const Visit whole = visits_[std::size_t(at)];
    const float front = 0.5f * all - before, back = whole.levels - front;
    if (front > 0.0f && back > 0.0f) {
      visits_[std::size_t(at)].levels = front;
      ++at;
      std::copy_backward(visits_.begin() + at, visits_.begin() + count_,
                         visits_.begin() + count_ + 1);
      visits_[std::size_t(at)] = {whole.rank, back};
      ++count_;
    } else if (back <= 0.0f) {
      ++at;
    }
  }
  std::copy_backward(visits_.begin() + at, visits_.begin() + count_, visits_.begin() + count_ + 1);
  visits_[std::size_t(at)] = {std::uint8_t(rank), levels};
  ++count_;
}

void SlabPath::walk(std::span<const int> stops, std::span<const float> places,
                    const std::uint8_t* levels, int lowest) {
  const int legs = int(stops.size()) - 1;
  std::array<Leg, kMostLegs> leg{};
  std::array<std::array<float, kMostRanks + 1>, kMostLegs> length;
  std::array<std::uint8_t, kMostRanks + 1> times{};
  for (int i = 0; i < legs; ++i) {
    const int from = stops[std::size_t(i)], to = stops[std::size_t(i) + 1];
    const int way = to >= from ? 1 : -1;
    leg[std::size_t(i)] = {i > 0 ? from + way : from, to, way};
    const Leg& own = leg[std::size_t(i)];
    for (int k = own.first; own.has(k); k += way) ++times[std::size_t(k - lowest)];
  }
  for (int i = 0; i < legs; ++i) {
    const Leg& own = leg[std::size_t(i)];
    for (int k = own.first; own.has(k); k += own.way) {
      length[std::size_t(i)][std::size_t(k - lowest)] =
          float(levels[k - lowest]) / float(times[std::size_t(k - lowest)]);
    }
  }
  // One turn's division does not depend on another's but with two turns: go over them again.
  const int rounds = legs > 2 ? 3 : 1;
  for (int round = 0; round < rounds; ++round) {
    for (int turn = 0; turn + 1 < legs; ++turn) {
      if (places[std::size_t(turn)] < 0.0f) continue;
      const int top = stops[std::size_t(turn) + 1];
      auto& before = length[std::size_t(turn)];
      auto& after = length[std::size_t(turn) + 1];
      const Leg &in = leg[std::size_t(turn)], &out = leg[std::size_t(turn) + 1];
      float ahead = 0.0f, shared = 0.0f;
      for (int i = 0; i < turn; ++i) {
        const Leg& own = leg[std::size_t(i)];
        for (int k = own.first; own.has(k); k += own.way) {
          ahead += length[std::size_t(i)][std::size_t(k - lowest)];
        }
      }
      for (int k = in.first; in.has(k); k += in.way) {
        if (k == top) continue;
        const auto r = std::size_t(k - lowest);
        if (out.has(k)) {
          shared += before[r] + after[r];
        } else {
          ahead += before[r];
        }
      }
      if (!(shared > 0.0f)) continue;
      const float start = places[std::size_t(turn)] - 0.5f * float(levels[top - lowest]);
      const float ratio = std::clamp((start - ahead) / shared, 0.0f, 1.0f);
      for (int k = in.first; in.has(k); k += in.way) {
        if (k == top || !out.has(k)) continue;
        const auto r = std::size_t(k - lowest);
        const float both = before[r] + after[r];
        before[r] = ratio * both;
        after[r] = both - before[r];
      }
    }
  }
  for (int i = 0; i < legs; ++i) {
    const Leg& own = leg[std::size_t(i)];
    for (int k = own.first; own.has(k); k += own.way) {
      push(k, length[std::size_t(i)][std::size_t(k - lowest)]);
    }
  }
}

void SlabPath::follow(const StackSlab& slab, const StackCell& cell, int enter, int leave,
                      int noDataRank, int allLevels) {
  count_ = 0;
  certain_ = true;
  const auto levels = slab.levelsOf(cell);
  int first = 0, end = int(levels.size());
  while (first < end && levels[std::size_t(first)] == 0) ++first;
  while (end > first && levels[std::size_t(end) - 1] == 0) --end;
  const float gap = cell.noData;
  if (first == end) {
    push(noDataRank, gap);
    return;
  }
  const int lowest = cell.lowest + first, highest = cell.lowest + end - 1;
  const std::uint8_t* own = levels.data() + first;
  const bool gapFirst = gap > 0.0f && enter == noDataRank;
  const bool gapLast = gap > 0.0f && leave == noDataRank;
  const float front = gapFirst ? (gapLast ? 0.5f * gap : gap) : 0.0f;
  push(noDataRank, front);
  if (lowest == highest) {
    push(lowest, own[0]);
  } else {
    const auto known = [&](int rank) { return rank >= 0 && rank < noDataRank; };
    int from = known(enter) ? std::clamp(enter, lowest, highest) : -1;
    int to = known(leave) ? std::clamp(leave, lowest, highest) : -1;
    const auto farther = [&](int rank) {
      return rank - lowest > highest - rank ? lowest : highest;
    };
    // Without a rank at a face the path is taken as rising, or falling.
    certain_ = from >= 0 && to >= 0;
    if (from < 0 && to < 0) {
      from = lowest;
      to = highest;
    } else if (from < 0) {
      from = farther(to);
    } else if (to < 0) {
      to = farther(from);
    }
    const bool below = lowest<std::min(from, to), above = highest> std::max(from, to);
    certain_ = certain_ && !below && !above;
    const auto place = [&](int turn) {
      return turn > 0 ? (float(turn) - 0.5f) / SlicedStack::kTurns * float(allLevels) - front
                      : -1.0f;
    };
    const float low = place(cell.low()), high = place(cell.high());
    bool lowFirst = below;
    if (below && above) {
      lowFirst = cell.low() > 0 && cell.high() > 0 && cell.low() != cell.high()
                     ? cell.low() < cell.high()
                     : from <= to;
    }
    std::array<int, 4> stops{from};
    std::array<float, 2> places{};
    int turns = 0;
    for (int i = 0; i < 2; ++i) {
      const bool lowNow = lowFirst == (i == 0);
      if (lowNow ? !below : !above) continue;
      places[std::size_t(turns)] = lowNow ? low : high;
      stops[std::size_t(++turns)] = lowNow ? lowest : highest;
    }
    stops[std::size_t(turns) + 1] = to;
    walk({stops.data(), std::size_t(turns) + 2}, places, own, lowest);
  }
  if (gapLast) {
    push(noDataRank, gap - front);
  } else if (gap > 0.0f && !gapFirst) {
    certain_ = false;
    insertGap(noDataRank, gap);
  }
}

}  // namespace vestige
