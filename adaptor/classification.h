// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "adaptor/config.h"
#include "adaptor/ingest_statistics.h"
#include "proxy/interval_partition.h"
#include "proxy/statistics.h"
#include "proxy/transfer_function.h"

namespace vestige {

/// A field of the configuration, or of the defaults, found among what the host shared.
struct PlannedField {
  FieldConfig config;
  std::string name;  ///< in the archive
  std::string units;
  Location location = Location::Point;
  Derivation derivation;
};

/// What is to be stored of the shared fields. Without [[field]]: every field in the order in which
/// it was shared first, vectors by their magnitude. Throws NO_FIELD when a block that is not empty
/// lacks one, FIELD when blocks disagree on location or components, or a component is missing.
std::vector<PlannedField> planFields(const Config& config, const BlockSet& blocks,
                                     const std::map<std::string, std::string>& units);

/// The field's readers, one for each block that is not empty.
std::vector<FieldPart> partsOf(const PlannedField& field, const BlockSet& blocks);
FieldReader readerOf(const PlannedField& field, const Block& block);

/// How a field's values are told apart and shown in a run (method §0, §2).
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
