// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/transfer/statistics.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "proxy/base/error.h"
#include "proxy/transfer/interval_partition.h"

namespace vestige {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxBins = 65536;

[[noreturn]] void refuse(std::string_view key, std::string_view problem) {
  throw Error(ErrorCode::Format, fmt::format("field statistics: {} {}", key, problem));
}

const json& member(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end()) refuse(key, "is missing");
  return *found;
}

/// Counts are whole numbers as written: the library would silently convert -1 and 1e30.
std::uint64_t count(const json& value, const char* key) {
  if (value.is_number_unsigned()) return value.get<std::uint64_t>();
  if (value.is_number_integer() && value.get<std::int64_t>() >= 0)
    return value.get<std::uint64_t>();
  refuse(key, "is no count");
}

double number(const json& object, const char* key) {
  const json& value = member(object, key);
  if (!value.is_number()) refuse(key, "is no number");
  return value.get<double>();
}

}  // namespace

bool reachesBeyond(const FieldStatistics& statistics, const IntervalPartition& intervals) {
  const double near = 0.001 * (intervals.high() - intervals.low());
  return intervals.low() - statistics.low > near || statistics.high - intervals.high() > near;
}

json toJson(const FieldStatistics& s) {
  return {{"count", s.count},         {"noData", s.noData}, {"low", s.low},
          {"high", s.high},           {"mean", s.mean},     {"deviation", s.deviation},
          {"histogram", s.histogram}, {"below", s.below},   {"above", s.above}};
}

FieldStatistics statisticsFromJson(const json& object) {
  if (!object.is_object()) refuse("the whole", "is no object");
  FieldStatistics s;
  s.count = count(member(object, "count"), "count");
  s.noData = count(member(object, "noData"), "noData");
  if (s.noData > s.count) refuse("noData", fmt::format("{} exceeds count {}", s.noData, s.count));
  s.low = number(object, "low");
  s.high = number(object, "high");
  if (!std::isfinite(s.low) || !std::isfinite(s.high)) refuse("low or high", "is not finite");
  if (s.low > s.high) refuse("low", fmt::format("{} exceeds high {}", s.low, s.high));
  s.mean = number(object, "mean");
  s.deviation = number(object, "deviation");
  if (s.deviation < 0.0) refuse("deviation", fmt::format("{} is negative", s.deviation));
  const json& bins = member(object, "histogram");
  if (!bins.is_array()) refuse("histogram", "is no list");
  if (bins.size() > kMaxBins) refuse("histogram", fmt::format("has {} bins", bins.size()));
  for (const json& bin : bins) s.histogram.push_back(count(bin, "histogram"));
  // Earlier writers did not count them.
  if (object.contains("below")) s.below = count(object["below"], "below");
  if (object.contains("above")) s.above = count(object["above"], "above");
  const std::uint64_t finite = s.count - s.noData;
  if (s.below > finite || s.above > finite - s.below)
    refuse("below or above", fmt::format("are more than {} samples", finite));
  return s;
}

}  // namespace vestige
