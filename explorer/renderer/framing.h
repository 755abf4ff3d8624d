// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/vec2.hpp>
#include <optional>

#include "explorer/picture/look.h"
#include "explorer/picture/stretch.h"

namespace vestige {

/// The camera whose picture of `to` shows all that it showed in a picture of `from`.
Camera fittedCamera(Camera camera, ImageSize from, ImageSize to);

/// What a look makes of a stored view's camera, which is orthographic or perspective and made for
/// pictures of `viewSize` (square pixels) of `domain`: turned, stretched, framed, zoomed and
/// panned, in the scene of the look's scale. To be passed through fittedCamera for the look's own
/// size, as the stored one; without any of these it is the stored one, to the last bit.
/// Orthographic frames grow in height; perspective viewers step back.
Camera framedCamera(const Look& look, const Camera& stored, ImageSize viewSize, const Box& domain);

/// A part of a picture, in its pixels; may reach beyond it.
struct PictureWindow {
  glm::dvec2 low{0.0}, high{0.0};
};
/// The part of a stored view's picture of `storedSize` that a camera shows in one of `size`: where
/// it looks from the same place along the same way. Nothing where it sees anything that the stored
/// picture cannot.
std::optional<PictureWindow> windowOf(const Camera& stored, ImageSize storedSize,
                                      const Camera& camera, ImageSize size);

/// A camera that looks along the way of a stored one, or the stored one itself, and shows what
/// `camera` does: no corner of the box moves by half a pixel of a picture of `size`. Nothing where
/// there is none. Both are made for pictures of `viewSize`.
std::optional<Camera> ontoStored(const Camera& stored, const Camera& camera, ImageSize viewSize,
                                 ImageSize size, const Box& box);

}  // namespace vestige
