// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/base/nearest_word.h"

#include <algorithm>

namespace vestige {
namespace {

std::string lower(std::string word) {
  for (char& c : word)
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  return word;
}

}  // namespace

std::string nearestWord(const std::string& word, const std::vector<std::string>& candidates) {
  std::string best;
  // Of a short word no more than all but one letter may be wrong.
  std::size_t least = std::min(std::max<std::size_t>(2, word.size() / 3) + 1, word.size());
  for (const auto& candidate : candidates) {
    if (lower(candidate) == lower(word)) return candidate;
    // Levenshtein's distance, one row at a time.
    std::vector<std::size_t> row(candidate.size() + 1);
    for (std::size_t j = 0; j < row.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= word.size(); ++i) {
      std::size_t diagonal = row[0];
      row[0] = i;
      for (std::size_t j = 1; j < row.size(); ++j) {
        const std::size_t replaced = diagonal + (word[i - 1] == candidate[j - 1] ? 0 : 1);
        diagonal = row[j];
        row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
      }
    }
    if (row.back() < least) {
      least = row.back();
      best = candidate;
    }
  }
  return best;
}

std::string didYouMean(const std::string& word, const std::vector<std::string>& candidates) {
  const std::string near = nearestWord(word, candidates);
  return near.empty() || near == word ? "" : " (did you mean '" + near + "'?)";
}

std::string optionHints(const std::vector<std::string>& options,
                        std::span<const char* const> arguments) {
  std::string hints;
  for (const char* argument : arguments) {
    const std::string text(argument), name = text.substr(0, text.find('='));
    if (!name.starts_with("--")) continue;
    if (std::find(options.begin(), options.end(), name) != options.end()) continue;
    std::vector<std::string> bare;
    for (const std::string& option : options) bare.push_back(option.substr(2));
    const std::string near = nearestWord(name.substr(2), bare);
    if (!near.empty()) hints += "No option is called " + name + ": did you mean --" + near + "?\n";
  }
  return hints;
}

}  // namespace vestige
