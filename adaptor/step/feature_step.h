// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "adaptor/plan/classification.h"
#include "adaptor/march/feature_march.h"
#include "adaptor/plan/stack_views.h"
#include "adaptor/plan/step_frame.h"
#include "adaptor/step/timings.h"
#include "proxy/archive/archive.h"
#include "proxy/format/layout/feature_layout.h"

namespace vestige {

/// A classifier, ready to be marched.
struct StepClassifier {
  PlannedClassifier plan;
  FeatureOrigin origin;
};

/// Makes the proxies of a step's classifiers: every block is marched once per view and classifier.
class FeatureStep {
 public:
  FeatureStep(const Config& config, std::shared_ptr<gl::Device> device);
  /// What is made from now on.
  void configure(const Config& config) { config_ = config; }
  /// Adds its seconds to `times`.
  std::vector<EncodedProxy> march(const StepFrame& frame, const StepClassifier& classifier,
                                  int threads, StepTimes& times);

 private:
  struct Job;
  void upload(const Job& job, const BlockPart& part);
  EncodedProxy flat(const Job& job, const View& view);
  EncodedProxy sliced(const Job& job, const StackView& stack);

  Config config_;
  FeatureMarcher marcher_;
  std::optional<BlockPart> uploaded_;  ///< what is in the textures
};

}  // namespace vestige
