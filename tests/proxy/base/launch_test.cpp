// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/base/launch.h"

#include <gtest/gtest.h>

#include <map>

namespace vestige {
namespace {

std::optional<Launch> launchWith(const std::map<std::string, std::string>& environment) {
  return launchOf([&](const char* name) -> const char* {
    const auto found = environment.find(name);
    return found == environment.end() ? nullptr : found->second.c_str();
  });
}

TEST(Launch, SeveralProcessesAreTold) {
  EXPECT_EQ(launchWith({{"OMPI_COMM_WORLD_SIZE", "2"}, {"OMPI_COMM_WORLD_RANK", "1"}}),
            (Launch{"OMPI_COMM_WORLD_SIZE", 1, 2}));
  EXPECT_EQ(launchWith({{"PMI_SIZE", "16"}, {"PMI_RANK", "0"}}), (Launch{"PMI_SIZE", 0, 16}));
  EXPECT_EQ(launchWith({{"MV2_COMM_WORLD_SIZE", "3"}}), (Launch{"MV2_COMM_WORLD_SIZE", -1, 3}));
  EXPECT_EQ(
      launchWith({{"SLURM_NTASKS", "4"}, {"SLURM_STEP_NUM_TASKS", "4"}, {"SLURM_PROCID", "2"}}),
      (Launch{"SLURM_STEP_NUM_TASKS", 2, 4}));
  EXPECT_EQ(launchWith({{"PMIX_RANK", "1"}}), (Launch{"PMIX_RANK", 1, 0}));
}

TEST(Launch, ProcessesAloneAreLeftInPeace) {
  EXPECT_EQ(launchWith({}), std::nullopt);
  EXPECT_EQ(launchWith({{"OMPI_COMM_WORLD_SIZE", "1"}, {"OMPI_COMM_WORLD_RANK", "0"}}),
            std::nullopt);
  // The shell of an allocation, and an interactive step of one task in it.
  EXPECT_EQ(launchWith({{"SLURM_NTASKS", "64"}, {"SLURM_PROCID", "0"}, {"SLURM_JOB_ID", "7"}}),
            std::nullopt);
  EXPECT_EQ(launchWith({{"SLURM_NTASKS", "64"}, {"SLURM_STEP_NUM_TASKS", "1"}}), std::nullopt);
  EXPECT_EQ(launchWith({{"PMI_SIZE", "many"}, {"PMIX_RANK", ""}, {"PALS_RANKID", "-1"}}),
            std::nullopt);
}

TEST(Launch, NotesAreReadBack) {
  for (const Launch& launch : {Launch{"", 0, 2}, Launch{"", -1, 512}, Launch{"", 3, 0}}) {
    EXPECT_EQ(launchIn("vestige 0.1.0; llvmpipe; " + launchNote(launch) + "; budget: 3"), launch);
  }
  EXPECT_EQ(launchNote({"PMI_SIZE", 0, 2}), "process 0 of 2, alone");
  for (const char* other : {"", "vestige 0.1.0; llvmpipe", ", alone", "process , alone"}) {
    EXPECT_EQ(launchIn(other), std::nullopt) << other;
  }
}

}  // namespace
}  // namespace vestige
