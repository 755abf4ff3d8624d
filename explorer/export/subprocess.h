// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace vestige {

/// A program that reads what we write to its standard input. No shell is involved; the program is
/// looked for in PATH. What it prints is kept for error messages.
class Subprocess {
 public:
  /// Throws NotFound when the program cannot be started.
  explicit Subprocess(std::vector<std::string> arguments);
  ~Subprocess();
  Subprocess(const Subprocess&) = delete;
  Subprocess& operator=(const Subprocess&) = delete;

  /// Throws Io with the program's last line when it stopped reading.
  void write(std::span<const std::byte> bytes);
  /// Closes its input and waits; returns what it printed. Throws Io when it failed.
  std::string finish();

 private:
  std::string printed() const;
  void closeInput();
  std::string reason();
  std::string name_;
  pid_t pid_ = -1;
  int input_ = -1, output_ = -1;
};

}  // namespace vestige
