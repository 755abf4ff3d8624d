// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "proxy/classifier/classifier.h"
#include "proxy/base/json_object.h"

namespace vestige::test {

inline std::unique_ptr<Classifier> read(const nlohmann::json& object) {
  return classifierFromJson(object, "");
}

/// Expects that reading fails at a key for a reason that holds `part`.
inline void expectKeyError(const nlohmann::json& object, const std::string& path,
                           const std::string& part) {
  try {
    read(object);
    ADD_FAILURE() << "no error in " << object.dump();
  } catch (const KeyError& error) {
    EXPECT_EQ(error.path(), path) << error.what();
    EXPECT_NE(error.reason().find(part), std::string::npos) << error.what();
  }
}

inline FieldSample value(double v, double gradient = 0.0) { return {{v, 0, 0, 0}, gradient}; }

inline FieldSample between(const FieldSample& a, const FieldSample& b, double t) {
  FieldSample middle = a;
  for (std::size_t i = 0; i < 4; ++i) middle.values[i] += t * (b.values[i] - a.values[i]);
  middle.gradient += t * (b.gradient - a.gradient);
  return middle;
}

inline std::vector<double> weightsOf(const Classifier& classifier, const FieldSample& a,
                                     const FieldSample& b) {
  std::vector<double> weights(classifier.channels().size(), -1.0);
  classifier.weights(a, b, weights);
  return weights;
}

}  // namespace vestige::test
