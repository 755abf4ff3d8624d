// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/classifier/classifier.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <set>

#include "proxy/base/json_object.h"
#include "proxy/base/nearest_word.h"
#include "proxy/classifier/kinds.h"
#include "proxy/transfer/colormap.h"
#include "proxy/transfer/interval_partition.h"
#include "proxy/transfer/statistics.h"
#include "proxy/transfer/transfer_function.h"

namespace vestige {
namespace {

using nlohmann::json;

/// A name that can stand in a file's channel.
bool isPlain(const std::string& name) {
  return !name.empty() && name.size() <= 40 &&
         name.find_first_not_of(
             "abcdefghijklmnopqrstuvwxyz"
             "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
             "0123456789_+-") == std::string::npos;
}

std::optional<glm::dvec3> srgbFromHex(const std::string& text) {
  unsigned rgb = 0;
  if (text.size() != 7 || text[0] != '#') return std::nullopt;
  const auto [end, error] = std::from_chars(text.data() + 1, text.data() + 7, rgb, 16);
  if (error != std::errc() || end != text.data() + 7) return std::nullopt;
  return glm::dvec3((rgb >> 16) & 255, (rgb >> 8) & 255, rgb & 255) / 255.0;
}

void readFeatureColor(JsonObject& object, glm::dvec3& color) {
  const json* found = object.find("color");
  if (!found) return;
  std::optional<glm::dvec3> srgb;
  if (found->is_string()) {
    srgb = srgbFromHex(found->get<std::string>());
  } else {
    std::vector<double> numbers;
    object.read("color", numbers);
    const bool fits =
        numbers.size() == 3 &&
        std::all_of(numbers.begin(), numbers.end(), [](double c) { return c >= 0.0 && c <= 1.0; });
    if (fits) srgb = glm::dvec3(numbers[0], numbers[1], numbers[2]);
  }
  if (!srgb) {
    object.fail("color",
                "is " + found->dump() + "; \"#rrggbb\" or red, green, blue in 0..1 (sRGB)");
  }
  color = linearFromSrgb(*srgb);
}

}  // namespace

FieldDomain fieldDomain(const IntervalPartition& partition, const FieldStatistics& statistics) {
  FieldDomain domain{partition.low(), partition.high(), statistics.low};
  const auto& bins = statistics.histogram;
  const double half = 0.5 * double(std::accumulate(bins.begin(), bins.end(), std::uint64_t(0)));
  double before = 0.0;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (before + double(bins[i]) < half || bins[i] == 0) {
      before += double(bins[i]);
      continue;
    }
    const double place = (double(i) + (half - before) / double(bins[i])) / double(bins.size());
    domain.median = statistics.low + place * (statistics.high - statistics.low);
    break;
  }
  return domain;
}

double Feature::extinction(double referenceLength) const {
  if (!enabled) return 0.0;
  return extinctionOf(opacity, referenceLength);
}

glm::dvec3 MaximumLook::color(double value) const {
  if (std::isnan(value)) return glm::dvec3(0.0);
  if (low == high) return colormap.at(value < low ? 0.0 : value > low ? 1.0 : 0.5);
  return colormap.at(std::clamp((value - low) / (high - low), 0.0, 1.0));
}

Classifier::Classifier(std::string kind, std::vector<std::string> fields,
                       std::vector<Feature> features)
    : kind_(std::move(kind)), fields_(std::move(fields)), features_(std::move(features)) {}

void Classifier::edit(std::span<const FeatureEdit> edits) {
  for (const FeatureEdit& edit : edits) {
    const auto found = std::find_if(features_.begin(), features_.end(),
                                    [&](const Feature& each) { return each.name == edit.name; });
    if (found == features_.end()) {
      std::vector<std::string> names;
      for (const Feature& each : features_) names.push_back(each.name);
      throw Error(ErrorCode::NotFound,
                  fmt::format("there is no feature '{}' to change; there are: {}{}", edit.name,
                              fmt::join(names, ", "), didYouMean(edit.name, names)));
    }
    if (edit.opacity) found->opacity = *edit.opacity;
    if (edit.color) found->color = *edit.color;
    if (edit.enabled) found->enabled = *edit.enabled;
  }
}

std::vector<std::string> Classifier::channels() const {
  std::vector<std::string> names;
  for (const Feature& feature : features_) names.push_back(feature.name);
  return names;
}

std::vector<ChannelOptics> Classifier::optics(double referenceLength) const {
  std::vector<ChannelOptics> optics;
  for (const Feature& feature : features_) {
    const double extinction = feature.extinction(referenceLength);
    optics.push_back({extinction, extinction * feature.color});
  }
  return optics;
}

Feature featureFrom(JsonObject& object, const std::string& fallback) {
  Feature feature;
  feature.name = fallback;
  object.read("name", feature.name);
  if (!isPlain(feature.name)) {
    object.fail("name", "is '" + feature.name + "'; letters, digits and _+-, at most 40 of them");
  }
  object.read("opacity", feature.opacity);
  if (!(feature.opacity >= 0.0 && feature.opacity <= 1.0)) {
    object.fail("opacity", fmt::format("is {}, not in 0..1", feature.opacity));
  }
  readFeatureColor(object, feature.color);
  object.read("enabled", feature.enabled);
  return feature;
}

FeatureEdit featureEditFrom(JsonObject& object) {
  if (!object.find("name")) object.fail("name", "is missing: which feature?");
  const Feature feature = featureFrom(object, "");
  FeatureEdit edit{feature.name, {}, {}, {}};
  if (object.find("opacity")) edit.opacity = feature.opacity;
  if (object.find("color")) edit.color = feature.color;
  if (object.find("enabled")) edit.enabled = feature.enabled;
  return edit;
}

json featureEditJson(const FeatureEdit& edit) {
  json object{{"name", edit.name}};
  if (edit.opacity) object["opacity"] = *edit.opacity;
  if (edit.color) {
    const glm::dvec3 srgb = srgbFromLinear(*edit.color);
    object["color"] = {srgb.r, srgb.g, srgb.b};
  }
  if (edit.enabled) object["enabled"] = *edit.enabled;
  return object;
}

std::vector<JsonObject> featureList(JsonObject& object, const char* key) {
  std::vector<JsonObject> list = object.list(key);
  if (list.size() > Classifier::kMaxFeatures) {
    object.fail(key, fmt::format("holds {}, more than {}", list.size(), Classifier::kMaxFeatures));
  }
  if (list.empty() && object.find(key)) object.fail(key, "must not be empty");
  return list;
}

std::optional<double> readNumber(JsonObject& object, const char* key) {
  double number = 0.0;
  object.read(key, number);
  if (!std::isfinite(number)) object.fail(key, fmt::format("is {}", number));
  return object.find(key) ? std::optional(number) : std::nullopt;
}

std::optional<double> readPositive(JsonObject& object, const char* key) {
  const std::optional<double> number = readNumber(object, key);
  if (number && !(*number > 0.0)) object.fail(key, fmt::format("{} is not positive", *number));
  return number;
}

json featureJson(const Feature& feature) {
  const glm::dvec3 srgb = srgbFromLinear(feature.color);
  return {{"name", feature.name},
          {"opacity", feature.opacity},
          {"color", {srgb.r, srgb.g, srgb.b}},
          {"enabled", feature.enabled}};
}

json classifierJson(const Classifier& classifier) {
  return {{"kind", classifier.kind()}, {"fields", classifier.fields()}};
}

std::unique_ptr<Classifier> classifierFromJson(const json& source, const std::string& path,
                                               const std::string& owner) {
  JsonObject object(source, path, owner);
  std::string kind;
  object.read("kind", kind);
  const auto& kinds = classifierKinds();
  const auto found =
      std::find_if(kinds.begin(), kinds.end(), [&](const auto& each) { return each.name == kind; });
  if (found == kinds.end()) {
    std::vector<std::string> names;
    for (const auto& each : kinds) names.emplace_back(each.name);
    object.fail("kind",
                fmt::format("{}; choices: {}{}", kind.empty() ? "is missing" : "is '" + kind + "'",
                            fmt::join(names, ", "), didYouMean(kind, names)));
  }
  std::vector<std::string> fields;
  if (const json* names = object.find("fields")) {
    const bool strings =
        names->is_array() &&
        std::all_of(names->begin(), names->end(), [](const auto& n) { return n.is_string(); });
    if (!strings) object.fail("fields", "must be a list of names, not " + names->dump());
    fields = names->get<std::vector<std::string>>();
  }
  if (fields.size() < found->leastFields || fields.size() > found->mostFields) {
    object.fail("fields",
                fmt::format("holds {} names; {} takes {}", fields.size(), kind,
                            found->leastFields == found->mostFields
                                ? fmt::format("{}", found->leastFields)
                                : fmt::format("{} to {}", found->leastFields, found->mostFields)));
  }
  auto classifier = found->read(object, std::move(fields));
  object.finish();
  std::set<std::string> names;
  for (const Feature& feature : classifier->features()) {
    if (!names.insert(feature.name).second) {
      object.fail("kind", "has two features called '" + feature.name + "'");
    }
  }
  return classifier;
}

}  // namespace vestige
