// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "proxy/classifier/classifier.h"

namespace vestige {

/// What the channels of a proxy of features are weights of, as the run had it.
struct FeatureOrigin {
  std::shared_ptr<const Classifier> classifier;  ///< resolved, in the fields' units; never null
  std::vector<FieldDomain> domains;              ///< one for each of its fields
  double referenceLength = 1.0;                  ///< of its opacities, world
  /// Whether the run goes on with it: all of its fields varied. Else it is of one step.
  bool settled = true;

  std::size_t channels() const { return classifier->channels().size(); }
};

/// {"classifier": as looks have it, "domains": [{"low", "high", "median"}, ...],
/// "referenceLength"}, and "settled": false where it is.
nlohmann::json toJson(const FeatureOrigin& origin);
/// Throws Format naming what is missing or makes no sense.
FeatureOrigin featureOriginFromJson(const nlohmann::json& json);

}  // namespace vestige
