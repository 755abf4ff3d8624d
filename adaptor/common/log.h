// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "adaptor/include/vestige.h"

namespace vestige {

/// Sentences for the host's log callback, kept until the host's own thread hands them over.
class Log {
 public:
  void info(std::string sentence) { lines_.emplace_back(VESTIGE_INFO, std::move(sentence)); }
  void warning(std::string sentence) { lines_.emplace_back(VESTIGE_WARNING, std::move(sentence)); }
  void error(std::string sentence) { lines_.emplace_back(VESTIGE_ERROR, std::move(sentence)); }
  std::vector<std::pair<int, std::string>> take() { return std::exchange(lines_, {}); }

 private:
  std::vector<std::pair<int, std::string>> lines_;
};

}  // namespace vestige
