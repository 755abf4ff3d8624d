// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "proxy/gl/device.h"

namespace vestige::test {

/// A way to classify three fields and a gradient by primitives ([Kniss 2003] Table
/// 5).
struct ClassifyWay {
  std::string name;
  /// GLSL ES 3.00 that defines
  ///   void classify(vec4 a, vec4 b, float gradientA, float gradientB, out float weights[CHANNELS])
  std::string glsl;
};

/// Least seconds of some frames in which every pixel classifies 128 stretches along a ray through
/// a volume of three fields and a gradient and composites them, for each way; ways take turns.
std::vector<double> secondsToClassify(gl::Device& device, const std::vector<ClassifyWay>& ways,
                                      int primitives, int frames = 5);

/// The rows of Table 5: the product of separable 2-D tables, a Gaussian and a triangular one at a
/// sample, and integrated analytically: by Table 4 (K diagonal, as all of these), and both by
/// Classifier::glsl() (K full).
std::vector<ClassifyWay> tableOfWays();

}  // namespace vestige::test
