// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace vestige {

/// Whether the process has a standard error stream: one that it was given, not a file of its own
/// that took the number after it was closed.
bool hasStandardError();

/// Writes `line` and a line end to the standard error stream, if there is one, in one piece. No
/// signal of that write (a closed pipe, a full file) reaches the host. Throws nothing.
void printLine(std::string line) noexcept;

}  // namespace vestige
