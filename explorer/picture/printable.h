// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace vestige {

/// A text for a terminal: names and units come from archives that anyone may have written. Control
/// characters, but for line breaks and tabs, become "\\x1b"; other bytes stay as they are.
std::string printable(const std::string& text);

}  // namespace vestige
