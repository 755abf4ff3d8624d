// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "adaptor/plan/classification.h"
#include "proxy/format/image/feature_origin.h"

namespace vestige {

/// The classifier of a run as its first stored step makes it: primitives fitted to the samples of
/// their regions, defaults filled in from `domains`, one for each of its fields. Throws CONFIG
/// naming the primitive in whose region no sample has data.
FeatureOrigin originOf(const PlannedClassifier& planned, std::vector<FieldDomain> domains,
                       double referenceLength, const BlockSet& blocks);

/// The samples of several fields on the same nodes that lie in a region, ghosts left out; along an
/// axis where it has no extent, the nearest ones. In the fields' units; no data is NaN.
std::vector<FieldSample> samplesIn(const Box& region, std::span<const PlannedField> fields,
                                   const BlockSet& blocks);

}  // namespace vestige
