// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <set>
#include <string>

#include "adaptor/plan/fill_values.h"
#include "adaptor/common/log.h"
#include "adaptor/run/settled.h"

namespace vestige {

/// What a user should know of a field that is stored, each thing once.
class FieldWarnings {
 public:
  explicit FieldWarnings(Log& log) : log_(log) {}

  /// Samples without data, and values that seem to stand for that.
  void ofSamples(const PlannedField& field, const FieldStatistics& statistics,
                 const BlockSet& blocks, int threads);
  /// A range that is not settled yet; data outside of the intervals, once and again when ten times
  /// as many are; each time that intervals are widened. `before`: ends that samples were counted
  /// against.
  void ofIntervals(const PlannedField& field, const FieldStatistics& statistics,
                   const std::optional<Settled::Ends>& before, const IntervalPartition& intervals,
                   std::int64_t cycle);

 private:
  bool first(const std::string& what, const PlannedField& field) {
    return told_.insert(what + " of " + field.name).second;
  }

  Log& log_;
  std::set<std::string> told_;
  std::map<std::string, double> shares_;  ///< that were outside when it was said
};

}  // namespace vestige
