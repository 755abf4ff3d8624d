// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "proxy/classifier/classifier.h"
#include "tests/support/cpu_renderer.h"

// The truth about classifiers: rays through several raw fields in double precision on all cores,
// sharing no code with adaptor or explorer but Classifier::weights(), which its own tests hold
// against quadrature. Converges with `samplesPerVoxel`.

namespace vestige::test {

/// Fields over one grid, in the order of a classifier's fields(), and how they are normalised.
struct FieldScenes {
  std::vector<Scene> fields;
  std::vector<FieldDomain> domains;

  /// The ranges are the scenes' own, medians those of their values.
  explicit FieldScenes(std::vector<Scene> scenes);
  /// Values and, if asked for, the gradient norm at a point.
  FieldSample sample(const glm::dvec3& world, bool gradient) const;
};

/// What the pictures of renderClassified() share.
struct ClassifiedView {
  Camera camera;
  ImageSize size;
  int samplesPerVoxel = 4;
  /// By the headlight of MarchRequest::phong, from the gradient of the density [Drebin 1988] or,
  /// for classifiers without one, of the look's extinction; in the middle of every step.
  bool lit = false;
};

/// Pictures of one view with several looks, each the optics() of a resolved classifier, by
/// emission and absorption front to back (method §1), linear RGB over black. All looks share one
/// walk. Between samples at planar depths Z_0 + i step, Z_0 the least of the domain's corners, the
/// fields are linear.
std::vector<RgbPicture> renderClassified(const FieldScenes& scenes, const Classifier& classifier,
                                         std::span<const std::vector<ChannelOptics>> looks,
                                         const ClassifiedView& view);

/// The colours of greatest values along rays: of a classifier with a maximum().
RgbPicture renderMaximum(const FieldScenes& scenes, const Classifier& classifier,
                         const ClassifiedView& view);

}  // namespace vestige::test
