// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "explorer/features/field_bundle.h"
#include "explorer/picture/look.h"
#include "explorer/picture/stretch.h"
#include "explorer/volume/grid_painter.h"
#include "explorer/volume/volume_pass.h"

namespace vestige {

/// Fields of a step, classified together by any classifier (stored fields, or what stacks say of
/// them). Made, used and destroyed in Device::run.
class ClassifiedSource {
 public:
  /// Throws NotFound naming a field that is not there.
  ClassifiedSource(const Archive& archive, long cycle, const std::vector<std::string>& fields);

  bool is(long cycle, const std::vector<std::string>& fields) const {
    return cycle == cycle_ && fields == bundle_.fields;
  }
  const Box& domain() const { return bundle_.domain; }
  /// The classifier with its defaults filled in from what is known of the fields.
  std::unique_ptr<Classifier> resolved(const Classifier& classifier, double referenceLength) const {
    return classifier.resolved(bundle_.domains, referenceLength);
  }
  /// Volume or slice, cut by the look's clip box, lit and occluded. `classifier` is resolved.
  VolumeView draw(const Look& look, const Classifier& classifier, double referenceLength,
                  const Camera& camera, ImageSize size);
  /// The greatest value of the first field along each ray, in the function's colours.
  VolumeView drawMaximum(const Look& look, const TransferFunction& function, const Camera& camera,
                         ImageSize size);
  /// What it is, in a sentence.
  std::string note() const;

 private:
  void prepareGrid(const Classifier& normalised);
  void prepareFirst();
  /// Normals of the grid: of the one field, from baked_ or from the classifier's densities.
  void findGradients(const ClassifiedLook& look);

  /// Moves values (and gradient norms) by as much as they may be wrong, times `way`.
  using Moved =
      std::function<void(double way, std::vector<float>& values, std::vector<float>& norms)>;
  /// Adds how far the picture changes with what is moved, whichever way changes it more.
  void addDoubt(const Moved& moved, VolumeSetup setup, const Picture& likely,
                std::vector<float>& doubt);
  /// RenderedView::doubt: the sum over the fields, and over gradients where the classifier asks.
  std::vector<float> doubtOf(const VolumeSetup& setup, const Picture& likely);

  long cycle_;
  FieldBundle bundle_;
  VolumePass pass_;
  Stretch stretch_;  ///< of the grid
  std::optional<LookGrid> grid_;
  std::optional<LookGrid> baked_;  ///< its optics, for light
  std::optional<OcclusionGrid> occlusion_;
  std::optional<LookGrid> first_;  ///< the first field alone, for maxima and normals
  GridPainter painter_;            ///< of it
  std::optional<CustomTextures> custom_;
  std::string key_, occlusionKey_;  ///< of the look that baked_ and the bricks belong to
};

}  // namespace vestige
