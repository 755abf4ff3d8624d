// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "explorer/picture/picture.h"

namespace vestige {

/// A view that a pass has drawn.
struct RenderedView {
  Picture picture;           ///< premultiplied linear RGBA
  std::vector<float> depth;  ///< [pixel] planar Z, +inf = nothing there
  std::vector<float> guess;  ///< [pixel] share of the light that is a guess, in [0, 1]
  /// [pixel] how much a linear colour changes with values as far as they may be wrong; empty =
  /// nothing says how far.
  std::vector<float> doubt;
};

/// Reads the bound target: attachment 0 = colour, 1 = (planar depth, > 1e29 = nothing there; share
/// of guess). Inside Device::run.
RenderedView readDrawnView(ImageSize size);

}  // namespace vestige
