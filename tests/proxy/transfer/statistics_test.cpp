// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/transfer/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "proxy/base/error.h"

namespace vestige {
namespace {

using nlohmann::json;

const FieldStatistics kStatistics{~std::uint64_t(0), 3, -1.5, 1.0 / 3.0, 0.1, 0.2, {1, 0, 7}};

TEST(FieldStatistics, SurviveJson) {
  EXPECT_EQ(statisticsFromJson(json::parse(toJson(kStatistics).dump())), kStatistics);
  EXPECT_EQ(statisticsFromJson(toJson(FieldStatistics{})), FieldStatistics{});
}

void expectRefused(const json& j, const std::string& key) {
  try {
    statisticsFromJson(j);
    ADD_FAILURE() << j;
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::Format);
    EXPECT_NE(std::string(e.what()).find(key), std::string::npos) << e.what();
  }
}

TEST(FieldStatistics, KeepMomentsThatOverflowed) {
  json j = toJson(kStatistics);
  j["mean"] = -HUGE_VAL;
  j["deviation"] = std::nan("");
  EXPECT_EQ(statisticsFromJson(j).mean, -HUGE_VAL);
  EXPECT_TRUE(std::isnan(statisticsFromJson(j).deviation));
}

TEST(FieldStatistics, NameTheKeyThatHostileJsonSpoils) {
  const std::pair<const char*, json> spoiled[] = {
      {"count", -1},        {"count", 1.5},
      {"count", 1e30},      {"count", "many"},
      {"noData", nullptr},  {"noData", true},
      {"low", nullptr},     {"low", 1e30},
      {"high", "x"},        {"high", std::nan("")},
      {"mean", json()},     {"mean", json::array()},
      {"deviation", -1e-9}, {"deviation", json::object()},
      {"histogram", 5},     {"histogram", {1, -1}},
      {"histogram", {0.5}}, {"histogram", std::vector<int>(65537, 1)}};
  for (const auto& [key, value] : spoiled) {
    json j = toJson(kStatistics);
    j[key] = value;
    expectRefused(j, key);
    j.erase(key);
    expectRefused(j, key);
  }
  json j = toJson(kStatistics);
  j["count"] = 2;  // fewer than noData
  expectRefused(j, "noData");
  expectRefused(json::array(), "no object");
}

TEST(FieldStatistics, SayWhatShareIsOutsideOfTheIntervals) {
  FieldStatistics statistics = kStatistics;
  statistics.count = 103;
  statistics.below = 10;
  statistics.above = 15;
  EXPECT_EQ(statistics.shareOutside(), 0.25) << "of those with data";
  const json written = toJson(statistics);
  EXPECT_EQ(statisticsFromJson(written), statistics);
  // Archives from before they were counted.
  json earlier = written;
  earlier.erase("below");
  earlier.erase("above");
  EXPECT_EQ(statisticsFromJson(earlier).shareOutside(), 0.0);
  json wrong = written;
  wrong["above"] = 91;
  expectRefused(wrong, "above");
  wrong["above"] = -1;
  expectRefused(wrong, "above");
  EXPECT_EQ(FieldStatistics{}.shareOutside(), 0.0);
}

}  // namespace
}  // namespace vestige
