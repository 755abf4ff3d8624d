// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/image/feature_origin.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "proxy/base/error.h"

namespace vestige {
namespace {

using nlohmann::json;

[[noreturn]] void refuse(const std::string& reason) {
  throw Error(ErrorCode::Format, "a classifier's origin: " + reason);
}

double number(const json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number())
    refuse(fmt::format("'{}' is missing or no number", key));
  const double value = found->get<double>();
  if (!std::isfinite(value)) refuse(fmt::format("'{}' is {}", key, value));
  return value;
}

FieldDomain domainFrom(const json& object) {
  if (!object.is_object()) refuse("a domain is no object");
  const FieldDomain domain{number(object, "low"), number(object, "high"), number(object, "median")};
  if (!(domain.low < domain.high) || !std::isfinite(domain.range()))
    refuse(fmt::format("a domain is {} .. {}", domain.low, domain.high));
  return domain;
}

}  // namespace

json toJson(const FeatureOrigin& origin) {
  json domains = json::array();
  for (const FieldDomain& each : origin.domains)
    domains.push_back({{"low", each.low}, {"high", each.high}, {"median", each.median}});
  json object{{"classifier", origin.classifier->json()},
              {"domains", std::move(domains)},
              {"referenceLength", origin.referenceLength}};
  if (!origin.settled) object["settled"] = false;
  return object;
}

FeatureOrigin featureOriginFromJson(const json& object) try {
  if (!object.is_object()) refuse("it is no object");
  const auto classifier = object.find("classifier"), domains = object.find("domains");
  if (classifier == object.end()) refuse("'classifier' is missing");
  if (domains == object.end() || !domains->is_array()) refuse("'domains' is no list");
  FeatureOrigin origin;
  origin.referenceLength = number(object, "referenceLength");
  if (!(origin.referenceLength > 0.0))
    refuse(fmt::format("'referenceLength' is {}", origin.referenceLength));
  if (const auto settled = object.find("settled"); settled != object.end()) {
    if (!settled->is_boolean()) refuse("'settled' is neither true nor false");
    origin.settled = settled->get<bool>();
  }
  std::unique_ptr<Classifier> read = classifierFromJson(*classifier, "classifier", "proxy");
  if (domains->size() != read->fields().size())
    refuse(fmt::format("{} fields have {} domains", read->fields().size(), domains->size()));
  for (const json& each : *domains) origin.domains.push_back(domainFrom(each));
  // Nothing is left to be filled in, and what the kind derives from domains is there.
  origin.classifier = read->resolved(origin.domains, origin.referenceLength);
  return origin;
} catch (const Error& error) {
  if (error.code() == ErrorCode::Format) throw;
  refuse(error.what());
}

}  // namespace vestige
