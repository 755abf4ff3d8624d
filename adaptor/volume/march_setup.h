// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "adaptor/compositing/march_types.h"
#include "adaptor/volume/preintegrated_table.h"

namespace vestige {

/// Local space, in which rays are marched in single precision whatever the domain's size and place:
/// (world - centre) / scale, and depth z = (Z - depthOrigin) / scale. The same for all blocks of a
/// domain.
struct MarchFrame {
  glm::dvec3 centre{0.0};
  double scale = 1.0;
  double depthOrigin = 0.0;  ///< Z_0: the least planar depth of the domain's corners

  MarchFrame(const Box& domain, const Camera& camera);
  glm::dvec3 localFromWorld(glm::dvec3 world) const { return (world - centre) / scale; }
};

/// The ray through (x, y), both in [-1/2, 1/2] from the top left of the picture, in local space:
/// origin (at z = 0) = [0] + x [1] + y [2], direction (per unit of z) likewise. Those of
/// multi-perspective cameras then lean toward the pole: per unit of depth from the camera plane by
/// `lean` times the unit vector back from their start to the pole.
struct MarchRays {
  std::array<glm::vec3, 3> origin, direction;
  float firstDepth;   ///< z of the camera plane; rays start there
  float lean = 0.0f;  ///< 1 / κ; 0 = not multi-perspective

  MarchRays(const MarchFrame& frame, const Camera& camera, ImageSize size);
};

/// The edges of all channels in ascending order of value: below, intervals, above, no data; x is
/// the normalised value, y the integral of the base function up to it.
std::vector<glm::vec2> channelEdges(const IntervalPartition& partition,
                                    const PreintegratedTable* base);

/// One axis of a block as march_field.glsl reads it.
struct MarchAxis {
  bool even = true;
  /// Of an even axis: node = local * nodesFromLocal + nodesOrigin, the same in all blocks of a
  /// domain that share the spacing and have samples where they overlap; the first one is whole.
  float nodesFromLocal = 0.0f, nodesOrigin = 0.0f, firstNode = 0.0f;
  float first = 0.0f, spacing = 0.0f;  ///< of its nodes, local
  glm::vec3 guess{0.0f};               ///< of an uneven one
  int width = 0;
  std::vector<glm::vec4> texels;  ///< two rows of `width`: nodes, guesses

  MarchAxis(const std::vector<double>& nodes, double centre, double scale, double domainLow);
  /// Local position of a node, or beyond, of an even axis; 0 where there is but one.
  float nodeAt(int i) const { return first + float(i) * spacing; }
};

/// World length between samples: the request's, or the block's smallest spacing. Throws
/// InvalidArgument when that makes more than a million steps.
double marchStep(const MarchRequest& request, const BlockGrid& grid);

}  // namespace vestige
