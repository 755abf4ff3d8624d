// SPDX-License-Identifier: BSD-3-Clause
// Maximum intensity projection ([Bergeron, p. 8]; method §1): a ray shows the
// colour of the greatest value along it; no channels and no weights. Keys: colormap (a name;
// "viridis"), range ([low, high], the values at its ends; by default the field's).
#include <fmt/format.h>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "proxy/base/json_object.h"
#include "proxy/classifier/kinds.h"

namespace vestige {
namespace {

class Maximum final : public Classifier {
 public:
  Maximum(std::vector<std::string> fields, MaximumLook look, bool hasRange)
      : Classifier("maximum", std::move(fields), {}), look_(std::move(look)), hasRange_(hasRange) {}

  std::unique_ptr<Classifier> resolved(std::span<const FieldDomain> domains,
                                       double) const override {
    MaximumLook look = look_;
    if (!hasRange_) {
      look.low = domains[0].low;
      look.high = domains[0].high;
    }
    return std::make_unique<Maximum>(fields_, std::move(look), true);
  }

  std::unique_ptr<Classifier> normalised(std::span<const FieldDomain> domains) const override {
    MaximumLook look = look_;
    look.low = (look_.low - domains[0].low) / domains[0].range();
    look.high = (look_.high - domains[0].low) / domains[0].range();
    return std::make_unique<Maximum>(fields_, std::move(look), true);
  }

  void weights(const FieldSample&, const FieldSample&, std::span<double>) const override {}
  const MaximumLook* maximum() const override { return &look_; }
  std::string_view glsl() const override { return {}; }
  std::vector<glm::vec4> parameters() const override { return {}; }

  nlohmann::json json() const override {
    nlohmann::json object = classifierJson(*this);
    object["colormap"] = look_.colormap.name();
    if (hasRange_) object["range"] = {look_.low, look_.high};
    return object;
  }

 private:
  MaximumLook look_;
  bool hasRange_;
};

}  // namespace

std::unique_ptr<Classifier> readMaximum(JsonObject& object, std::vector<std::string> fields) {
  std::string colormap = "viridis";
  object.read("colormap", colormap);
  MaximumLook look;
  try {
    look.colormap = Colormap::named(colormap);
  } catch (const Error& error) {
    object.fail("colormap", fmt::format("is '{}': {}", colormap, error.what()));
  }
  std::vector<double> range;
  object.read("range", range);
  const bool hasRange = object.find("range") != nullptr;
  if (hasRange) {
    const bool fits = range.size() == 2 && std::isfinite(range[0]) && std::isfinite(range[1]) &&
                      range[0] <= range[1];
    if (!fits) object.fail("range", "must be two numbers, the lower first");
    look.low = range[0];
    look.high = range[1];
  }
  return std::make_unique<Maximum>(std::move(fields), std::move(look), hasRange);
}

}  // namespace vestige
