// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "adaptor/march/marcher.h"
#include "proxy/classifier/classifier.h"

namespace vestige {

/// What a march of features is to make (method §5, classification §4).
struct FeatureRequest {
  Camera camera;
  ImageSize size;
  Box domain;                              ///< anchors the samples, so blocks agree
  double stepLength = 0.0;                 ///< as MarchRequest::stepLength
  const Classifier* classifier = nullptr;  ///< normalised, with channels
  std::vector<ChannelOptics> optics;       ///< [channel] of the run's look
  bool skipEmptySpace = true;              ///< skip bricks in which all channels vanish
};

/// Integrates a classifier's weights along rays through one block, on the GL device. Between
/// samples all fields are linear, and the mean weights of such a segment are Classifier::glsl()'s;
/// a segment that a face cuts keeps its gradient, so that its parts add up. Programs and buffers
/// are kept between calls.
class FeatureMarcher {
 public:
  explicit FeatureMarcher(std::shared_ptr<gl::Device> device);
  ~FeatureMarcher();

  /// Uploads a block, replacing the one before: normalised samples of the classifier's fields, in
  /// their order, on the same grid; for one that needsGradient() the gradient norm follows, 1 /
  /// world unit. As Marcher::upload.
  void upload(const BlockGrid& grid, std::span<const FillSlab> fields, int threads = 1);

  /// Whole rays: of the image, channels are the classifier's; there are entry, exit (a ray that
  /// meets nothing may count as a miss), length = ∫ w ds, moment = ∫ Z w ds, attenuation
  /// (feature_layout.h) and transmittance. compositeUnder() and RaySorter combine blocks. Throws Gl
  /// or InvalidArgument.
  RayImage march(const FeatureRequest& request);
  /// [slab][channel][pixel] ∫ w ds between the planar depths of an orthographic view, which rise;
  /// blocks add.
  std::vector<std::vector<float>> marchSlabs(const FeatureRequest& request,
                                             std::span<const double> depths);

  /// Seconds of the last upload and march.
  const MarchTimes& times() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vestige
