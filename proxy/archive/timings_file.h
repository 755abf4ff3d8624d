// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace vestige {

/// timings.csv as far as it concerns the archive: a line is written after the rows of its step, so
/// it names no step that the table does not name (docs/archive-format.md, "Crash safety").
struct TimingsFile {
  struct Step {
    int line;  ///< number in the file, from 1
    long cycle;
    std::optional<double> time;  ///< where there is such a column
  };
  struct Problem {
    std::string text;
    bool leftover;  ///< what a run that was cut off leaves
  };
  std::vector<Step> steps;
  std::vector<Problem> problems;
};

/// Nothing when the file is missing. Throws Io.
TimingsFile readTimings(const std::filesystem::path& archive);

/// Drops the lines of other steps, and what is no whole line; a file without a whole first line
/// goes. Throws Io / NoSpace.
void keepTimings(const std::filesystem::path& archive, const std::function<bool(long)>& wanted);

}  // namespace vestige
