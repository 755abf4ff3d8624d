// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include "proxy/classifier/classifier.h"
#include "proxy/gl/device.h"

namespace vestige::test {

/// A stretch of a ray between two samples.
struct Segment {
  FieldSample a, b;
};

/// [segment][channel] what Classifier::glsl() makes of segments in a fragment shader of GLSL ES
/// 3.00, as the explorer runs it. The classifier is a normalised one.
std::vector<float> classifyOnGpu(gl::Device& device, const Classifier& classifier,
                                 std::span<const Segment> segments);
/// The same by its weights().
std::vector<double> classifyOnCpu(const Classifier& classifier, std::span<const Segment> segments);

/// A segment as a shader sees it: every number rounded to float.
Segment rounded(Segment segment);

}  // namespace vestige::test
