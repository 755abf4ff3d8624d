// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/run/settled.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace vestige {
namespace {

constexpr double kFew = 0.001;

bool takesFirstStep(const FieldConfig& config) {
  return config.bounds.empty() && config.range == FieldConfig::Range::FirstStep;
}

/// Intervals as explicit bounds: the base function and isovalues follow from them again.
Classification classifyWithin(FieldConfig config, const IntervalPartition& intervals,
                              const FieldStatistics& statistics, double referenceLength) {
  config.bounds.assign(intervals.bounds().begin(), intervals.bounds().end());
  return classify(config, statistics, referenceLength);
}

/// As many intervals over what there was and the data. A side that these are well beyond grows by a
/// quarter of the width at least, lest data that grow steadily widen it at each step.
IntervalPartition widened(const FieldConfig& config, const IntervalPartition& before,
                          const FieldStatistics& statistics) {
  const double width = before.high() - before.low(), well = 0.01 * width;
  double low = before.low(), high = before.high();
  if (statistics.low < low)
    low = std::min(statistics.low, low - statistics.low > well ? low - 0.25 * width : low);
  if (statistics.high > high)
    high = std::max(statistics.high, statistics.high - high > well ? high + 0.25 * width : high);
  if (!std::isfinite(high - low)) return before;  // as far as doubles go
  FieldConfig over = config;
  if (!config.quantiles || !varies(statistics, config.intervals)) {
    over.range = FieldConfig::Range::Fixed;
    over.quantiles = false;
    over.low = low;
    over.high = high;
    return classify(over, statistics, 1.0).partition;
  }
  const auto inside = classify(over, statistics, 1.0).partition.bounds();
  std::vector<double> bounds(inside.begin(), inside.end());
  bounds.front() = low;
  bounds.back() = high;
  return IntervalPartition::fromBounds(std::move(bounds));
}

}  // namespace

bool varies(const FieldStatistics& statistics, int intervals) {
  return statistics.count > statistics.noData &&
         IntervalPartition::resolves(statistics.low, statistics.high, intervals);
}

bool outgrows(const FieldStatistics& statistics, const IntervalPartition& intervals) {
  const double share = statistics.shareOutside();
  const bool twice =
      0.5 * statistics.high - 0.5 * statistics.low > intervals.high() - intervals.low();
  return reachesBeyond(statistics, intervals) && (share > kOutside || (share > kFew && twice));
}

void Settled::adopt(const Archive& archive) {
  // The widest intervals are those of the last step; a step at which the field does not vary may
  // have had a range of its own.
  const auto partitionAt = [&](const ArchiveRow& row) -> std::optional<IntervalPartition> {
    const ExrFile file = archive.open(row);
    const auto& [partition, statistics] =
        std::pair(file.header().partition, file.header().statistics);
    return partition && varies(statistics, partition->intervals()) ? partition : std::nullopt;
  };
  const auto& rows = archive.rows();
  std::set<std::pair<std::string, long>> seen;
  for (auto row = rows.rbegin(); row != rows.rend(); ++row) {
    if (partitions_.contains(row->field) || !seen.emplace(row->field, row->cycle).second) continue;
    if (auto partition = partitionAt(*row)) partitions_.emplace(row->field, std::move(*partition));
  }
  seen.clear();
  for (const ArchiveRow& row : rows) {
    if (!partitions_.contains(row.field) || scales_.contains(row.field) ||
        !seen.emplace(row.field, row.cycle).second)
      continue;
    if (const auto partition = partitionAt(row))
      scales_.emplace(row.field, partition->high() - partition->low());
  }
  seen.clear();
  for (const ArchiveRow& row : rows) {
    if (partitions_.contains(row.field) || features_.contains(row.field) ||
        !seen.emplace(row.field, row.cycle).second)
      continue;
    const ExrFile file = archive.open(row);
    const auto& features = file.header().features;
    if (features && features->settled) features_.emplace(row.field, *features);
  }
}

const IntervalPartition* Settled::find(const PlannedField& field) const {
  const auto found = partitions_.find(field.name);
  const bool holds = takesFirstStep(field.config) && found != partitions_.end() &&
                     found->second.intervals() == field.config.intervals;
  return holds ? &found->second : nullptr;
}

std::optional<Settled::Ends> Settled::endsOf(const PlannedField& field) const {
  const FieldConfig& config = field.config;
  if (!config.bounds.empty()) return Ends{config.bounds.front(), config.bounds.back()};
  if (config.range == FieldConfig::Range::Fixed) {
    const auto partition = classify(config, {}, 1.0).partition;
    return Ends{partition.low(), partition.high()};
  }
  const IntervalPartition* known = find(field);
  return known ? std::optional(Ends{known->low(), known->high()}) : std::nullopt;
}

Classification Settled::classificationOf(const PlannedField& field,
                                         const FieldStatistics& statistics,
                                         double referenceLength) const {
  const IntervalPartition* known = find(field);
  if (!known) return classify(field.config, statistics, referenceLength);
  return classifyWithin(
      field.config,
      outgrows(statistics, *known) ? widened(field.config, *known, statistics) : *known, statistics,
      referenceLength);
}

double Settled::scaleOf(const PlannedField& field, const FieldStatistics& statistics) const {
  const auto known = scales_.find(field.name);
  if (takesFirstStep(field.config) && known != scales_.end()) return known->second;
  const auto partition = classificationOf(field, statistics, 1.0).partition;
  return partition.high() - partition.low();
}

const FeatureOrigin* Settled::featuresOf(const std::string& classifier) const {
  const auto known = features_.find(classifier);
  return known == features_.end() ? nullptr : &known->second;
}

void Settled::keep(const PlannedField& field, const FieldStatistics& statistics) {
  if (!find(field) && !varies(statistics, field.config.intervals)) return;
  auto partition = classificationOf(field, statistics, 1.0).partition;
  scales_.try_emplace(field.name, partition.high() - partition.low());
  partitions_.insert_or_assign(field.name, std::move(partition));
}

void Settled::keep(const StepClassifier& classifier) {
  if (classifier.origin.settled)
    features_.try_emplace(classifier.plan.config.name, classifier.origin);
}

}  // namespace vestige
