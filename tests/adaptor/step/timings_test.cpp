// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/step/timings.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "adaptor/config/config.h"

namespace vestige {
namespace {

class TimingsTest : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::remove(file_); }
  void TearDown() override { std::filesystem::remove(file_); }
  std::filesystem::path file_ =
      std::filesystem::path(testing::TempDir()) /
      (std::string("vestige_timings_") +
       testing::UnitTest::GetInstance()->current_test_info()->name() + ".csv");
};

TEST_F(TimingsTest, HeaderOnceThenOneLineAStep) {
  StepTimes times;
  times.ingest = 0.25;
  times.write = 1.5;
  appendTimings(file_, timingsLine(10, 0.5, times, 4096, 77));
  appendTimings(file_, timingsLine(20, 1.0, times, 4096, 78));
  EXPECT_EQ(readTextFile(file_.string()),
            std::string(kTimingsHeader) +
                "10,0.5,0.250000,0.000000,0.000000,0.000000,0.000000,1.500000,4096,77\n"
                "20,1,0.250000,0.000000,0.000000,0.000000,0.000000,1.500000,4096,78\n");
}

TEST_F(TimingsTest, TornLastLineOfADeadRunStaysALineOfItsOwn) {
  std::FILE* file = std::fopen(file_.c_str(), "wb");
  std::fputs((std::string(kTimingsHeader) + "10,0.5,0.2").c_str(), file);
  std::fclose(file);
  appendTimings(file_, timingsLine(20, 1.0, {}, 0, 0));
  EXPECT_NE(readTextFile(file_.string()).find("10,0.5,0.2\n20,1,"), std::string::npos);
}

TEST(Timings, PeakMemoryIsThatOfThisProcess) {
  EXPECT_GT(peakMemory(), std::uint64_t(1) << 20);
  EXPECT_LT(peakMemory(), std::uint64_t(1) << 40);
}

}  // namespace
}  // namespace vestige
