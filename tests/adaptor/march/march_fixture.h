// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "tests/adaptor/march/march_scene.h"

namespace vestige {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline const Box kUnit{{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}};

/// A smooth field in (0, 1) without symmetry.
double waves(glm::dvec3 p);

Camera oblique(const Box& box, ImageSize size = {32, 24});
Camera perspective(const Box& box, ImageSize size = {32, 24});

/// World length of the ray of a pixel between two planar depths.
double chord(const RayImage& image, const Camera& camera, std::size_t pixel);

/// Light and chord are conserved, means lie between entry and exit, and there is something to see.
void expectInvariants(const RayImage& image, const MarchRequest& request);

/// All planes but runs and ends agree to `tolerance`.
void expectSame(const RayImage& a, const RayImage& b, double tolerance);

/// Run on each backend.
class March : public testing::TestWithParam<std::string> {
 protected:
  static Marcher make() { return Marcher(sharedDevice(GetParam())); }
  Marcher marcher = make();
};

}  // namespace vestige
