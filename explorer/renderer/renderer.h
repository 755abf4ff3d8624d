// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "explorer/picture/look.h"
#include "explorer/picture/picture.h"
#include "explorer/picture/trust.h"
#include "proxy/archive/archive.h"
#include "proxy/gl/device.h"

namespace vestige {

/// What of a look changes nothing or shows nothing, and why: `key` of the look, a sentence.
struct Warning {
  std::string key, text;
  friend bool operator==(const Warning&, const Warning&) = default;
};

/// What a picture was made of. Grid: a field or stacks, drawn as the look's `draw` says;
/// PlainLayers: depth layers without intervals, each of one opacity; Stack: that of the stored
/// view, recomposed.
enum class Answer {
  Lengths,
  Attenuation,
  Layers,
  PlainLayers,
  Virtual,
  Stack,
  Grid,
  Mip,
  Reference,
  Layered,
  Learned,
  Features,
  Classified
};

/// A picture and how it came about.
struct Rendered {
  Picture picture;  ///< annotated, over its background
  Camera camera;    ///< of the picture, in the scene of the look's scale (stretch.h)
  glm::dmat4 worldFromScene{1.0};
  bool cast = false;         ///< drawn for this camera; else a window of the stored view's pixels
  std::vector<float> depth;  ///< layers, grids: [pixel] planar Z of the nearest surface, else empty
  std::vector<Trust> trust;  ///< [pixel] before fitting to the look's size; empty unless asked for
  TrustShares shares;        ///< of `trust`
  Answer answer = Answer::Lengths;
  std::vector<Warning> warnings;   ///< each once
  std::vector<std::string> notes;  ///< which proxy answered and why, one sentence each
};

/// Makes pictures of one archive from looks. Decoded proxies stay on the GPU, so that the next edit
/// of the same step and view costs one pass. Not thread-safe.
class Renderer {
 public:
  Renderer(std::shared_ptr<gl::Device> device, std::shared_ptr<const Archive> archive);
  ~Renderer();

  /// Throws Config for a look that makes no sense, NotFound naming what the archive has instead.
  Rendered render(const Look& look);

  /// The look with what it leaves to the archive filled in: step, field, view, and the run's
  /// opacity, reference length, colour map and range in the field's units, or its classifier's
  /// centres and widths. Any archive draws it the same.
  Look resolved(const Look& look);

  /// The run's own picture of the look's step, field and view, and the one that the view's stack
  /// makes of the same transfer function: the measured error of the stack. Nothing when the view
  /// does not store both, or the picture is lit.
  struct OwnLook {
    std::string view;
    Picture stored, made;
  };
  std::optional<OwnLook> ownLook(const Look& look);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The step that a look speaks of: its cycle, the step nearest to its time, or the last. Throws
/// NotFound naming the cycles there are.
long cycleOf(const Look& look, const Archive& archive);

}  // namespace vestige
