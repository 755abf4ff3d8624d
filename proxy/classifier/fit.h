// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>

#include "proxy/classifier/gaussian.h"

namespace vestige {

/// What samples of fields say of the feature they were taken from [Kniss 2003, §6].
struct FittedPrimitive {
  std::size_t samples = 0;  ///< that had data
  std::array<double, 4> mean{}, deviation{};
  std::array<std::array<double, 4>, 4> covariance{};  ///< population, in the fields' units
  /// Around the mean; KᵀK = (2 Σ)⁻¹, which makes it the normal distribution of the samples scaled
  /// to 1 at its centre: a diagonal one is √2 deviations wide along each axis.
  GaussianPrimitive primitive;
  std::array<bool, 4> widened{};  ///< narrower than the field's error: it has that width instead
};

/// Deviations are taken as no less than this share of a field's range (in a full fit, of any
/// direction through the ranges), so that a constant region still has a width.
inline constexpr double kLeastDeviation = 1e-3;

/// Fits a primitive to samples of domains.size() fields (1 to 4) in the fields' units; those in
/// which a value is not finite are passed over. Diagonal K, or a full symmetric one. `errors`: how
/// far a sample of each field may be from the truth, in its units: no primitive is narrower than
/// that, as it would miss what it was fitted to; empty = exact. Throws InvalidArgument: no sample
/// with data, no or too many fields, a range that is not positive.
FittedPrimitive fitPrimitive(std::span<const FieldSample> samples,
                             std::span<const FieldDomain> domains, bool full = false,
                             std::span<const double> errors = {});

}  // namespace vestige
