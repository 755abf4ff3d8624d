// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/annotation/ticks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace vestige {
namespace {

/// More digits than this tell values apart by an offset.
constexpr int kMostDigits = 6;
constexpr double kLargest = 1e6, kSmallest = 1e-3;  ///< that are written without a power of ten

int exponentOf(double value) { return value > 0.0 ? int(std::floor(std::log10(value))) : 0; }

/// "×10⁻⁶".
std::string powerText(int exponent) {
  constexpr const char* kDigits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = "×10";
  for (const char c : std::to_string(exponent)) text += c == '-' ? "⁻" : kDigits[c - '0'];
  return text;
}

std::string fixedText(double value, int decimals) {
  std::string text = fmt::format("{:.{}f}", value, decimals);
  // -0 is 0.
  if (text[0] == '-' && text.find_first_of("123456789") == std::string::npos) text.erase(0, 1);
  return text;
}

/// 1, 2 or 5 times a power of ten.
double roundStep(double rough) {
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  const double lead = rough / power;
  return power * (lead < 1.5 ? 1.0 : lead < 3.5 ? 2.0 : lead < 7.5 ? 5.0 : 10.0);
}

}  // namespace

Ticks ticksOf(double low, double high, int wanted) {
  if (!(high > low) || !std::isfinite(high - low)) return {};
  const double range = high - low, step = roundStep(range / std::max(wanted, 1));
  const double largest = std::max(std::abs(low), std::abs(high));
  double offset = 0.0;
  if (exponentOf(largest) - exponentOf(step) >= kMostDigits) {
    const double unit = std::pow(10.0, std::ceil(std::log10(range)) + 1.0);
    offset = std::floor(low / unit) * unit;
  }
  const double first = low - offset, last = high - offset;
  const double most = std::max(std::abs(first), std::abs(last));
  // Thousands, millions, ..., as units have prefixes.
  const int exponent =
      most >= kLargest || most < kSmallest ? 3 * int(std::floor(exponentOf(most) / 3.0)) : 0;
  const double power = std::pow(10.0, exponent);
  const int decimals = std::clamp(int(std::ceil(-std::log10(step / power) - 1e-9)), 0, 12);
  Ticks result;
  const double slack = 1e-9 * range;
  const auto end = std::int64_t(std::floor((last + slack) / step));
  for (auto i = std::int64_t(std::ceil((first - slack) / step)); i <= end; ++i) {
    const double value = double(i) * step;
    result.ticks.push_back({offset + value, fixedText(value / power, decimals)});
  }
  if (exponent != 0) result.scale = powerText(exponent);
  if (offset != 0.0) {
    result.scale += (exponent != 0 ? " " : "") + std::string(offset < 0.0 ? "−" : "+") +
                    (std::abs(offset) < 1e9 ? fmt::format("{:.12g}", std::abs(offset))
                                            : numberText(std::abs(offset)));
  }
  return result;
}

std::string numberText(double value) {
  const std::string text = fmt::format("{:.6g}", value);
  const std::size_t e = text.find('e');
  return e == std::string::npos ? text
                                : text.substr(0, e) + powerText(std::stoi(text.substr(e + 1)));
}

}  // namespace vestige
