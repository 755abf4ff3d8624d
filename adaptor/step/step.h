// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "adaptor/march/marcher.h"
#include "adaptor/plan/classification.h"
#include "adaptor/plan/stack_views.h"
#include "adaptor/plan/step_frame.h"
#include "adaptor/step/timings.h"
#include "proxy/archive/archive.h"
#include "proxy/camera/view_set.h"

namespace vestige {

/// A field, ready to be marched.
struct StepField {
  PlannedField plan;
  FieldStatistics statistics;
  Classification classification;
};

/// What the rays of a view gathered.
struct ViewRays {
  RayImage rays;
  std::optional<AnalyticLayerPlanes> layers;
  RayImage layerPicture;  ///< the reference picture of the layers' own light
};

/// Turns the fields of a step into proxies: every block and view is marched once per field.
class StepMarcher {
 public:
  StepMarcher(const Config& config, std::shared_ptr<gl::Device> device);

  /// What is made from now on.
  void configure(const Config& config) { config_ = config; }

  /// View by view, of which only the encoded proxies are kept. Adds its seconds to `times`.
  std::vector<EncodedProxy> march(const StepFrame& frame, const StepField& field, int threads,
                                  StepTimes& times);

 private:
  /// Makes the volume of the customisation anew where the domain is another than before.
  void customize(const StepFrame& frame, int threads, StepTimes& times);
  EncodedProxy reducedField(const StepFrame& frame, const StepField& field, int threads,
                            StepTimes& times) const;
  void upload(const StepFrame& frame, const StepField& field, const BlockPart& part, int threads,
              StepTimes& times);
  /// What rays gather in all blocks.
  RayImage marchRays(const StepFrame& frame, const StepField& field, const MarchRequest& request,
                     int threads, StepTimes& times);
  ViewRays marchView(const StepFrame& frame, const StepField& field, const View& view,
                     const LightDepth* shadows, int threads, StepTimes& times);
  /// The training pictures of [training]; `reference`: what the view's rays gathered.
  EncodedProxy trainingPictures(const StepFrame& frame, const StepField& field, const View& view,
                                const RayImage& reference, int threads, StepTimes& times);
  /// Of the configured light, if layers are to be shadowed.
  std::optional<LightDepth> marchLight(const StepFrame& frame, const StepField& field, int threads,
                                       StepTimes& times);
  /// The stacks of [sliced], and their reference pictures where their cameras are their own.
  void marchStacks(const StepFrame& frame, const StepField& field, int threads, StepTimes& times,
                   std::vector<EncodedProxy>& proxies);
  SlicedStack marchStack(const StepFrame& frame, const StepField& field, const StackView& stack,
                         int threads, StepTimes& times);
  MarchRequest requestFor(const StepFrame& frame, const StepField& field, const View& view) const;

  Config config_;
  std::shared_ptr<gl::Device> device_;
  Marcher marcher_;
  std::shared_ptr<const CustomVolume> custom_;  ///< null: nothing depends on the place
  std::optional<BlockPart> uploaded_;           ///< what is in the texture
};

}  // namespace vestige
