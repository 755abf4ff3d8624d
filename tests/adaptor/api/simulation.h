// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "adaptor/include/vestige.h"

namespace vestige::test {

/// A folder of its own for each test, removed at the end.
class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// A small picture, so that tests are quick.
inline constexpr const char* kSmallImage = "[image]\nwidth = 48\nheight = 40\n";

/// A smooth field on nx x ny x nz points of the unit cube, for every test to share.
struct Sample {
  explicit Sample(std::array<int, 3> size = {24, 20, 16});
  std::array<int, 3> size;
  std::vector<float> values;
  vestige_grid grid = VESTIGE_GRID_INIT;
};

/// Opens `output` with a configuration; log lines are collected.
class Simulation {
 public:
  Simulation(const std::string& output, const std::string& config = kSmallImage);
  ~Simulation() { vestige_close(session); }
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  /// Shares the sample as block 0's field "f" and executes.
  int step(const Sample& sample, int64_t cycle);
  std::string error() const { return vestige_last_error(session); }
  /// Whether a line of the log holds `part`.
  bool logged(const std::string& part) const;

  vestige_session* session = nullptr;
  int opened = VESTIGE_OK;
  std::vector<std::string> log;
};

/// Every file of a folder with its bytes, by relative path; without timings.csv, which differs from
/// run to run.
std::map<std::string, std::string> filesOf(const std::filesystem::path& folder);

/// What vestige-explorer check would find, as text; empty = sound. Leftovers are not counted.
std::string damageOf(const std::string& archive);
/// The cycles in the archive.
std::vector<long> cyclesOf(const std::string& archive);

/// For what runs in a child: leave it with what is wrong.
#define RETURN_UNLESS(condition)                                     \
  do {                                                               \
    if (!(condition)) return std::string(#condition) + " is not so"; \
  } while (false)
#define RETURN_UNLESS_OK(call)                                                               \
  do {                                                                                       \
    if (const int code = (call)) return std::string(#call) + ": " + vestige_code_name(code); \
  } while (false)

/// Runs `work` in a forked child and expects it to return "" there: a failure's text comes back,
/// and so does a death by signal. Fork before this process has made threads or GL contexts.
std::string inChild(const std::function<std::string()>& work);

}  // namespace vestige::test
