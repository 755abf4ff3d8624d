// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proxy/classifier/classifier.h"

namespace vestige {

/// How a kind of classifier is called and read.
struct ClassifierKind {
  std::string_view name;
  std::size_t leastFields, mostFields;
  /// Reads what is the kind's own of an object; the caller finishes it.
  std::unique_ptr<Classifier> (*read)(JsonObject& object, std::vector<std::string> fields);
};

/// All kinds there are: the list in kinds.cpp.
std::span<const ClassifierKind> classifierKinds();

// One a file of this folder.
std::unique_ptr<Classifier> readBoundaries(JsonObject& object, std::vector<std::string> fields);
std::unique_ptr<Classifier> readColor(JsonObject& object, std::vector<std::string> fields);
std::unique_ptr<Classifier> readGaussian(JsonObject& object, std::vector<std::string> fields);
std::unique_ptr<Classifier> readMaterials(JsonObject& object, std::vector<std::string> fields);
std::unique_ptr<Classifier> readMaximum(JsonObject& object, std::vector<std::string> fields);

}  // namespace vestige
