// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>

#include "adaptor/plan/classification.h"
#include "adaptor/step/feature_step.h"
#include "proxy/archive/archive.h"

namespace vestige {

/// What a run settles as it goes: of fields with the first step's range their intervals, from the
/// first stored step on at which the field varies, and widened when the data outgrow them; of
/// classifiers what they are, from the first stored step on at which all of their fields vary.
class Settled {
 public:
  using Ends = std::pair<double, double>;

  /// Goes on with what an earlier run settled. Throws what reading an archive throws.
  void adopt(const Archive& archive);

  /// The ends of a field's intervals as they are known before its samples are: configured, or
  /// settled. None: those of the step at hand.
  std::optional<Ends> endsOf(const PlannedField& field) const;
  /// `statistics` with samples counted against endsOf().
  Classification classificationOf(const PlannedField& field, const FieldStatistics& statistics,
                                  double referenceLength) const;
  /// What gradients in a norm are divided by: the width of the intervals as they were first
  /// settled.
  double scaleOf(const PlannedField& field, const FieldStatistics& statistics) const;
  /// nullptr until it is settled.
  const FeatureOrigin* featuresOf(const std::string& classifier) const;
  void forgetFeatures(const std::string& classifier) { features_.erase(classifier); }

  /// A step was stored.
  void keep(const PlannedField& field, const FieldStatistics& statistics);
  void keep(const StepClassifier& classifier);

 private:
  const IntervalPartition* find(const PlannedField& field) const;

  std::map<std::string, IntervalPartition> partitions_;
  std::map<std::string, double> scales_;
  std::map<std::string, FeatureOrigin> features_;
};

/// Whether a step says what a field's range is: it has data, and they differ.
bool varies(const FieldStatistics& statistics, int intervals);
/// Whether data outgrow intervals against which they are counted: they reach beyond, and more than
/// 1 % of them are outside, or more than 0.1 % and their range is more than twice as wide.
bool outgrows(const FieldStatistics& statistics, const IntervalPartition& intervals);

}  // namespace vestige
