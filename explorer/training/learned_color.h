// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "proxy/format/layout/learned_layout.h"

namespace vestige {

/// What colours are learned from: pixels with their attenuation and their colour.
struct LearningSamples {
  int channels = 0;
  std::vector<float> attenuation;  ///< [sample][channel]
  std::vector<float> color;        ///< [sample][r, g, b] premultiplied linear
};

/// A table and the root of its mean squared error on the samples that it was fitted to.
struct LearnedFit {
  LearnedTable table;
  double error = 0.0;
};

/// Fits learned colours [Tikhonova 2010, §6.2, eq. 8-9]: k-means of the attenuations, then
/// in each cluster the affine map of least squared error. Where the samples of a cluster say
/// nothing (directions in which they do not vary, or by less than colour scatters about the map),
/// derivatives are those of one map for all samples, and where these say nothing `prior`, one
/// colour a channel: those of the base function (eq. 6). Samples that are not finite, or without
/// any attenuation, do not count; clusters without samples are left out. The same samples and seed
/// give the same table. Throws InvalidArgument when spans do not fit each other, `clusters` is not
/// in [1, kMostClusters] or no sample is left.
LearnedFit fitLearnedColor(const LearningSamples& samples, std::span<const glm::dvec3> prior,
                           int clusters, std::uint64_t seed = 1);

/// The colour that a table gives an attenuation, as learned.frag: nearest centroid, affine map,
/// at least 0.
glm::dvec3 learnedColor(const LearnedTable& table, std::span<const float> attenuation);

}  // namespace vestige
