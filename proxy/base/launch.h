// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace vestige {

/// A process among several that a launcher (mpirun, srun, ...) started together.
struct Launch {
  std::string variable;  ///< of the environment, that says so
  int rank = -1;         ///< -1: not known
  int processes = 0;     ///< 0: not known, but more than one
  friend bool operator==(const Launch&, const Launch&) = default;
};

/// What the environment says; nothing for a process alone. Job scripts and interactive shells of
/// batch systems, whose variables are of the whole allocation, are alone.
std::optional<Launch> launchOf(const std::function<const char*(const char*)>& variable);

/// "process 0 of 2, alone": what provenance says of a process that wrote without the others, ...
std::string launchNote(const Launch& launch);
/// ... and whether a provenance says so.
std::optional<Launch> launchIn(std::string_view provenance);

}  // namespace vestige
