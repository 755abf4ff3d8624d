// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/classifier/fit.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "proxy/base/error.h"

namespace vestige {
namespace {

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 4, 4>;
using FieldVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 4, 1>;

void require(std::span<const FieldDomain> domains) {
  if (domains.empty() || domains.size() > Classifier::kMaxFields) {
    throw Error(ErrorCode::InvalidArgument, fmt::format("a primitive has 1 to {} fields, not {}",
                                                        Classifier::kMaxFields, domains.size()));
  }
  for (const FieldDomain& domain : domains) {
    if (!(domain.range() > 0.0) || !std::isfinite(domain.range())) {
      throw Error(ErrorCode::InvalidArgument,
                  fmt::format("a field from {} to {} has no range", domain.low, domain.high));
    }
  }
}

/// Normalised samples with data, one a row: differences of values that are large against their
/// range are taken before they are squared.
std::vector<FieldVector> normalised(std::span<const FieldSample> samples,
                                    std::span<const FieldDomain> domains) {
  std::vector<FieldVector> rows;
  for (const FieldSample& sample : samples) {
    FieldVector row(domains.size());
    for (std::size_t i = 0; i < domains.size(); ++i)
      row[long(i)] = (sample.values[i] - domains[i].low) / domains[i].range();
    if (row.allFinite()) rows.push_back(row);
  }
  if (rows.empty()) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("none of {} samples has data to fit a primitive to", samples.size()));
  }
  return rows;
}

/// (2 Σ)^(-1/2), with deviations of at least `least` along each axis: in a full one, of any
/// direction through axes that are measured in these.
Matrix scaleOf(const Matrix& covariance, const FieldVector& least, bool full) {
  if (!full) {
    return covariance.diagonal()
        .cwiseMax(least.cwiseAbs2())
        .unaryExpr([](double variance) { return 1.0 / std::sqrt(2.0 * variance); })
        .asDiagonal();
  }
  const Matrix unit = least.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix> axes(unit * covariance * unit);
  const Matrix wide = least.asDiagonal() * axes.eigenvectors() *
                      axes.eigenvalues().cwiseMax(1.0).asDiagonal() *
                      axes.eigenvectors().transpose() * least.asDiagonal();
  return Eigen::SelfAdjointEigenSolver<Matrix>(2.0 * wide).operatorInverseSqrt();
}

}  // namespace

FittedPrimitive fitPrimitive(std::span<const FieldSample> samples,
                             std::span<const FieldDomain> domains, bool full,
                             std::span<const double> errors) {
  require(domains);
  if (!errors.empty() && errors.size() != domains.size()) {
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("{} errors of {} fields", errors.size(), domains.size()));
  }
  const std::vector<FieldVector> rows = normalised(samples, domains);
  const auto n = long(domains.size());
  FieldVector mean = FieldVector::Zero(n);
  for (const FieldVector& row : rows) mean += row / double(rows.size());
  Matrix covariance = Matrix::Zero(n, n);
  for (const FieldVector& row : rows)
    covariance += (row - mean) * (row - mean).transpose() / double(rows.size());
  // A width is √2 deviations.
  FieldVector least = FieldVector::Constant(n, kLeastDeviation);
  for (std::size_t i = 0; i < errors.size(); ++i)
    least[long(i)] = std::max(kLeastDeviation, std::sqrt(0.5) * errors[i] / domains[i].range());
  const Matrix scale = scaleOf(covariance, least, full);

  // Back to the fields' units.
  FittedPrimitive fit;
  fit.samples = rows.size();
  fit.primitive.fields = int(n);
  for (std::size_t i = 0; i < std::size_t(n); ++i) {
    const auto range = [&](std::size_t field) { return domains[field].range(); };
    fit.mean[i] = domains[i].low + mean[long(i)] * range(i);
    fit.deviation[i] = std::sqrt(covariance(long(i), long(i))) * range(i);
    fit.widened[i] = !errors.empty() && std::sqrt(2.0) * fit.deviation[i] < errors[i];
    for (std::size_t j = 0; j < std::size_t(n); ++j) {
      fit.covariance[i][j] = covariance(long(i), long(j)) * range(i) * range(j);
      fit.primitive.scale[i][j] = scale(long(i), long(j)) / range(j);
    }
  }
  fit.primitive.center = fit.mean;
  return fit;
}

}  // namespace vestige
