// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "mini-sim/plume.h"

namespace minisim {

/// What the command line of vestige-mini-sim says.
struct Options {
  PlumeParameters plume;
  long steps = 1000;
  bool doublePrecision = false;
  bool adaptor = true;
  std::string config;  ///< path; "" = the adaptor's defaults
  std::string output;  ///< archive; "" = what the configuration says
  long every = 0;      ///< offer every n-th cycle to the adaptor
  unsigned fields = kAllFields;
  bool announce = false;
  bool quiet = false;
};

/// Exit codes, as --help states them.
enum ExitCode { kDone = 0, kFailed = 1, kUsage = 2, kInterrupted = 130 };

/// Parses the command line; prints help or the error itself and then sets `exitCode`.
std::optional<Options> parseOptions(int argc, char** argv, int& exitCode);

/// "128" or "128,96,64" (also with x between). Throws std::invalid_argument naming the text.
std::array<int, 3> sizeFromText(const std::string& text);

}  // namespace minisim
