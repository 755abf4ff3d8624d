// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "explorer/gpu/gpu.h"
#include "explorer/gpu/rendered_view.h"
#include "explorer/picture/stretch.h"
#include "explorer/recomposition/decode.h"
#include "explorer/recomposition/edit_pass.h"

namespace vestige {

/// The opacity lengths of a multi-perspective view as virtual rays meet them: in every pixel a list
/// of intervals in the order in which they start along its ray, three words an entry. The first is
/// that of SegmentLists (amount / unit, channel, kAmbiguous where the start is only likely, kLast),
/// the others the depths of the start and the end as floats' bits; several runs are taken to lie
/// evenly about their mean depth. `first` [pixel] counts words.
struct SheetTextures {
  Camera camera;
  ImageSize size;
  Box domain;
  double unit = 1.0;
  gl::Texture first, entries;

  /// Throws Config for another camera.
  explicit SheetTextures(const LengthPlanes& lengths);
};

/// A view by virtual ray marching; depth: where half of the light is gone.
using VirtualView = RenderedView;

/// Volumetric view synthesis [Tikhonova 2010, §4.3.1]. A new ray is marched through the box;
/// its point (ρ, Z) belongs to the pixel r = ρ + Z/κ of the stored picture. Where its effective
/// distortion Z/κ has passed that of the start of an interval there, the interval's whole opacity
/// under the current look is added, once a ray; but not beyond the interval's end, where the paper
/// would add it too and so draw a shadow. A guess: intervals whose start is only likely, and space
/// outside of the stored picture. Made, used and destroyed in Device::run.
class VirtualPass {
 public:
  /// Where a point looks its pixel up: where the stored rays saw it, or, as the paper has it, at
  /// its undistorted place (r = ρ), kept to be compared (method §3).
  enum class Lookup { Distorted, Undistorted };

  /// `target` is orthographic or perspective, else InvalidArgument, in the scene of `stretch`.
  VirtualView render(const SheetTextures& sheets, const ChannelTable& table, const Camera& target,
                     ImageSize size, Lookup lookup = Lookup::Distorted,
                     const Stretch& stretch = {});

 private:
  std::optional<gl::Program> program_;
  gl::Framebuffer framebuffer_;
  gl::VertexArray empty_;
};

}  // namespace vestige
