// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/layers/virtual_pass.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <numbers>

#include "explorer/layers/layers.h"
#include "explorer/recomposition/segments.h"
#include "fullscreen_vert.embed.h"
#include "proxy/base/error.h"
#include "virtual_frag.embed.h"

namespace vestige {
namespace {

constexpr int kMaxChannels = IntervalPartition::kMaxIntervals + 3;  // as in virtual.frag

struct SheetLists {
  std::vector<std::uint32_t> first, entries;
};

SheetLists listsOf(const LengthPlanes& lengths, double unit) {
  std::vector<int> layerOf;
  const LayerPlanes starts = layersFromLengths(lengths, layerOf);
  SheetLists lists;
  const double depthPerLength = 1.0 / std::hypot(1.0, 1.0 / lengths.header.camera.convergence);
  const std::size_t pixels = starts.size.pixels();
  lists.first.assign(pixels, SegmentLists::kNone);
  struct Entry {
    float start, end;
    std::uint32_t word;
  };
  std::vector<Entry> ray;
  for (std::size_t i = 0; i < pixels; ++i) {
    ray.clear();
    for (std::size_t k = 0; k < layerOf.size(); ++k) {
      if (layerOf[k] < 0 || !(lengths.length[k][i] > 0.0f)) continue;
      const auto layer = std::size_t(layerOf[k]);
      const float start = starts.depth[layer][i];
      if (!std::isfinite(start)) continue;
      // One run ends where its length does; several lie about their mean depth.
      const double extent = std::max(double(lengths.length[k][i]) * depthPerLength,
                                     2.0 * (double(lengths.depth[k][i]) - double(start)));
      ray.push_back({start, float(double(start) + extent),
                     amountBits(float(double(lengths.length[k][i]) / unit)) |
                         std::uint32_t(k) << 16 |
                         (starts.likely[layer][i] ? SegmentLists::kAmbiguous : 0u)});
    }
    if (ray.empty()) continue;
    std::stable_sort(ray.begin(), ray.end(),
                     [](const Entry& a, const Entry& b) { return a.start < b.start; });
    ray.back().word |= SegmentLists::kLast;
    lists.first[i] = std::uint32_t(lists.entries.size());
    for (const Entry& entry : ray) {
      lists.entries.push_back(entry.word);
      lists.entries.push_back(std::bit_cast<std::uint32_t>(entry.start));
      lists.entries.push_back(std::bit_cast<std::uint32_t>(entry.end));
    }
  }
  return lists;
}

double unitOf(const Box& domain) { return domain.diagonal() > 0.0 ? domain.diagonal() : 1.0; }

const LengthPlanes& requireDistorted(const LengthPlanes& lengths) {
  if (lengths.header.camera.projection != Projection::MultiPerspective) {
    throw Error(ErrorCode::Config, "look key 'source' is virtual, but view '" +
                                       lengths.header.view + "' is not multi-perspective");
  }
  return lengths;
}

gl::Texture firstOf(const LengthPlanes& lengths, const SheetLists& lists) {
  return gpu::texture2D(GL_R32UI, lengths.header.size, GL_RED_INTEGER, GL_UNSIGNED_INT,
                        lists.first.data());
}

}  // namespace

SheetTextures::SheetTextures(const LengthPlanes& lengths)
    : camera(requireDistorted(lengths).header.camera),
      size(lengths.header.size),
      domain(lengths.header.domain),
      unit(unitOf(lengths.header.domain)),
      first(GL_TEXTURE_2D),
      entries(GL_TEXTURE_2D) {
  const SheetLists lists = listsOf(lengths, unit);
  first = firstOf(lengths, lists);
  entries = gpu::listTexture(lists.entries);
}

VirtualView VirtualPass::render(const SheetTextures& sheets, const ChannelTable& table,
                                const Camera& target, ImageSize size, Lookup lookup,
                                const Stretch& stretch) {
  if (target.projection == Projection::MultiPerspective) {
    throw Error(ErrorCode::InvalidArgument,
                "virtual rays cannot be those of a multi-perspective camera");
  }
  if (table.strength.size() > std::size_t(kMaxChannels)) {
    throw Error(ErrorCode::InvalidArgument,
                "a channel table has " + std::to_string(table.strength.size()) + " strengths");
  }
  const gl::Functions& gl = gl::functions();
  if (!program_) program_ = gpu::program(embedded::fullscreen_vert, embedded::virtual_frag);
  const gl::Program& march = *program_;
  const gl::Texture color = gpu::texture2D(GL_RGBA32F, size, GL_RGBA, GL_FLOAT, nullptr);
  const gl::Texture info = gpu::texture2D(GL_RGBA32F, size, GL_RGBA, GL_FLOAT, nullptr);
  const std::array<gpu::Attachment, 2> attachments{{{&color}, {&info}}};
  gpu::bindTarget(framebuffer_, attachments, size);
  march.use();
  gpu::bindSampler(march, "firstEntry", 0, sheets.first);
  gpu::bindSampler(march, "entries", 1, sheets.entries);
  gl.Uniform1i(march.uniform("listWidthLog2"), gpu::kListWidthLog2);
  std::array<float, 4 * kMaxChannels> channels{};
  for (std::size_t k = 0; k < table.strength.size(); ++k) {
    for (int c = 0; c < 3; ++c) channels[4 * k + std::size_t(c)] = float(table.color[k][c]);
    channels[4 * k + 3] = float(-table.strength[k] * sheets.unit * std::numbers::log2e);
  }
  gl.Uniform4fv(march.uniform("channels"), kMaxChannels, channels.data());

  // Rays as origin + t direction, t the target's planar depth: in the stored camera's eye space,
  // and in units in which the domain is [-1, 1]^3.
  const bool perspective = target.projection == Projection::Perspective;
  const double height = perspective ? 2.0 * std::tan(0.5 * target.fieldOfView) : target.viewHeight;
  const glm::dvec3 across = target.right() * (height * target.aspect(size));
  const glm::dvec3 down = target.up * -height;
  const glm::dvec3 none(0.0);
  const glm::dvec3 ahead =
      target.forward - target.shift.x / target.aspect(size) * across + target.shift.y * down;
  std::array<glm::dvec3, 3> origin{target.position, perspective ? none : across,
                                   perspective ? none : down};
  std::array<glm::dvec3, 3> direction{perspective ? ahead : target.forward,
                                      perspective ? across : none, perspective ? down : none};
  if (!stretch.none()) {
    origin[0] = glm::dvec3(stretch.worldFromScene() * glm::dvec4(origin[0], 1.0));
    for (std::size_t i = 1; i < 3; ++i) origin[i] /= stretch.factors();
    for (glm::dvec3& way : direction) way /= stretch.factors();
  }
  const glm::dmat3 eye(sheets.camera.eyeFromWorld());
  const glm::dvec3 half = glm::max(0.5 * sheets.domain.size(), glm::dvec3(1e-9 * sheets.unit));
  std::array<glm::vec3, 3> eyeOrigin, eyeDirection, boxOrigin, boxDirection;
  for (std::size_t i = 0; i < 3; ++i) {
    eyeOrigin[i] = eye * (origin[i] - (i == 0 ? sheets.camera.position : none));
    eyeDirection[i] = eye * direction[i];
    boxOrigin[i] = (origin[i] - (i == 0 ? sheets.domain.center() : none)) / half;
    boxDirection[i] = direction[i] / half;
  }
  const auto set = [&](const char* name, const std::array<glm::vec3, 3>& v) {
    gl.Uniform3fv(march.uniform(name), 3, glm::value_ptr(v[0]));
  };
  set("originAt", eyeOrigin);
  set("directionAt", eyeDirection);
  set("boxOriginAt", boxOrigin);
  set("boxDirectionAt", boxDirection);
  const Camera& camera = sheets.camera;
  const double pixel = camera.viewHeight / sheets.size.height;
  gl.Uniform2f(march.uniform("pixelWorld"), float(pixel * camera.pixelAspect), float(pixel));
  gl.Uniform1f(march.uniform("lean"), float(1.0 / camera.convergence));
  gl.Uniform2f(march.uniform("targetSize"), float(size.width), float(size.height));
  gl.Uniform1i(march.uniform("undistorted"), lookup == Lookup::Undistorted);
  gpu::drawFullscreen(empty_);

  VirtualView view = readDrawnView(size);
  // A framebuffer that had two colour attachments must not keep the second.
  gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, GL_TEXTURE_2D, 0, 0);
  gl::checkErrors("virtual ray marching");
  return view;
}

}  // namespace vestige
