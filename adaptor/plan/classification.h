// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "adaptor/config/config.h"
#include "adaptor/ingest/ingest_statistics.h"
#include "proxy/transfer/interval_partition.h"
#include "proxy/transfer/statistics.h"
#include "proxy/transfer/transfer_function.h"

namespace vestige {

/// A field of the configuration, or of the defaults, found among what the host shared.
struct PlannedField {
  FieldConfig config;
  std::string name;  ///< in the archive
  std::string units;
  Location location = Location::Point;
  int components = 1;  ///< of the source
  Derivation derivation;
  /// Of a gradient norm: its fields, and the ranges that their gradients are divided by; empty
  /// until they are known.
  std::vector<PlannedField> terms{};
  std::vector<double> ranges{};
};

/// A [[classifier]], its fields found.
struct PlannedClassifier {
  ClassifierConfig config;           ///< `fields` as the archive calls them
  std::vector<PlannedField> fields;  ///< all at the same location
};

/// What is to be stored of the shared fields. Without [[field]]: every field in the order in which
/// it was shared first, vectors by their magnitude. Throws NO_FIELD when a block that is not empty
/// lacks one, FIELD when blocks disagree on location or components, or a component is missing.
std::vector<PlannedField> planFields(const Config& config, const BlockSet& blocks,
                                     const std::map<std::string, std::string>& units);

/// The classifiers of the configuration. Their fields are among those planned, by their names in
/// the archive, or else what is shared by that name. Throws NO_FIELD naming the nearest name, FIELD
/// when the fields of one are at points and cells, CONFIG when one has the name of a field.
std::vector<PlannedClassifier> planClassifiers(const Config& config,
                                               const std::vector<PlannedField>& fields,
                                               const BlockSet& blocks,
                                               const std::map<std::string, std::string>& units);

/// The field's readers, one for each block that is not empty.
std::vector<FieldPart> partsOf(const PlannedField& field, const BlockSet& blocks);
FieldReader readerOf(const PlannedField& field, const Block& block);
/// Of the gradient norm of fields whose gradients are divided by `ranges`.
FieldReader gradientReaderOf(std::span<const PlannedField> fields, std::vector<double> ranges,
                             const Block& block);

/// How a field's values are told apart and shown in a run (method §1 and §2).
struct Classification {
  IntervalPartition partition;
  TransferFunction base;
  std::vector<double> isovalues;  ///< increasing; of the depth layers
};

/// From the configuration and the statistics of a step.
Classification classify(const FieldConfig& config, const FieldStatistics& statistics,
                        double referenceLength);
/// The isovalues that a rule gives: "auto" takes the opacity peaks if there are two or more, else
/// `isovalueCount` values evenly inside the partition's range.
std::vector<double> isovaluesOf(const FieldConfig& config, const IntervalPartition& partition,
                                const TransferFunction& base);

}  // namespace vestige
