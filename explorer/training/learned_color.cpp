// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/training/learned_color.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "proxy/base/error.h"

namespace vestige {
namespace {

/// Samples that k-means sees, spread evenly: centroids need no more.
constexpr std::size_t kMostClustered = std::size_t(1) << 16;
/// Variance of an attenuation that storage in steps of 2^-12 makes: less is no information.
constexpr double kRoundingVariance = 0x1p-24 / 12.0;

/// How far a cluster's derivatives are from those of all samples, as a variance.
constexpr double kClusterVariance = 1.0 / 256.0;

/// The samples that count, as indices.
std::vector<std::size_t> countedSamples(const LearningSamples& samples) {
  const auto channels = std::size_t(samples.channels);
  std::vector<std::size_t> counted;
  for (std::size_t i = 0; i < samples.color.size() / 3; ++i) {
    const float* a = samples.attenuation.data() + i * channels;
    const float* c = samples.color.data() + 3 * i;
    const auto finite = [](float v) { return std::isfinite(v); };
    if (std::all_of(a, a + channels, finite) && std::all_of(c, c + 3, finite) &&
        std::any_of(a, a + channels, [](float v) { return v > 0.0f; }))
      counted.push_back(i);
  }
  return counted;
}

/// [cluster][channel] by k-means++ and Lloyd's iteration.
std::vector<float> centroidsOf(const LearningSamples& samples,
                               const std::vector<std::size_t>& counted, int clusters,
                               std::uint64_t seed) {
  const auto channels = std::size_t(samples.channels);
  const std::size_t shown = std::min(counted.size(), kMostClustered);
  cv::Mat points(int(shown), samples.channels, CV_32F);
  for (std::size_t i = 0; i < shown; ++i) {
    const float* a = samples.attenuation.data() + counted[i * counted.size() / shown] * channels;
    std::copy(a, a + channels, points.ptr<float>(int(i)));
  }
  if (shown == 1)
    return {points.ptr<float>(0), points.ptr<float>(0) + channels};  // a row is many points to cv
  const int most = std::min(clusters, int(shown));
  cv::Mat labels, centers;
  cv::theRNG() = cv::RNG(seed);
  cv::kmeans(points, most, labels,
             cv::TermCriteria(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 40, 1e-5), 1,
             cv::KMEANS_PP_CENTERS, centers);
  std::vector<float> centroids;
  for (int k = 0; k < most; ++k) {
    const float* row = centers.ptr<float>(k);
    centroids.insert(centroids.end(), row, row + channels);
  }
  return centroids;
}

std::size_t nearest(std::span<const float> centroids, std::span<const float> attenuation) {
  std::size_t best = 0;
  float least = INFINITY;
  for (std::size_t k = 0; k * attenuation.size() < centroids.size(); ++k) {
    const float* a0 = centroids.data() + k * attenuation.size();
    float distance = 0.0f;
    for (std::size_t c = 0; c < attenuation.size(); ++c)
      distance += (attenuation[c] - a0[c]) * (attenuation[c] - a0[c]);
    if (distance < least) {
      least = distance;
      best = k;
    }
  }
  return best;
}

/// An affine map from attenuation to colour: colour at `mean`, and its derivatives.
struct AffineMap {
  Eigen::VectorXd mean;
  Eigen::Vector3d color;
  Eigen::MatrixXd jacobian;  ///< 3 x channels
};

/// Least squares of what is left over the prior, for derivatives that are off it by `variance`;
/// infinity: without a ridge.
AffineMap affineMapOf(const LearningSamples& samples, std::span<const std::size_t> members,
                      const Eigen::MatrixXd& prior, double variance) {
  const Eigen::Index channels = samples.channels;
  const auto attenuation = [&](std::size_t i) -> Eigen::VectorXd {
    return Eigen::Map<const Eigen::VectorXf>(samples.attenuation.data() + i * std::size_t(channels),
                                             channels)
        .cast<double>();
  };
  const auto color = [&](std::size_t i) -> Eigen::Vector3d {
    return Eigen::Map<const Eigen::Vector3f>(samples.color.data() + 3 * i).cast<double>();
  };
  const double count = double(members.size());
  AffineMap map{Eigen::VectorXd::Zero(channels), Eigen::Vector3d::Zero(), prior};
  for (const std::size_t i : members) {
    map.mean += attenuation(i) / count;
    map.color += color(i) / count;
  }
  // Centred moments: of attenuation, of it with what the prior leaves, and of that alone.
  Eigen::MatrixXd moments = Eigen::MatrixXd::Zero(channels, channels);
  Eigen::MatrixXd crossed = Eigen::MatrixXd::Zero(channels, 3);
  double scatter = 0.0;
  for (const std::size_t i : members) {
    const Eigen::VectorXd x = attenuation(i) - map.mean;
    const Eigen::Vector3d rest = color(i) - map.color - prior * x;
    moments.selfadjointView<Eigen::Lower>().rankUpdate(x);
    crossed += x * rest.transpose();
    scatter += rest.squaredNorm();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(moments);
  const auto& weights = solver.eigenvalues();
  const Eigen::MatrixXd projected = solver.eigenvectors().transpose() * crossed;
  double unexplained = scatter;
  int rank = 0;
  for (Eigen::Index d = 0; d < channels; ++d) {
    if (weights[d] <= kRoundingVariance * count) continue;
    unexplained -= projected.row(d).squaredNorm() / weights[d];
    ++rank;
  }
  // A ridge by what the map cannot explain.
  const double freedom = 3.0 * (count - rank - 1.0);
  const double ridge = (freedom > 0.0 ? std::max(unexplained, 0.0) / freedom : scatter) / variance;
  for (Eigen::Index d = 0; d < channels; ++d) {
    if (weights[d] <= kRoundingVariance * count) continue;
    map.jacobian += projected.row(d).transpose() / (weights[d] + ridge) *
                    solver.eigenvectors().col(d).transpose();
  }
  return map;
}

void append(LearnedTable& table, const AffineMap& map, const float* centroid) {
  const Eigen::VectorXd a0 =
      Eigen::Map<const Eigen::VectorXf>(centroid, table.channels).cast<double>();
  const Eigen::Vector3d color = map.color + map.jacobian * (a0 - map.mean);
  table.centroid.insert(table.centroid.end(), centroid, centroid + table.channels);
  for (Eigen::Index c = 0; c < 3; ++c) {
    for (Eigen::Index k = 0; k < table.channels; ++k)
      table.jacobian.push_back(float(map.jacobian(c, k)));
    table.color.push_back(float(color[c]));
  }
  ++table.clusters;
}

double errorOf(const LearnedTable& table, const LearningSamples& samples,
               const std::vector<std::size_t>& counted) {
  const auto channels = std::size_t(table.channels);
  double sum = 0.0;
  for (const std::size_t i : counted) {
    const glm::dvec3 made =
        learnedColor(table, std::span(samples.attenuation).subspan(i * channels, channels));
    for (std::size_t c = 0; c < 3; ++c) {
      const double off = made[int(c)] - double(samples.color[3 * i + c]);
      sum += off * off;
    }
  }
  return std::sqrt(sum / (3.0 * double(counted.size())));
}

}  // namespace

glm::dvec3 learnedColor(const LearnedTable& table, std::span<const float> attenuation) {
  const std::size_t best = nearest(table.centroid, attenuation), channels = attenuation.size();
  const float* a0 = table.centroid.data() + best * channels;
  glm::dvec3 color;
  for (std::size_t c = 0; c < 3; ++c) {
    const float* row = table.jacobian.data() + (3 * best + c) * channels;
    double sum = table.color[3 * best + c];
    for (std::size_t k = 0; k < channels; ++k)
      sum += double(row[k]) * (double(attenuation[k]) - double(a0[k]));
    color[int(c)] = std::max(sum, 0.0);
  }
  return color;
}

LearnedFit fitLearnedColor(const LearningSamples& samples, std::span<const glm::dvec3> prior,
                           int clusters, std::uint64_t seed) {
  const auto channels = std::size_t(std::max(samples.channels, 0));
  if (channels == 0 || prior.size() != channels || samples.color.size() % 3 != 0 ||
      samples.attenuation.size() != samples.color.size() / 3 * channels)
    throw Error(
        ErrorCode::InvalidArgument,
        fmt::format("{} attenuations of {} channels do not fit {} colours and {} of the "
                    "base function",
                    samples.attenuation.size(), channels, samples.color.size() / 3, prior.size()));
  if (clusters < 1 || clusters > kMostClusters)
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("{} clusters are not 1 to {}", clusters, kMostClusters));
  const std::vector<std::size_t> counted = countedSamples(samples);
  if (counted.empty())
    throw Error(ErrorCode::InvalidArgument,
                "nothing to learn from: no pixel of the training pictures shows anything");

  const std::vector<float> centroids = centroidsOf(samples, counted, clusters, seed);
  std::vector<std::vector<std::size_t>> members(centroids.size() / channels);
  for (const std::size_t i : counted)
    members[nearest(centroids, std::span(samples.attenuation).subspan(i * channels, channels))]
        .push_back(i);
  Eigen::MatrixXd priorMap(3, samples.channels);
  for (std::size_t k = 0; k < channels; ++k)
    for (int c = 0; c < 3; ++c) priorMap(c, Eigen::Index(k)) = prior[k][c];
  // Clusters start from the map of all samples: an edit leads away from what a cluster has seen.
  const Eigen::MatrixXd common = affineMapOf(samples, counted, priorMap, INFINITY).jacobian;
  LearnedFit fit{{samples.channels, 0, {}, {}, {}}};
  for (std::size_t k = 0; k < members.size(); ++k) {
    if (members[k].empty()) continue;
    append(fit.table, affineMapOf(samples, members[k], common, kClusterVariance),
           centroids.data() + k * channels);
  }
  fit.error = errorOf(fit.table, samples, counted);
  return fit;
}

}  // namespace vestige
