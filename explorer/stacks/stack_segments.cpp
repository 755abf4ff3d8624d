// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/stacks/stack_segments.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "explorer/recomposition/segment_builder.h"
#include "explorer/stacks/run_profile.h"

namespace vestige {
namespace {

/// Profiles are looked at in the middles of so many equal steps a run.
constexpr int kSteps = 16;

}  // namespace

FineChannels::FineChannels(const IntervalPartition& partition)
    : FineChannels(partition, kMostParts) {}

FineChannels::FineChannels(const IntervalPartition& partition, int parts)
    : partition_(partition), parts_(std::clamp(parts, 1, kMostParts)) {}

int FineChannels::parent(int channel) const {
  const int fine = partition_.intervals() * parts_;
  return channel < fine ? channel / parts_ : partition_.intervals() + channel - fine;
}

ChannelTable FineChannels::table(const IntervalLook& look) const {
  ChannelTable table;
  for (int k = 0; k < count(); ++k) {
    table.strength.push_back(look.extinction[std::size_t(parent(k))]);
    table.color.push_back(look.color[std::size_t(parent(k))]);
  }
  return table;
}

ChannelTable FineChannels::table(const TransferFunction& function) const {
  // Partitions hold kMaxIntervals: the parts' means come interval by interval.
  const int intervals = partition_.intervals();
  ChannelTable table = this->table(function.onIntervals(partition_));
  TransferFunction plain = function;
  plain.setFactors({});
  for (int k = 0; k < intervals; ++k) {
    const auto i = std::size_t(k);
    const double low = partition_.bounds()[i], high = partition_.bounds()[i + 1];
    std::vector<double> bounds{low};
    for (int part = 1; part <= parts_; ++part) {
      bounds.push_back(part == parts_ ? high : std::lerp(low, high, double(part) / parts_));
      // An interval too narrow for its parts keeps its own mean.
      if (!(bounds[bounds.size() - 1] > bounds[bounds.size() - 2])) bounds.clear();
      if (bounds.empty()) break;
    }
    if (bounds.empty()) continue;
    const IntervalLook look = plain.onIntervals(IntervalPartition::fromBounds(bounds));
    const double factor = function.factors().empty() ? 1.0 : function.factors()[i];
    for (int part = 0; part < parts_; ++part) {
      table.strength[i * std::size_t(parts_) + std::size_t(part)] =
          factor * look.extinction[std::size_t(part)];
      table.color[i * std::size_t(parts_) + std::size_t(part)] = look.color[std::size_t(part)];
    }
  }
  return table;
}

SegmentLists segmentsOfRuns(const RunLists& runs, const FineChannels& channels,
                            const FieldStatistics& statistics, double unit) {
  const int parts = channels.parts();
  return buildSegmentLists(
      runs.size, unit,
      [&runs, &channels, parts, profile = RunProfile(channels.partition(), statistics)](
          std::size_t pixel, std::vector<Segment>& out) mutable {
        const int noData = profile.noData(), last = noData - 1;
        for (const ProfileSegment& segment : profile.of(runs, pixel)) {
          if (segment.rank == noData) continue;
          if (segment.rank == 0 || segment.rank == last || parts == 1) {
            out.push_back({channels.channel(segment.rank, 0), segment.length});
            continue;
          }
          const float step = segment.length / kSteps;
          int part = -1;
          float length = 0.0f;
          for (int j = 0; j < kSteps; ++j) {
            const float y = segment.at((float(j) + 0.5f) / kSteps);
            const int here = std::min(int(y * float(parts)), parts - 1);
            if (here != part) {
              if (part >= 0) out.push_back({channels.channel(segment.rank, part), length});
              part = here;
              length = 0.0f;
            }
            length += step;
          }
          out.push_back({channels.channel(segment.rank, part), length});
        }
      });
}

}  // namespace vestige
