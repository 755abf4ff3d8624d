// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace vestige {

/// A tick of a scale: a round value and its text.
struct Tick {
  double value;
  std::string text;
};

/// The ticks of a scale. Their texts have equally many decimals and a handful of digits: what is
/// large or small is divided by a power of ten, what differs in its last digits alone has an offset
/// taken away, and `scale` says so: "×10⁻⁶", "+101325"; value = text × power + offset.
struct Ticks {
  std::vector<Tick> ticks;
  std::string scale;
};

/// About `wanted` ticks at round values inside [low, high]; none unless low < high, both finite.
Ticks ticksOf(double low, double high, int wanted = 6);

/// A number for people: six digits, powers of ten written out ("1.5×10⁻⁹").
std::string numberText(double value);

}  // namespace vestige
