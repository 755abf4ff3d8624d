// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace vestige::test {

/// A folder for each test, kept when the test fails.
class Scratch : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) /
              ("vestige-e2e-" + std::to_string(getpid()) + "-" + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override {
    if (HasFailure())
      std::fprintf(stderr, "kept: %s\n", folder_.c_str());
    else
      std::filesystem::remove_all(folder_);
  }
  std::filesystem::path write(const std::string& name, const std::string& text) {
    const auto file = folder_ / name;
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }

  std::filesystem::path folder_;
};

/// A configuration that is quick to make: small pictures of the temperature.
inline constexpr char kSmallConfig[] =
    "[image]\nwidth = 48\nheight = 48\n"
    "[output]\npath = \"plume.cdb\"\n"
    "[[field]]\nsource = \"temperature\"\nrange = [0.0, 1.0]\nintervals = 8\n";

}  // namespace vestige::test
