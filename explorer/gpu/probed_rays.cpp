// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/gpu/probed_rays.h"

#include <array>

#include "between_frag.embed.h"
#include "fullscreen_vert.embed.h"
#include "spread_frag.embed.h"

namespace vestige {

ProbedRays::ProbedRays()
    : between_(gpu::program(embedded::fullscreen_vert, embedded::between_frag)),
      spread_(gpu::program(embedded::fullscreen_vert, embedded::spread_frag)) {}

void ProbedRays::render(const gl::Texture& color, const gl::Texture& info, ImageSize size,
                        double tolerance, const Cast& cast) {
  const gl::Functions& gl = gl::functions();
  const std::array<gpu::Attachment, 2> whole{{{&color}, {&info}}};
  if (!(tolerance > 0.0)) {
    gpu::bindTarget(full_, whole, size);
    cast(1.0f);
    return;
  }
  const ImageSize half{size.width / 2 + 1, size.height / 2 + 1};
  const auto target = [&] { return gpu::texture2D(GL_RGBA32F, half, GL_RGBA, GL_FLOAT, nullptr); };
  const gl::Texture probes = target(), probeInfo = target(), betweenInfo = target();
  const std::array<gpu::Attachment, 2> rays{{{&probes}, {&probeInfo}}};
  gpu::bindTarget(half_, rays, half);
  cast(2.0f);

  const gl::Texture between = gpu::textureArray(GL_RGBA32F, half, 3);
  const std::array<gpu::Attachment, 4> betweens{
      {{&between, 0}, {&between, 1}, {&between, 2}, {&betweenInfo}}};
  gpu::bindTarget(betweens_, betweens, half);
  between_.use();
  gpu::bindSampler(between_, "probes", 0, probes);
  gpu::bindSampler(between_, "probeInfo", 1, probeInfo);
  gl.Uniform1f(between_.uniform("tolerance"), float(tolerance));
  gpu::drawFullscreen(empty_);

  // What is known is laid down nearer than the triangle that casts the rest.
  const gl::Texture depth =
      gpu::texture2D(GL_DEPTH_COMPONENT32F, size, GL_DEPTH_COMPONENT, GL_FLOAT, nullptr);
  gpu::bindTarget(full_, whole, size, &depth);
  gl.Enable(GL_DEPTH_TEST);
  gl.DepthFunc(GL_ALWAYS);
  gl.DepthMask(GL_TRUE);
  spread_.use();
  gpu::bindSampler(spread_, "probes", 0, probes);
  gpu::bindSampler(spread_, "probeInfo", 1, probeInfo);
  gpu::bindSampler(spread_, "between", 2, between);
  gpu::bindSampler(spread_, "betweenInfo", 3, betweenInfo);
  gpu::drawFullscreen(empty_);
  gl.DepthFunc(GL_LESS);
  gl.DepthMask(GL_FALSE);
  cast(1.0f);
  gl.DepthMask(GL_TRUE);
  gl.Disable(GL_DEPTH_TEST);
  gl::checkErrors("casting rays between probes");
  gpu::bindTarget(full_, whole, size);  // the depth goes, the pictures can be read
}

}  // namespace vestige
