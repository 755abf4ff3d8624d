// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>
#include <vector>

#include "proxy/base/nearest_word.h"

namespace minisim {

/// After a wrong command line: which option was meant, on standard error.
inline void hintAtOptions(const CLI::App& app, int argc, char** argv) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  const std::string hints = vestige::optionHints(names, {argv + 1, std::size_t(argc - 1)});
  std::fputs(hints.c_str(), stderr);
}

}  // namespace minisim
