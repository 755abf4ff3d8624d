// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/plan/classification.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "adaptor/common/adaptor_error.h"
#include "adaptor/config/config_reader.h"
#include "proxy/base/nearest_word.h"

namespace vestige {
namespace {

/// A name for archives: other characters than letters, digits and _+-. become '_'.
std::string plainName(std::string name) {
  for (char& c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '_' || c == '+' || c == '-' || c == '.';
    if (!plain) c = '_';
  }
  if (name.empty() || name.front() == '.') name = "_" + name;
  return name;
}

/// The names of all shared fields in the order in which they were first shared.
std::vector<std::string> sharedNames(const BlockSet& blocks) {
  std::vector<std::string> names;
  for (const auto& [index, block] : blocks.blocks()) {
    for (const auto& field : block.fields) {
      if (std::find(names.begin(), names.end(), field.name) == names.end()) {
        names.push_back(field.name);
      }
    }
  }
  return names;
}

/// The field as one block shares it, after checking that all blocks share it alike.
const FieldView& agreedView(const std::string& source, const BlockSet& blocks) {
  const FieldView* agreed = nullptr;
  int agreedIndex = 0;
  for (const auto& [index, block] : blocks.blocks()) {
    if (block.grid.empty()) continue;
    const FieldView* view = block.find(source);
    if (!view) {
      const auto near = nearestWord(source, sharedNames(blocks));
      throw AdaptorError(
          VESTIGE_ERROR_NO_FIELD,
          fmt::format(
              "field '{}' is not shared for block {}{}", source, index,
              near.empty() || near == source ? "" : fmt::format("; did you mean '{}'?", near)));
    }
    if (!agreed) {
      agreed = view;
      agreedIndex = index;
    }
    if (view->location != agreed->location ||
        view->components.size() != agreed->components.size()) {
      throw AdaptorError(
          VESTIGE_ERROR_FIELD,
          fmt::format("field '{}' has {} components at {}s in block {}, but {} at {}s in block {}",
                      source, agreed->components.size(), nameOf(agreed->location), agreedIndex,
                      view->components.size(), nameOf(view->location), index));
    }
  }
  if (!agreed) throw AdaptorError(VESTIGE_ERROR_GRID, "no block has any points: nothing to show");
  return *agreed;
}

PlannedField planField(FieldConfig config, const BlockSet& blocks,
                       const std::map<std::string, std::string>& units) {
  PlannedField field;
  const FieldView& view = agreedView(config.source, blocks);
  const int components = int(view.components.size());
  if (config.component && *config.component >= components) {
    throw AdaptorError(VESTIGE_ERROR_FIELD,
                       fmt::format("field '{}' has {} components, component {} is wanted",
                                   config.source, components, *config.component));
  }
  const bool magnitude = config.magnitude || (!config.component && components > 1);
  field.location = view.location;
  field.components = components;
  field.derivation.component = magnitude ? -1 : config.component.value_or(0);
  field.derivation.gradient = config.gradient;
  field.derivation.noData = config.noData;
  field.name = config.name;
  if (field.name.empty()) {
    field.name = plainName(config.source);
    if (magnitude) field.name += "_magnitude";
    if (config.component) field.name += fmt::format("_{}", *config.component);
    if (config.gradient) field.name += "_gradient";
  }
  const auto known = units.find(config.source);
  field.units = config.units ? *config.units : known != units.end() ? known->second : "";
  field.config = std::move(config);
  return field;
}

/// A field that is called by name: one of those planned, or one that is shared.
PlannedField namedField(const std::string& name, const std::string& whose,
                        const std::vector<PlannedField>& planned, const BlockSet& blocks,
                        const std::map<std::string, std::string>& units) {
  for (const PlannedField& field : planned) {
    if (field.name == name) return field;
  }
  std::vector<std::string> known = sharedNames(blocks);
  if (std::find(known.begin(), known.end(), name) != known.end()) {
    FieldConfig config;
    config.source = name;
    // What stands for no data in it does so whatever the field is called.
    for (const PlannedField& field : planned) {
      if (field.config.source == name) config.noData = field.config.noData;
    }
    return planField(std::move(config), blocks, units);
  }
  for (const PlannedField& field : planned) known.push_back(field.name);
  const auto near = nearestWord(name, known);
  throw AdaptorError(
      VESTIGE_ERROR_NO_FIELD,
      fmt::format("{} names the field '{}', which is neither configured nor shared{}", whose, name,
                  near.empty() ? "" : fmt::format("; did you mean '{}'?", near)));
}

void requireOneLocation(const std::string& whose, const std::vector<PlannedField>& fields) {
  for (const PlannedField& field : fields) {
    if (field.location == fields.front().location) continue;
    throw AdaptorError(VESTIGE_ERROR_FIELD,
                       fmt::format("{} takes '{}' at {}s and '{}' at {}s: its fields must have the "
                                   "same samples",
                                   whose, fields.front().name, nameOf(fields.front().location),
                                   field.name, nameOf(field.location)));
  }
}

PlannedField planNorm(FieldConfig config, const std::vector<PlannedField>& planned,
                      const BlockSet& blocks, const std::map<std::string, std::string>& units) {
  PlannedField field;
  const std::string whose = fmt::format("[[field]] '{}'", config.name);
  for (const std::string& name : config.gradientNorm) {
    field.terms.push_back(namedField(name, whose, planned, blocks, units));
  }
  requireOneLocation(whose, field.terms);
  field.name = config.name;
  field.units = config.units.value_or("");
  field.location = field.terms.front().location;
  field.config = std::move(config);
  return field;
}

}  // namespace

std::vector<PlannedField> planFields(const Config& config, const BlockSet& blocks,
                                     const std::map<std::string, std::string>& units) {
  std::vector<FieldConfig> wanted = config.fields;
  if (wanted.empty()) {
    for (const auto& name : sharedNames(blocks)) {
      wanted.emplace_back().source = name;
    }
    if (wanted.empty()) throw AdaptorError(VESTIGE_ERROR_NO_FIELD, "no field is shared");
  }
  // Norms last: they are of others.
  std::stable_partition(wanted.begin(), wanted.end(),
                        [](const FieldConfig& each) { return each.gradientNorm.empty(); });
  std::vector<PlannedField> fields;
  std::set<std::string> names;
  std::vector<PlannedField> plain;
  for (auto& each : wanted) {
    if (each.gradientNorm.empty()) {
      fields.push_back(planField(std::move(each), blocks, units));
      plain.push_back(fields.back());
    } else {
      fields.push_back(planNorm(std::move(each), plain, blocks, units));
    }
    const auto& field = fields.back();
    if (!names.insert(field.name).second) {
      throw AdaptorError(VESTIGE_ERROR_FIELD,
                         fmt::format("two fields are called '{}' in the archive; give '{}' another "
                                     "name in the configuration",
                                     field.name, field.config.source));
    }
  }
  return fields;
}

std::vector<PlannedClassifier> planClassifiers(const Config& config,
                                               const std::vector<PlannedField>& fields,
                                               const BlockSet& blocks,
                                               const std::map<std::string, std::string>& units) {
  std::vector<PlannedClassifier> classifiers;
  for (const ClassifierConfig& each : config.classifiers) {
    PlannedClassifier planned{each, {}};
    const std::string whose = fmt::format("[[classifier]] '{}'", each.name);
    planned.config.fields.clear();
    for (const std::string& name : each.fields) {
      planned.fields.push_back(namedField(name, whose, fields, blocks, units));
      planned.config.fields.push_back(planned.fields.back().name);
    }
    planned.config.json["fields"] = planned.config.fields;
    requireOneLocation(whose, planned.fields);
    for (const PlannedField& field : fields) {
      if (field.name == each.name) {
        throw AdaptorError(VESTIGE_ERROR_CONFIG,
                           fmt::format("{} has the name of a field: give it another one", whose));
      }
    }
    classifiers.push_back(std::move(planned));
  }
  return classifiers;
}

FieldReader gradientReaderOf(std::span<const PlannedField> fields, std::vector<double> ranges,
                             const Block& block) {
  std::vector<FieldReader> terms;
  for (const PlannedField& field : fields) terms.push_back(readerOf(field, block));
  return {std::move(terms), std::move(ranges)};
}

FieldReader readerOf(const PlannedField& field, const Block& block) {
  if (!field.terms.empty()) return gradientReaderOf(field.terms, field.ranges, block);
  const FieldView* view = block.find(field.config.source);
  return {*view, block.masks[std::size_t(field.location)], field.derivation,
          block.nodes(field.location)};
}

std::vector<FieldPart> partsOf(const PlannedField& field, const BlockSet& blocks) {
  std::vector<FieldPart> parts;
  for (const auto& [index, block] : blocks.blocks()) {
    if (block.grid.empty()) continue;
    for (const auto& own : blocks.ownSamples(index, field.location)) {
      parts.push_back({readerOf(field, block), own, blocks.facePlaces(index, field.location)});
    }
  }
  return parts;
}

Classification classify(const FieldConfig& config, const FieldStatistics& statistics,
                        double referenceLength) {
  const bool fixed = config.range == FieldConfig::Range::Fixed;
  const double low = fixed ? config.low : statistics.low;
  const double high = fixed ? config.high : statistics.high;
  auto partition =
      !config.bounds.empty() ? IntervalPartition::fromBounds(config.bounds)
      : config.quantiles
          ? IntervalPartition::quantiles(low, high, statistics.histogram, config.intervals)
          : IntervalPartition::uniformAroundZero(low, high, config.intervals);
  const auto [colorLow, colorHigh] =
      config.colorRange.value_or(std::pair(partition.low(), partition.high()));
  auto base = config.opacity.empty()
                  ? TransferFunction::ramp(partition.low(), partition.high(), referenceLength,
                                           config.colormap)
                  : TransferFunction(config.opacity, referenceLength,
                                     Colormap::named(config.colormap), colorLow, colorHigh);
  base.setColorRange(colorLow, colorHigh);
  auto isovalues = isovaluesOf(config, partition, base);
  return {std::move(partition), std::move(base), std::move(isovalues)};
}

std::vector<double> isovaluesOf(const FieldConfig& config, const IntervalPartition& partition,
                                const TransferFunction& base) {
  using Rule = FieldConfig::Isovalues;
  std::vector<double> values;
  const auto bounds = partition.bounds();
  switch (config.isovalueRule) {
    case Rule::Explicit:
      values = config.isovalues;
      break;
    // An interval is entered through its bounds; the outermost two only touch the data.
    case Rule::Bounds:
      values.assign(bounds.begin() + 1, bounds.end() - 1);
      break;
    case Rule::Peaks:
      values = base.opacityPeaks();
      break;
    case Rule::Automatic:
      values = base.opacityPeaks();
      if (values.size() >= 2) break;
      [[fallthrough]];
    case Rule::Even:
      values.clear();
      for (int i = 1; i <= config.isovalueCount; ++i) {
        values.push_back(partition.denormalised(double(i) / double(config.isovalueCount + 1)));
      }
      break;
  }
  std::sort(values.begin(), values.end());
  return values;
}

}  // namespace vestige
