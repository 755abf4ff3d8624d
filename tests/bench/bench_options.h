// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace vestige::test {

/// The command line that tests/bench/run.py gives every bench: --seeds A..B LINE...
struct BenchOptions {
  std::uint64_t firstSeed = 1, lastSeed = 20;
  std::vector<std::string> lines;

  BenchOptions(int argc, char** argv) {
    for (int i = 1; i < argc; ++i) {
      const std::string argument = argv[i];
      if (argument != "--seeds") {
        lines.push_back(argument);
        continue;
      }
      const std::string range = ++i < argc ? argv[i] : "";
      const std::size_t dots = range.find("..");
      if (dots == std::string::npos)
        throw std::runtime_error("--seeds '" + range + "' is not A..B");
      firstSeed = std::stoull(range.substr(0, dots));
      lastSeed = std::stoull(range.substr(dots + 2));
      if (lastSeed < firstSeed) throw std::runtime_error("--seeds '" + range + "' is empty");
    }
  }
  bool wants(const std::string& line) const {
    return std::find(lines.begin(), lines.end(), line) != lines.end();
  }
  bool wantsAny(const std::string& prefix) const {
    return std::any_of(lines.begin(), lines.end(),
                       [&](const std::string& line) { return line.starts_with(prefix); });
  }
};

}  // namespace vestige::test
