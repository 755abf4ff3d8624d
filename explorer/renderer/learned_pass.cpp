// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/renderer/learned_pass.h"

#include <fmt/format.h>

#include "explorer/stacks/stack_segments.h"
#include "fullscreen_vert.embed.h"
#include "learned_frag.embed.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

/// The table as learned.frag reads it: channels in groups of four.
gl::Texture textureOf(const LearnedTable& table) {
  const auto channels = std::size_t(table.channels), groups = (channels + 3) / 4;
  const std::size_t width = 4 * groups + 1;
  std::vector<float> texels(4 * width * std::size_t(table.clusters), 0.0f);
  for (std::size_t k = 0; k < std::size_t(table.clusters); ++k) {
    float* row = texels.data() + 4 * width * k;
    const auto place = [&](const float* from, std::size_t count, std::size_t texel) {
      std::copy(from, from + count, row + 4 * texel);
    };
    place(table.centroid.data() + k * channels, channels, 0);
    for (std::size_t c = 0; c < 3; ++c)
      place(table.jacobian.data() + (3 * k + c) * channels, channels, (c + 1) * groups);
    place(table.color.data() + 3 * k, 3, 4 * groups);
  }
  return gpu::texture2D(GL_RGBA32F, {int(width), table.clusters}, GL_RGBA, GL_FLOAT, texels.data());
}

}  // namespace

gl::Texture attenuationFrom(EditPass& edit, ViewData& view, std::string_view from,
                            const TransferFunction& function) {
  if (!view.has(from) || !view.partition()) {
    throw Error(ErrorCode::NotFound, "view '" + view.header().view + "' has no " +
                                         std::string(from) + " proxy to make attenuation of");
  }
  const IntervalPartition& partition = *view.partition();
  if (from == kind::kSliced) {
    return edit.attenuation(view.stackSegments(1, Uncertain::Likely),
                            FineChannels(partition, 1).table(function));
  }
  const IntervalLook look = function.onIntervals(partition);
  if (from == kind::kLength) {
    return edit.attenuation(view.segments(Via::Length, Order::Auto), tableForLength(look));
  }
  if (view.isCustomized(from)) {
    throw Error(ErrorCode::NotFound,
                "the run customised the attenuation of view '" + view.header().view +
                    "' by position, which its intervals do not know: learn from lengths or stacks");
  }
  if (!view.header().base) {
    throw Error(ErrorCode::Format,
                "the attenuation proxy does not say under which transfer function it was made");
  }
  return edit.attenuation(view.segments(Via::Attenuation, Order::Auto),
                          tableForAttenuation(look, view.header().base->onIntervals(partition)));
}

std::string learnedNote(const ProxyHeader& header) {
  const std::size_t pictures = header.looks.size();
  return fmt::format("{} clusters of {} from {} picture{} ({}), RMS error {:.4f} on {}",
                     header.size.height, header.learned->from, pictures, pictures == 1 ? "" : "s",
                     header.shading, header.learned->error, pictures == 1 ? "it" : "them");
}

Picture LearnedPass::render(const gl::Texture& attenuation, ImageSize size,
                            const LearnedTable& table, const gl::Texture* enhancement) {
  const gl::Functions& gl = gl::functions();
  auto found = programs_.find(enhancement != nullptr);
  if (found == programs_.end()) {
    std::vector<std::pair<std::string, std::string>> defines;
    if (enhancement) defines.emplace_back("ENHANCED", "1");
    found = programs_
                .emplace(enhancement != nullptr,
                         gpu::program(embedded::fullscreen_vert, embedded::learned_frag, defines))
                .first;
  }
  const gl::Program& program = found->second;
  const gl::Texture values = textureOf(table);
  const gl::Texture target = gpu::texture2D(GL_RGBA32F, size, GL_RGBA, GL_FLOAT, nullptr);
  const gpu::Attachment attachment{&target};
  gpu::bindTarget(framebuffer_, {&attachment, 1}, size);
  program.use();
  gpu::bindSampler(program, "attenuation", 0, attenuation);
  gpu::bindSampler(program, "table", 1, values);
  if (enhancement) gpu::bindSampler(program, "enhancement", 2, *enhancement);
  gl.Uniform1i(program.uniform("groups"), (table.channels + 3) / 4);
  gl.Uniform1i(program.uniform("clusters"), table.clusters);
  gpu::drawFullscreen(empty_);
  gl::checkErrors("learned colours");
  return {size, gpu::readFloats(size)};
}

}  // namespace vestige
