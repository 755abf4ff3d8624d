// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "explorer/recomposition/edit_pass.h"
#include "explorer/recomposition/segments.h"
#include "explorer/stacks/stack_runs.h"
#include "proxy/transfer/transfer_function.h"

namespace vestige {

/// Channels finer than a partition's: each interval in `parts` equal ones, then below, above and no
/// data. A continuous transfer function is averaged over a part, not over the interval.
class FineChannels {
 public:
  /// As many parts as SegmentLists can name, at most kMostParts.
  explicit FineChannels(const IntervalPartition& partition);
  FineChannels(const IntervalPartition& partition, int parts);

  static constexpr int kMostParts = 4;
  int parts() const { return parts_; }
  int count() const { return partition_.intervals() * parts_ + 3; }
  /// The channel at part `part` of a rank; below, above and no data have one.
  int channel(int rank, int part) const {
    const int intervals = partition_.intervals();
    return rank == 0           ? intervals * parts_
           : rank <= intervals ? (rank - 1) * parts_ + part
                               : intervals * parts_ + (rank - intervals);
  }
  /// Channel of the partition.
  int parent(int channel) const;
  /// Means of a transfer function over the channels.
  ChannelTable table(const TransferFunction& function) const;
  /// Any look of the partition's channels.
  ChannelTable table(const IntervalLook& look) const;
  const IntervalPartition& partition() const { return partition_; }

 private:
  IntervalPartition partition_;
  int parts_;
};

/// The runs of a stack as segments that EditPass recomposes: a run is divided where its profile
/// (RunProfile) passes from a part of its interval to the next; parts of a run keep its length. No
/// data are no segment. Nothing is ambiguous: what depends on an uncertain order shows by comparing
/// with the segments of runsOfStack(stack, Uncertain::Reversed).
SegmentLists segmentsOfRuns(const RunLists& runs, const FineChannels& channels,
                            const FieldStatistics& statistics, double unit);

}  // namespace vestige
