// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "explorer/picture/picture.h"
#include "proxy/camera/camera.h"
#include "proxy/classifier/classifier.h"
#include "proxy/gl/device.h"
#include "tests/support/scenes.h"

namespace vestige::test {

/// What a scene is drawn with, slice by slice, in a shader [Kniss 2003, Fig. 1].
struct SliceScene {
  const Scene* scene = nullptr;
  Camera camera;
  ImageSize size;
};

/// How a slab between two slices is classified: by Classifier::glsl() from the samples on both, or
/// (Riemann) at a sample in its middle.
enum class Slab { Analytic, Riemann };

struct SlicedPicture {
  Picture picture;
  double seconds = 0.0;  ///< of the pass alone, the least of `repeats`
};

/// The scene's value and gradient norm, as textures; pictures by a resolved classifier of the one
/// field between evenly spaced planes across the domain's depth, linear RGBA.
class SliceRenderer {
 public:
  SliceRenderer(gl::Device& device, const SliceScene& scene);
  SlicedPicture draw(const Classifier& classifier, double referenceLength, Slab slab, int slices,
                     int repeats = 1);

 private:
  gl::Device& device_;
  SliceScene scene_;
  FieldDomain domain_;
  std::vector<float> texels_;  ///< (value, gradient) normalised
};

}  // namespace vestige::test
