// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/statistics.h"

#include <nlohmann/json.hpp>

#include "proxy/error.h"

namespace vestige {

nlohmann::json toJson(const FieldStatistics& s) {
  return {{"count", s.count}, {"noData", s.noData}, {"low", s.low},
          {"high", s.high},   {"mean", s.mean},     {"deviation", s.deviation},
          {"histogram", s.histogram}};
}

FieldStatistics statisticsFromJson(const nlohmann::json& json) {
  try {
    FieldStatistics s;
    json.at("count").get_to(s.count);
    json.at("noData").get_to(s.noData);
    json.at("low").get_to(s.low);
    json.at("high").get_to(s.high);
    json.at("mean").get_to(s.mean);
    json.at("deviation").get_to(s.deviation);
    json.at("histogram").get_to(s.histogram);
    return s;
  } catch (const nlohmann::json::exception& e) {
    throw Error(ErrorCode::Format, std::string("field statistics: ") + e.what());
  }
}

}  // namespace vestige
