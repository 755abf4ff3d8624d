// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/picture/trust.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace vestige {
namespace {

constexpr float kVisible = 1.0f / 255.0f;
constexpr float kTint = 0.6f;
constexpr std::array<std::array<float, 3>, 3> kTints{
    {{0.0f, 0.0f, 0.0f}, {1.0f, 0.45f, 0.0f}, {0.85f, 0.0f, 0.75f}}};

}  // namespace

void raiseDoubt(std::vector<float>& doubt, const Picture& likely, const Picture& other) {
  for (std::size_t i = 0; i < doubt.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      doubt[i] = std::max(doubt[i], std::abs(likely.rgba[4 * i + c] - other.rgba[4 * i + c]));
}

std::vector<Trust> trustFromDoubt(std::span<const float> doubt) {
  std::vector<Trust> trust(doubt.size());
  std::transform(doubt.begin(), doubt.end(), trust.begin(), [](float value) {
    return value <= kDoubtData    ? Trust::Data
           : value <= kDoubtGuess ? Trust::Interpolation
                                  : Trust::Guess;
  });
  return trust;
}

std::vector<Trust> trustFromDoubt(std::span<const float> doubt, std::span<const float> guess) {
  std::vector<Trust> trust = trustFromDoubt(doubt);
  for (std::size_t i = 0; i < trust.size(); ++i)
    if (guess[i] > kStretchGuess) trust[i] = Trust::Guess;
  return trust;
}

std::vector<Trust> trustFromStretch(std::span<const float> guess, const Picture& picture) {
  std::vector<Trust> trust(guess.size());
  for (std::size_t i = 0; i < guess.size(); ++i) {
    trust[i] = guess[i] > kStretchGuess             ? Trust::Guess
               : picture.rgba[4 * i + 3] > kVisible ? Trust::Interpolation
                                                    : Trust::Data;
  }
  return trust;
}

TrustShares sharesOf(std::span<const Trust> trust, const Picture& picture) {
  std::array<std::size_t, 3> counts{};
  std::size_t all = 0;
  for (std::size_t i = 0; i < trust.size(); ++i) {
    if (picture.rgba[4 * i + 3] <= kVisible && trust[i] != Trust::Guess) continue;
    ++counts[std::size_t(trust[i])];
    ++all;
  }
  if (all == 0) return {};
  const auto share = [&](std::size_t i) { return double(counts[i]) / double(all); };
  return {share(0), share(1), share(2)};
}

void overlayTrust(Picture& picture, std::span<const Trust> trust) {
  for (std::size_t i = 0; i < trust.size(); ++i) {
    if (trust[i] == Trust::Data) continue;
    float* pixel = picture.rgba.data() + 4 * i;
    const float alpha = std::max(pixel[3], 0.25f);  // a doubtful void must show as well
    const auto& tint = kTints[std::size_t(trust[i])];
    for (std::size_t c = 0; c < 3; ++c) {
      pixel[c] = (1.0f - kTint) * pixel[c] + kTint * alpha * tint[c];
    }
    pixel[3] = alpha;
  }
}

}  // namespace vestige
