// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "proxy/format/layout/sliced_stack.h"
#include "tests/support/scenes.h"

namespace vestige::test {

/// A stretch of a ray along which the field is linear: planar depths and values at its ends. Both
/// values finite, or the stretch has no data.
struct LinearStretch {
  double z0, z1, f0, f1;
};
using StretchSink = std::function<void(const LinearStretch&)>;

/// A stack of an orthographic view from rays that are linear bit by bit: stretches(pixel, sink)
/// calls sink for each, front to back without gaps, from where the ray enters the domain to where
/// it leaves. `header` needs field, camera, size, domain, partition and slabDepths. Sharing no code
/// with the adaptor's march; pixels on all cores.
SlicedStack walkedStack(
    ProxyHeader header, int levels,
    const std::function<void(std::size_t pixel, const StretchSink& sink)>& stretches);

/// The stack of a scene, in equal slabs between the least and greatest depth of its domain.
SlicedStack walkedStack(const Scene& scene, const Camera& camera, ImageSize size,
                        const IntervalPartition& partition, int slabs, int levels,
                        int samplesPerVoxel = 2);

/// The faces of equal slabs between the least and greatest depth of a domain.
std::vector<double> evenSlabs(const Camera& camera, const Box& domain, int slabs);

/// A camera along an axis, forward = +/-1 of it, whose pixels stand on the samples of the two other
/// axes, and its size.
struct VoxelView {
  Camera camera;
  ImageSize size;
};
VoxelView voxelView(const Scene& scene, glm::dvec3 forward, glm::dvec3 up);

}  // namespace vestige::test
