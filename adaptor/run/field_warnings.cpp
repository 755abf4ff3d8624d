// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/run/field_warnings.h"

#include <fmt/format.h>

namespace vestige {

void FieldWarnings::ofSamples(const PlannedField& field, const FieldStatistics& statistics,
                              const BlockSet& blocks, int threads) {
  if (statistics.noData > 0 && first("no data", field)) {
    log_.warning(fmt::format(
        "field '{}' has {} samples of {} without data (NaN, infinite, masked or no_data)",
        field.name, statistics.noData, statistics.count));
  }
  if (told_.contains("fill of " + field.name)) return;
  if (const auto fill = suspectedFill(field, statistics, blocks, threads)) {
    first("fill", field);
    const std::string value = shortest(fill->value);
    log_.warning(
        fmt::format("field '{}': {:.3g} % of the samples are exactly {}, far from the "
                    "others ({:.6g} to {:.6g}); if this stands for no data, say so: "
                    "no_data = [{}] in its [[field]]",
                    field.name, 100.0 * fill->share, value, fill->low, fill->high, value));
  }
}

void FieldWarnings::ofIntervals(const PlannedField& field, const FieldStatistics& statistics,
                                const std::optional<Settled::Ends>& before,
                                const IntervalPartition& intervals, std::int64_t cycle) {
  const FieldConfig& config = field.config;
  const bool firstStep = config.bounds.empty() && config.range == FieldConfig::Range::FirstStep;
  if (!before) {
    if (!firstStep || varies(statistics, intervals.intervals())) return;
    if (!first("range", field)) return;
    return log_.info(fmt::format(
        "field '{}' {} at cycle {}: its intervals are those of the first step at which it varies",
        field.name,
        statistics.count == statistics.noData ? std::string("has no data")
                                              : fmt::format("is {:.6g} everywhere", statistics.low),
        cycle));
  }
  const bool widened = before != Settled::Ends{intervals.low(), intervals.high()};
  const double share = statistics.shareOutside();
  if (!widened && (share <= kOutside || !reachesBeyond(statistics, intervals))) return;
  const auto said = shares_.find(field.name);
  const bool news = said == shares_.end() || share >= 10.0 * said->second;
  if (!widened && !news) return;
  std::string sentence = fmt::format(
      "field '{}': {:.3g} % of the samples at cycle {} are outside of its intervals, {:.6g} to "
      "{:.6g}; the data are {:.6g} to {:.6g}. ",
      field.name, 100.0 * share, cycle, before->first, before->second, statistics.low,
      statistics.high);
  if (widened) {
    sentence += fmt::format(
        "From now on the intervals are {:.6g} to {:.6g}; range = [low, high] in its [[field]] sets "
        "them for the whole run",
        intervals.low(), intervals.high());
  } else {
    sentence += fmt::format("What is outside is not told apart; {} in its [[field]] says what is",
                            config.bounds.empty() ? "range" : "bounds");
  }
  if (news) {
    shares_[field.name] = share;
    log_.warning(std::move(sentence));
  } else {
    log_.info(std::move(sentence));
  }
}

}  // namespace vestige
