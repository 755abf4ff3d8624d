// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/gpu/probed_rays.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "proxy/gl/device.h"

namespace vestige {
namespace {

/// Waves that neighbours tell, a disc with a hard edge, and nothing to the right; the red of the
/// information counts nothing but depth.
constexpr const char* kTriangle = R"(#version 300 es
void main() {
  gl_Position = vec4(float((gl_VertexID & 1) * 4 - 1), float((gl_VertexID & 2) * 2 - 1), 0.0, 1.0);
}
)";

constexpr const char* kPattern = R"(#version 300 es
precision highp float;
uniform float pixelStep;
layout(location = 0) out vec4 color;
layout(location = 1) out vec4 info;
void main() {
  vec2 at = (gl_FragCoord.xy - 0.5) * pixelStep + 0.5;
  color = vec4(0.5 + 0.4 * sin(at.x * 0.05), 0.5 + 0.4 * cos(at.y * 0.04), 0.25, 1.0);
  info = vec4(3.0, 0.125, 0.0, 0.0);
  if (length(at - vec2(40.0, 33.0)) < 17.3) color.b = 0.9;
  if (at.x > 90.0) {
    color = vec4(0.0);
    info.r = 1e30;
  }
}
)";

struct Made {
  std::vector<float> color, info;
};

Made made(ImageSize size, double tolerance, int* draws = nullptr) {
  Made result;
  gl::Device::create()->run([&] {
    const gl::Program pattern = gpu::program(kTriangle, kPattern);
    const gl::VertexArray empty;
    ProbedRays rays;
    const auto target = [&] {
      return gpu::texture2D(GL_RGBA32F, size, GL_RGBA, GL_FLOAT, nullptr);
    };
    const gl::Texture color = target(), info = target();
    rays.render(color, info, size, tolerance, [&](float pixelStep) {
      if (draws) ++*draws;
      pattern.use();
      gl::functions().Uniform1f(pattern.uniform("pixelStep"), pixelStep);
      gpu::drawFullscreen(empty);
    });
    result = {gpu::readFloats(size, 0), gpu::readFloats(size, 1)};
  });
  return result;
}

TEST(ProbedRays, DifferByLessThanTheToleranceAndKeepEdges) {
  for (const ImageSize size : {ImageSize{101, 72}, {100, 71}}) {
    int draws = 0;
    const Made all = made(size, 0.0), probed = made(size, 1.0 / 64.0, &draws);
    EXPECT_EQ(draws, 2);
    std::size_t guessed = 0;
    for (std::size_t i = 0; i < all.color.size(); ++i) {
      ASSERT_NEAR(all.color[i], probed.color[i], 1.0 / 512.0) << i / 4 % std::size_t(size.width);
      guessed += all.color[i] != probed.color[i];
    }
    EXPECT_GT(guessed, all.color.size() / 8) << "most is not cast";
    for (std::size_t i = 0; i < all.info.size(); i += 4) {
      ASSERT_EQ(all.info[i], probed.info[i]) << "depth";
      ASSERT_EQ(all.info[i + 1], probed.info[i + 1]) << "guess";
    }
  }
}

TEST(ProbedRays, NoToleranceCastsAllAtOnce) {
  int draws = 0;
  made({16, 16}, 0.0, &draws);
  EXPECT_EQ(draws, 1);
}

TEST(ProbedRays, PicturesOfOnePixelHoldTheirProbe) {
  EXPECT_EQ(made({1, 1}, 1.0 / 64.0).color, made({1, 1}, 0.0).color);
}

}  // namespace
}  // namespace vestige
