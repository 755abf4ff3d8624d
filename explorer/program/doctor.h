// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace vestige {

/// One thing that the explorer needs or can use: what was found, or how to mend it.
struct Diagnosis {
  std::string name;
  bool works = false;
  bool needed = false;  ///< the explorer cannot make pictures without it
  std::string finding;
  std::string mend;  ///< empty where it works
};

/// Looks at versions, both GL backends with a self-test picture, threads, font and ffmpeg. At least
/// one GL backend is needed: each is marked as needed when the other does not work.
std::vector<Diagnosis> diagnose();

}  // namespace vestige
