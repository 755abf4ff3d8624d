// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/run/trigger.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace vestige {
namespace {

/// A histogram as shares of its samples, spread over equal bins of another range.
std::vector<double> rebinned(const FieldStatistics& statistics, double low, double high,
                             std::size_t bins) {
  std::vector<double> shares(bins, 0.0);
  double total = 0.0;
  for (const auto count : statistics.histogram) total += double(count);
  if (total == 0.0) return shares;
  const double from = (statistics.high - statistics.low) / double(statistics.histogram.size());
  const double to = (high - low) / double(bins);
  for (std::size_t i = 0; i < statistics.histogram.size(); ++i) {
    if (statistics.histogram[i] == 0) continue;
    const double share = double(statistics.histogram[i]) / total;
    const double start = to > 0.0 ? (statistics.low + from * double(i) - low) / to : 0.0;
    const double width = to > 0.0 ? from / to : 0.0;
    if (!(width > 0.0)) {
      shares[std::size_t(std::clamp(start, 0.0, double(bins - 1)))] += share;
      continue;
    }
    // The old bin covers [start, start + width) in units of new bins.
    for (auto b = std::size_t(std::max(start, 0.0)); b < bins && double(b) < start + width; ++b) {
      const double covered = std::min(start + width, double(b) + 1.0) - std::max(start, double(b));
      shares[b] += share * std::max(covered, 0.0) / width;
    }
  }
  return shares;
}

double totalVariation(const FieldStatistics& a, const FieldStatistics& b) {
  const bool someA = a.count > a.noData, someB = b.count > b.noData;
  if (!someA || !someB) return someA == someB ? 0.0 : 1.0;
  const double low = std::min(a.low, b.low), high = std::max(a.high, b.high);
  const auto bins = std::max(a.histogram.size(), b.histogram.size());
  const auto first = rebinned(a, low, high, bins), second = rebinned(b, low, high, bins);
  double sum = 0.0;
  for (std::size_t i = 0; i < bins; ++i) sum += std::abs(first[i] - second[i]);
  return 0.5 * sum;
}

}  // namespace

double changeBetween(const FieldStatistics& before, const FieldStatistics& now,
                     TriggerConfig::Measure measure) {
  using Measure = TriggerConfig::Measure;
  switch (measure) {
    case Measure::Mean:
      return std::abs(now.mean - before.mean);
    case Measure::Deviation:
      return std::abs(now.deviation - before.deviation);
    case Measure::Low:
      return std::abs(now.low - before.low);
    case Measure::High:
      return std::abs(now.high - before.high);
    case Measure::Histogram:
      return totalVariation(before, now);
  }
  return 0.0;
}

bool Trigger::byCadence(std::int64_t cycle, double time) const {
  if (!any_) return true;
  if (config_.everyCycles == 0 && config_.everyTime == 0.0 && !config_.change) return true;
  if (config_.everyCycles > 0 && cycle % config_.everyCycles == 0) return true;
  if (config_.everyTime > 0.0) {
    // Sums of time steps miss their multiples by rounding: a millionth of Δt is forgiven.
    const auto multiples = [&](double t) {
      return std::floor((t - firstTime_) / config_.everyTime + 1e-6);
    };
    if (multiples(time) > multiples(lastTime_)) return true;
  }
  return false;
}

bool Trigger::looksAtChange(std::int64_t cycle) const {
  return config_.change && cycle % config_.change->everyCycles == 0;
}

bool Trigger::mayFire(std::int64_t cycle, double time) const {
  return byCadence(cycle, time) || looksAtChange(cycle);
}

bool Trigger::fires(std::int64_t cycle, double time,
                    const std::function<FieldStatistics(const std::string&)>& statistics) {
  if (byCadence(cycle, time)) return true;
  if (!looksAtChange(cycle) || !last_) return false;
  return changeBetween(*last_, statistics(config_.change->field), config_.change->measure) >
         config_.change->threshold;
}

void Trigger::stored(std::int64_t, double time,
                     const std::function<FieldStatistics(const std::string&)>& statistics) {
  if (!any_) firstTime_ = time;
  any_ = true;
  lastTime_ = time;
  if (config_.change) last_ = statistics(config_.change->field);
}

}  // namespace vestige
