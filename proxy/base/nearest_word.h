// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

namespace vestige {

/// The candidate with the smallest edit distance, or "" if none is near.
std::string nearestWord(const std::string& word, const std::vector<std::string>& candidates);

/// " (did you mean 'front'?)", or "" if none is near: to follow a word that is unknown.
std::string didYouMean(const std::string& word, const std::vector<std::string>& candidates);

/// A line for each argument that begins with "--" and is none of a program's options ("--size")
/// but near to one; "" where there is none.
std::string optionHints(const std::vector<std::string>& options,
                        std::span<const char* const> arguments);

}  // namespace vestige
