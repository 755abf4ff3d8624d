// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "adaptor/config/config_reader.h"
#include "proxy/camera/box.h"
#include "proxy/classifier/classifier.h"

namespace vestige {

/// `fit` of a primitive: where its centre and widths are taken from at the first stored step.
struct PrimitiveFit {
  std::size_t primitive = 0;
  Box region;         ///< world; along an axis where low = high, the samples nearest to it
  bool full = false;  ///< a full matrix instead of widths
};

/// [[classifier]]: features of one to four fields at once (classification §4).
struct ClassifierConfig {
  std::string name = "features";  ///< in the archive, where fields have theirs
  nlohmann::json json;            ///< as classifierFromJson() reads it
  std::vector<PrimitiveFit> fits;
  std::vector<std::string> fields;  ///< as they are called there

  /// The names of its features in order, and kind and fields: what a restart must agree in.
  bool sameShape(const Classifier& other) const;
};

/// Reads one [[classifier]]; errors are Config errors at the key's line.
ClassifierConfig readClassifier(const ConfigReader& reader);

}  // namespace vestige
