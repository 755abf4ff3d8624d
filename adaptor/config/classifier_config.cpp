// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/config/classifier_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "proxy/base/json_object.h"

namespace vestige {
namespace {

using nlohmann::json;

constexpr const char* kClassifierOwner = "classifier";

glm::dvec3 readCorner(JsonObject& object, const char* key) {
  std::vector<double> numbers;
  object.read(key, numbers);
  const bool fits = numbers.size() == 3 && std::all_of(numbers.begin(), numbers.end(),
                                                       [](double v) { return std::isfinite(v); });
  if (!fits) object.fail(key, "must hold three numbers, a corner of the region in world units");
  return {numbers[0], numbers[1], numbers[2]};
}

/// Takes `fit` out of the primitives of a classifier.
std::vector<PrimitiveFit> takeFits(json& classifier) {
  std::vector<PrimitiveFit> fits;
  const auto primitives = classifier.find("primitives");
  if (primitives == classifier.end() || !primitives->is_array()) return fits;
  for (std::size_t i = 0; i < primitives->size(); ++i) {
    json& primitive = (*primitives)[i];
    if (!primitive.is_object() || !primitive.contains("fit")) continue;
    const std::string path = fmt::format("primitives[{}]", i);
    JsonObject object(primitive["fit"], path + ".fit", kClassifierOwner);
    PrimitiveFit fit{i, {readCorner(object, "low"), readCorner(object, "high")}};
    for (int axis = 0; axis < 3; ++axis) {
      if (fit.region.low[axis] > fit.region.high[axis]) {
        object.fail("low", fmt::format("is {} along axis {}, above high {}", fit.region.low[axis],
                                       axis, fit.region.high[axis]));
      }
    }
    object.read("full", fit.full);
    object.finish();
    for (const char* key : {"center", "width", "matrix", "thickness"}) {
      if (primitive.contains(key)) {
        throw KeyError(kClassifierOwner, path + "." + key,
                       "is given, and fit, which finds it, as well");
      }
    }
    primitive.erase("fit");
    fits.push_back(fit);
  }
  return fits;
}

}  // namespace

bool ClassifierConfig::sameShape(const Classifier& other) const {
  const auto own = classifierFromJson(json, "", kClassifierOwner);
  return own->kind() == other.kind() && own->fields() == other.fields() &&
         own->channels() == other.channels();
}

ClassifierConfig readClassifier(const ConfigReader& reader) {
  ClassifierConfig config;
  config.json = reader.json();
  reader.atKeyLines([&] {
    if (const auto name = config.json.find("name"); name != config.json.end()) {
      if (!name->is_string())
        throw KeyError(kClassifierOwner, "name", "must be a text, not " + name->dump());
      config.name = name->get<std::string>();
      config.json.erase("name");
    }
    config.fits = takeFits(config.json);
    const auto classifier = classifierFromJson(config.json, "", kClassifierOwner);
    if (!config.fits.empty() && classifier->kind() != "gaussian") {
      throw KeyError(kClassifierOwner, "primitives", "are fitted for kind \"gaussian\" only");
    }
    if (classifier->channels().empty()) {
      throw KeyError(kClassifierOwner, "kind",
                     fmt::format("\"{}\" has no features that rays could gather; [image] proxies "
                                 "has \"mip\"",
                                 classifier->kind()));
    }
    config.fields = classifier->fields();
  });
  return config;
}

}  // namespace vestige
