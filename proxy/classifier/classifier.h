// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proxy/transfer/colormap.h"

namespace vestige {

class IntervalPartition;
class JsonObject;
struct FieldStatistics;

/// What a classifier sees of the fields at a point.
struct FieldSample {
  std::array<double, 4> values{};  ///< of Classifier::fields(), the rest 0
  /// The multi-field gradient norm: Frobenius norm of the matrix whose rows are the gradients of
  /// the fields, each divided by its FieldDomain's range; 1 / world unit.
  double gradient = 0.0;
};

/// What is known of a field: the range that its values are normalised by, and the median.
struct FieldDomain {
  double low = 0.0, high = 1.0, median = 0.5;
  double range() const { return high - low; }
};

/// Of a field as an archive or a run knows it: the range of its partition, and the median by the
/// histogram of `statistics`.
FieldDomain fieldDomain(const IntervalPartition& partition, const FieldStatistics& statistics);

/// A thing that a classifier finds, such as a primitive, a material or a boundary, and its look:
/// what can be edited afterwards.
struct Feature {
  std::string name;                 ///< plain, unique within its classifier
  double opacity = 0.5;             ///< where its weight is 1, per reference length
  glm::dvec3 color{1.0, 1.0, 1.0};  ///< linear RGB
  bool enabled = true;
  /// 1 / world unit, as TransferFunction::extinction; 0 when disabled.
  double extinction(double referenceLength) const;
};

/// What a look changes of a feature: the keys of featureFrom(), each of which may be absent.
struct FeatureEdit {
  std::string name;
  std::optional<double> opacity;
  std::optional<glm::dvec3> color;
  std::optional<bool> enabled;
  friend bool operator==(const FeatureEdit&, const FeatureEdit&) = default;
};

/// What one unit of a channel's weight adds along a unit of length.
struct ChannelOptics {
  double extinction = 0.0;   ///< 1 / world unit
  glm::dvec3 emission{0.0};  ///< extinction-weighted linear RGB (σ c)
};

/// How a maximum intensity projection colours the greatest value along a ray (method §1).
struct MaximumLook {
  Colormap colormap;
  double low = 0.0, high = 1.0;  ///< the values at both ends of the map; equal: a step
  /// Linear RGB of a value; black where there is none (NaN).
  glm::dvec3 color(double value) const;
};

/// Maps the vector of up to four field values along a segment of a ray to weights of its channels;
/// what a channel's weight means to the eye are its optics. Extinction and emission are sums over
/// channels of weight times optics, so that features, which may overlap and leave gaps, are edited
/// one by one: the integrals ∫ w ds know no opacity and no colour. A kind of classifier is one file
/// in this folder: weights in double, the same in GLSL, and its JSON keys.
class Classifier {
 public:
  static constexpr std::size_t kMaxFields = 4;
  static constexpr std::size_t kMaxFeatures = 16;

  virtual ~Classifier() = default;

  /// "gaussian", "materials", "boundaries", "color" or "maximum": the key `kind`.
  std::string_view kind() const { return kind_; }
  const std::vector<std::string>& fields() const { return fields_; }  ///< 1 .. kMaxFields names
  const std::vector<Feature>& features() const { return features_; }
  std::vector<Feature>& features() { return features_; }
  /// Changes looks of features. Throws NotFound naming a feature that is not there, and those that
  /// are.
  void edit(std::span<const FeatureEdit> edits);

  /// The same with all defaults filled in, in the fields' units: centres at medians and the like.
  /// `referenceLength`, in world units, is what stands for a thin layer.
  virtual std::unique_ptr<Classifier> resolved(std::span<const FieldDomain> domains,
                                               double referenceLength) const = 0;
  /// A resolved one for values (v - low) / (high - low), computed in double.
  virtual std::unique_ptr<Classifier> normalised(std::span<const FieldDomain> domains) const = 0;

  /// Names of the channels; the features' own unless the kind says otherwise.
  virtual std::vector<std::string> channels() const;
  /// [channel] of the features' looks.
  virtual std::vector<ChannelOptics> optics(double referenceLength) const;
  /// [channel] mean weight of a resolved one, in [0, 1], over a segment on which values go linearly
  /// from a to b. A value without data (NaN) weighs nothing.
  virtual void weights(const FieldSample& a, const FieldSample& b,
                       std::span<double> weights) const = 0;
  virtual bool needsGradient() const { return false; }
  /// Whether no channel weighs more than kNegligible anywhere between two corners of a box of
  /// values and gradients. May say no where nobody can tell.
  virtual bool vanishes(const FieldSample& /*low*/, const FieldSample& /*high*/) const {
    return false;
  }
  static constexpr double kNegligible = 1e-6;
  /// [channel] density ρ: light falls on surfaces of D = Σ ρ w, its gradient their normal ([Drebin
  /// 1988], method §1). Empty: on those of the extinction.
  virtual std::vector<double> densities() const { return {}; }
  /// Not nullptr: no channels and no weights; a ray shows the colour of the greatest value of the
  /// one field along it.
  virtual const MaximumLook* maximum() const { return nullptr; }

  /// The same in GLSL ES 3.00, for normalised values: the text defines
  ///   void classify(vec4 a, vec4 b, float gradientA, float gradientB, out float weights[CHANNELS])
  /// over `uniform vec4 parameters[PARAMETERS]`, which, like CHANNELS, is declared by who uses it.
  /// Samples without data never come here.
  virtual std::string_view glsl() const = 0;
  virtual std::vector<glm::vec4> parameters() const = 0;  ///< of a normalised one

  /// Keys as classifierFromJson() reads them.
  virtual nlohmann::json json() const = 0;

 protected:
  Classifier(std::string kind, std::vector<std::string> fields, std::vector<Feature> features);
  Classifier(const Classifier&) = default;

  std::string kind_;
  std::vector<std::string> fields_;
  std::vector<Feature> features_;
};

/// Reads a classifier: {"kind": ..., "fields": [...], keys of the kind}. The same keys as in a
/// TOML [[classifier]]. Throws KeyError: unknown keys, wrong types, bad values.
/// docs/classification.md lists them. `owner` is what errors call the whole.
std::unique_ptr<Classifier> classifierFromJson(const nlohmann::json& json, const std::string& path,
                                               const std::string& owner = "look");

/// Reads a feature's changes; `name` must be given. Throws KeyError.
FeatureEdit featureEditFrom(JsonObject& object);
nlohmann::json featureEditJson(const FeatureEdit& edit);

// What kinds share.

/// Reads name, opacity, color ("#rrggbb" or three sRGB numbers in 0..1) and enabled; a feature
/// without a name is called `fallback`.
Feature featureFrom(JsonObject& object, const std::string& fallback);
/// The objects of a list of features, at most Classifier::kMaxFeatures; none where the key is
/// absent, while an empty list is an error.
std::vector<JsonObject> featureList(JsonObject& object, const char* key);
/// A finite number, and one greater than 0; nothing where the key is absent.
std::optional<double> readNumber(JsonObject& object, const char* key);
std::optional<double> readPositive(JsonObject& object, const char* key);
/// The keys of featureFrom().
nlohmann::json featureJson(const Feature& feature);
/// `kind` and `fields`.
nlohmann::json classifierJson(const Classifier& classifier);

}  // namespace vestige
