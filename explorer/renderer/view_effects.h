// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "explorer/renderer/renderer.h"

namespace vestige {

/// Pictures made of several views [Lochmann 2016, §4.3]. Angles in degrees about
/// the domain's centre, in the viewer's frame; for every source that can be turned.
struct ViewEffects {
  /// Angle between the two eyes; 0 = one. The left eye's picture stands to the left of the right's.
  double stereo = 0.0;
  /// Depth of field: the angle that the lens spans as seen from the domain's centre, where all is
  /// in focus; 0 = a pinhole.
  double aperture = 0.0;
  /// Motion blur: what the viewer turns by while the shutter is open, half of it before the look's
  /// own place.
  Rotation shutter{};
  int samples = 32;  ///< views of a lens or a shutter, 2 .. 4096

  bool none() const { return stereo == 0.0 && aperture == 0.0 && shutter.isZero(); }
  /// Throws Config naming the value unless every value is in its range: angles finite and at most
  /// 90, 360 for the shutter.
  void validate() const;
};

/// The rotation that turns the viewer by `rotation`, then by `offset` in the frame where it is
/// then.
Rotation composed(const Rotation& rotation, const Rotation& offset);

/// The rotations whose pictures are averaged for one eye: 0 for the only one, -1 and +1 for the
/// left and the right. Lens and shutter are sampled together.
std::vector<Rotation> viewsOf(const Rotation& rotation, const ViewEffects& effects, int eye);

/// The look with effects; averages are of linear light. Notes and warnings are those of the first
/// view, shares of trust means of all; camera, depth and trust are those of the last view, and
/// empty where pictures were averaged or joined.
Rendered renderWithEffects(Renderer& renderer, const Look& look, const ViewEffects& effects);

}  // namespace vestige
