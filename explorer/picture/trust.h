// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "explorer/picture/picture.h"

namespace vestige {

/// How far a pixel can be believed (docs/exploring.md "Trust").
enum class Trust : std::uint8_t {
  Data = 0,           ///< follows from what is stored
  Interpolation = 1,  ///< between stored samples, or small doubt about an order
  Guess = 2,          ///< space that no proxy saw, or an order that is not stored and matters
};

/// Doubt (EditPass::doubt) is the largest change of a linear colour that a different order of the
/// segments could make. Up to 2/255 is data, up to 0.1 interpolation, more a guess.
inline constexpr float kDoubtData = 2.0f / 255.0f;
inline constexpr float kDoubtGuess = 0.1f;
/// The guessed share of a warped pixel (WarpedView::guess) above which it is a guess.
inline constexpr float kStretchGuess = 0.05f;

/// Raises the doubt [pixel] of a picture to how far its linear colours are from those of another
/// one, which might as well be true.
void raiseDoubt(std::vector<float>& doubt, const Picture& likely, const Picture& other);

std::vector<Trust> trustFromDoubt(std::span<const float> doubt);
/// For grids of values that say how far they may be wrong: by doubt, but a guess where the guessed
/// share is more than kStretchGuess.
std::vector<Trust> trustFromDoubt(std::span<const float> doubt, std::span<const float> guess);
/// For warped layers: never better than interpolation where something is drawn.
std::vector<Trust> trustFromStretch(std::span<const float> guess, const Picture& picture);

/// Counts of the three classes over pixels that show something (alpha > 1/255) or might.
struct TrustShares {
  double data = 1.0, interpolation = 0.0, guess = 0.0;
};
TrustShares sharesOf(std::span<const Trust> trust, const Picture& picture);

/// Tints interpolation amber and guesses magenta; data stay as they are.
void overlayTrust(Picture& picture, std::span<const Trust> trust);

}  // namespace vestige
