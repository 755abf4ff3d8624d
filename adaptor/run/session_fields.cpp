// SPDX-License-Identifier: BSD-3-Clause
//
// What a session knows of the fields of a step.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "adaptor/common/adaptor_error.h"
#include "adaptor/run/session.h"

namespace vestige {

const PlannedField* Session::Fields::find(const std::string& name) const {
  const auto in = [&](const std::vector<PlannedField>& list) -> const PlannedField* {
    const auto found = std::find_if(list.begin(), list.end(),
                                    [&](const PlannedField& plan) { return plan.name == name; });
    return found == list.end() ? nullptr : &*found;
  };
  const PlannedField* found = in(plans);
  for (const auto& classifier : classifiers) {
    if (!found) found = in(classifier.fields);
  }
  for (const auto& plan : plans) {
    if (!found) found = in(plan.terms);
  }
  return found;
}

const FieldStatistics& Session::statisticsOf(Fields& fields, const std::string& name,
                                             StepTimes& times) {
  const auto known = fields.statistics.find(name);
  if (known != fields.statistics.end()) return known->second;
  const PlannedField* found = fields.find(name);
  if (!found) {
    throw AdaptorError(VESTIGE_ERROR_NO_FIELD,
                       fmt::format("[trigger] change: field '{}' is not among those stored", name));
  }
  PlannedField plan = *found;
  completeNorm(fields, plan, times);
  const Stopwatch watch;
  auto measured = measureField(partsOf(plan, blocks_), threads_, settled_.endsOf(plan));
  times.ingest += watch.seconds();
  return fields.statistics.emplace(name, std::move(measured)).first->second;
}

void Session::completeNorm(Fields& fields, PlannedField& plan, StepTimes& times) {
  if (plan.ranges.size() == plan.terms.size()) return;
  for (const PlannedField& term : plan.terms)
    plan.ranges.push_back(settled_.scaleOf(term, statisticsOf(fields, term.name, times)));
}

FieldDomain Session::domainOf(Fields& fields, const PlannedField& plan, StepTimes& times) {
  const auto& statistics = statisticsOf(fields, plan.name, times);
  return fieldDomain(settled_.classificationOf(plan, statistics, 1.0).partition, statistics);
}

bool Session::isTooWide(Fields& fields, const PlannedField& plan, StepTimes& times) {
  for (const PlannedField& term : plan.terms)
    if (isTooWide(fields, term, times)) return true;
  const auto& statistics = statisticsOf(fields, plan.name, times);
  return !std::isfinite(statistics.high - statistics.low);
}

void Session::leaveOutTooWide(Fields& fields, std::int64_t cycle, StepTimes& times) {
  const bool all = config_.makesFields();
  std::set<std::string> left;
  const auto without = [&](const PlannedField& plan) {
    if (!isTooWide(fields, plan, times)) return false;
    const auto own = fields.statistics.find(plan.name);
    if (own != fields.statistics.end())
      warnings_.ofSamples(plan, own->second, blocks_, threads_);  // it may be a fill value
    left.insert(plan.name);
    return true;
  };
  if (all) std::erase_if(fields.plans, without);
  std::erase_if(fields.classifiers, [&](const PlannedClassifier& each) {
    // Settled ones know their domains, in which such values are far beyond.
    if (settled_.featuresOf(each.config.name)) return false;
    const bool out = std::any_of(each.fields.begin(), each.fields.end(), without);
    if (out) left.insert(each.config.name);
    return out;
  });
  if (left.empty()) return;
  std::string wide;
  for (const auto& [name, statistics] : fields.statistics) {
    if (std::isfinite(statistics.high - statistics.low)) continue;
    wide += fmt::format("{}'{}' has values from {:.6g} to {:.6g}", wide.empty() ? "" : ", ", name,
                        statistics.low, statistics.high);
  }
  const std::string sentence = fmt::format(
      "cycle {} is stored without '{}': field {}, farther apart than a double can say (1.8e308); "
      "share it in another unit, or, if such values stand for no data, say so: no_data in its "
      "[[field]]",
      cycle, fmt::join(left, "', '"), wide);
  if ((!all || fields.plans.empty()) && fields.classifiers.empty())
    throw AdaptorError(VESTIGE_ERROR_FIELD, sentence);
  log_.warning(sentence);
}

}  // namespace vestige
