// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "adaptor/compositing/march_types.h"
#include "proxy/camera/camera.h"
#include "proxy/transfer/interval_partition.h"
#include "proxy/transfer/transfer_function.h"
#include "tests/support/scenes.h"

// The project's truth: rays through a raw field, front to back, in double precision on all cores,
// sharing no code with the adaptor's march. Within a sub-step the field is taken as linear between
// two trilinear samples; everything else is integrated exactly or by sub-steps. It converges with
// `samplesPerVoxel` (support_test.cpp shows it: 4 and 8 differ by less than 1/1000).

namespace vestige::test {

/// Linear RGB over black, row by row from the top.
struct RgbPicture {
  ImageSize size;
  std::vector<float> rgb;
};

/// Optics of a value: extinction in 1 / world unit, and linear RGB.
struct Optics {
  double extinction = 0.0;
  glm::dvec3 color{0.0};
};
using Medium = std::function<Optics(double value)>;

/// Pictures of one view with transfer functions that are constant on each channel; steps are split
/// exactly where the field crosses a bound. All looks share one walk through the field.
std::vector<RgbPicture> renderIntervals(const Scene& scene, const Camera& camera, ImageSize size,
                                        const IntervalPartition& partition,
                                        std::span<const IntervalLook> looks,
                                        int samplesPerVoxel = 4);

/// Pictures of one view with functions of the value; each half of a sub-step takes the optics at
/// its middle.
std::vector<RgbPicture> renderContinuous(const Scene& scene, const Camera& camera, ImageSize size,
                                         std::span<const Medium> media, int samplesPerVoxel = 4);

/// The reference picture of a request (method §1): emission and absorption under its base function,
/// lit by a headlight if it asks for one. Along a ray the field is linear between samples at the
/// request's planar depths (method §1), and lit by the gradient in the middle of a step; all else
/// is integrated, split where the base function has its points.
RgbPicture renderReference(const Scene& scene, const MarchRequest& request);

/// A function of the value by a table of `entries` linear segments over [low, high], clamped
/// beyond; not a number stays transparent.
Medium tabulated(const Medium& medium, double low, double high, int entries = 1 << 14);

/// What Marcher::march makes of the same request for the whole domain (the reference by splitting
/// steps at bounds only, without its light).
RayImage marchOnCpu(const Scene& scene, const MarchRequest& request, int samplesPerVoxel = 4);

}  // namespace vestige::test
