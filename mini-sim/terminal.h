// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <string>

namespace minisim {

/// Progress on standard error: a bar that redraws itself on a terminal, else a line at each tenth.
class Progress {
 public:
  /// `unit` in the plural, e.g. "steps".
  Progress(long total, std::string unit, bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// True when a call of show would print; ask before making a costly note.
  bool due(long done) const;
  void show(long done, const std::string& note);
  /// Prints a line of its own without tearing the bar.
  void say(const std::string& line);

 private:
  using Clock = std::chrono::steady_clock;
  long total_;
  std::string unit_;
  bool quiet_, terminal_;
  bool barShown_ = false;
  Clock::time_point shownAt_{};
};

/// While it lives the first SIGINT or SIGTERM only sets a flag; the second one kills as usual.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
  static bool interrupted();
};

}  // namespace minisim
