// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/layers/depth_layer_pass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_access.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "customize_frag.embed.h"
#include "fullscreen_vert.embed.h"
#include "light_frag.embed.h"
#include "proxy/base/error.h"
#include "resolve_frag.embed.h"
#include "warp_frag.embed.h"
#include "warp_vert.embed.h"

namespace vestige {
namespace {

/// Depth may jump by this many pixels between neighbours on one surface when no normal tells more.
constexpr double kPlainJump = 3.0;
/// ... and by this many when normals are derived from it.
constexpr double kDeriveJump = 6.0;
/// Stretched surface spans gaps up to this share of the domain's diagonal.
constexpr double kLongestGap = 0.05;
constexpr float kNothing = 1e30f;

/// World units a pixel (at depth 1 for perspective), whether it grows with depth, a jump, and how
/// much a ray leans toward the pole a unit of depth: the distortion Z/κ is undone by the shaders.
glm::vec4 unprojectOf(const Camera& camera, ImageSize size, double jump) {
  if (camera.projection == Projection::Perspective) {
    return {2.0 * std::tan(0.5 * camera.fieldOfView) / size.height, 1.0, jump, 0.0};
  }
  const bool distorted = camera.projection == Projection::MultiPerspective;
  return {camera.viewHeight / size.height, 0.0, jump, distorted ? 1.0 / camera.convergence : 0.0};
}

/// `target` with near and far planes that bracket everything that the layers can hold.
Camera bracketed(Camera camera, const Camera& source, const Stretch& stretch) {
  const glm::dvec3 factors = stretch.factors();
  const double most = std::max({1.0, factors.x, factors.y, factors.z});
  const double reach =
      most * (source.farDepth - source.nearDepth + glm::length(camera.position - source.position));
  const glm::dvec3 middle = stretch.point(
      source.position + source.forward * (0.5 * (source.nearDepth + source.farDepth)));
  const double depth = glm::dot(middle - camera.position, camera.forward);
  camera.farDepth = depth + reach;
  camera.nearDepth = camera.projection == Projection::Perspective
                         ? std::max(depth - reach, 1e-3 * (depth + reach))
                         : depth - reach;
  return camera;
}

}  // namespace

LayerTextures::LayerTextures(const LayerPlanes& planes)
    : camera(planes.camera),
      size(planes.size),
      count(int(planes.depth.size())),
      depth(gpu::textureArray(GL_R32F, planes.size, std::max(1, count))),
      normal(gpu::textureArray(GL_RGBA16F, planes.size, std::max(1, count))),
      domain(planes.domain) {
  const std::size_t pixels = size.pixels();
  std::vector<float> finite(pixels), rgba(4 * pixels);
  for (int layer = 0; layer < count; ++layer) {
    const std::vector<float>& z = planes.depth[std::size_t(layer)];
    for (std::size_t i = 0; i < pixels; ++i) finite[i] = std::isfinite(z[i]) ? z[i] : kNothing;
    gpu::uploadLayer(depth, size, layer, GL_RED, GL_FLOAT, finite.data());
    const std::vector<float>& n = planes.normal[std::size_t(layer)];
    storedNormals = storedNormals || !n.empty();
    std::fill(rgba.begin(), rgba.end(), 0.0f);
    for (std::size_t i = 0; i < (n.empty() ? 0 : pixels); ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        const float value = n[3 * i + c];
        rgba[4 * i + c] = std::isfinite(value) ? value : 0.0f;
      }
    }
    const bool doubtful =
        std::size_t(layer) < planes.likely.size() && !planes.likely[std::size_t(layer)].empty();
    for (std::size_t i = 0; i < (doubtful ? pixels : 0); ++i) {
      rgba[4 * i + 3] = float(planes.likely[std::size_t(layer)][i]);
    }
    gpu::uploadLayer(normal, size, layer, GL_RGBA, GL_FLOAT, rgba.data());
  }
}

DepthLayerPass::DepthLayerPass() = default;

const gl::Program& DepthLayerPass::program(
    const std::string& name, std::string_view vertex, std::string_view fragment,
    const std::vector<std::pair<std::string, std::string>>& defines) {
  const auto found = programs_.find(name);
  if (found != programs_.end()) return found->second;
  return programs_.emplace(name, gpu::program(vertex, fragment, defines)).first->second;
}

gl::Texture DepthLayerPass::light(const LayerTextures& layers, const LightSetup& setup) {
  const gl::Functions& gl = gl::functions();
  gl::Texture result = gpu::textureArray(GL_RGBA32F, layers.size, layers.count);
  const gl::Program& lit = program("light", embedded::fullscreen_vert, embedded::light_frag);
  lit.use();
  gpu::bindSampler(lit, "depth", 0, layers.depth);
  gpu::bindSampler(lit, "normals", 1, layers.normal);
  const glm::vec4 unproject = unprojectOf(layers.camera, layers.size, kDeriveJump);
  gl.Uniform4fv(lit.uniform("unproject"), 1, glm::value_ptr(unproject));
  std::array<float, 32> from{};
  const std::size_t count = std::min<std::size_t>(setup.directions.size(), 8);
  for (std::size_t i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c) from[4 * i + std::size_t(c)] = float(setup.directions[i][c]);
    from[4 * i + 3] = float(setup.intensities[i]);
  }
  gl.Uniform1i(lit.uniform("lights"), GLint(count));
  gl.Uniform4fv(lit.uniform("lightFrom"), 8, from.data());
  gl.Uniform4f(lit.uniform("material"), float(setup.material.ambient),
               float(setup.material.diffuse), float(setup.material.specular),
               float(setup.material.shininess));
  const glm::vec4 viewer(setup.viewer);
  gl.Uniform4fv(lit.uniform("viewer"), 1, glm::value_ptr(viewer));
  const glm::mat4 stretch(setup.stretch);
  const glm::mat3 stretchNormal(setup.stretchNormal);
  gl.UniformMatrix4fv(lit.uniform("stretch"), 1, GL_FALSE, glm::value_ptr(stretch));
  gl.UniformMatrix3fv(lit.uniform("stretchNormal"), 1, GL_FALSE, glm::value_ptr(stretchNormal));
  gl.Uniform1i(lit.uniform("shade"), setup.shade);
  gl.Uniform1i(lit.uniform("derive"), setup.normals == NormalSource::Depth);
  gl.Uniform2f(lit.uniform("ao"), setup.ao.on ? float(setup.ao.strength) : 0.0f,
               float(setup.aoRadiusWorld));
  for (int layer = 0; layer < layers.count; ++layer) {
    const gpu::Attachment attachment{&result, layer};
    gpu::bindTarget(framebuffer_, {&attachment, 1}, layers.size);
    gl.Uniform1i(lit.uniform("layer"), layer);
    gpu::drawFullscreen(empty_);
  }
  gl::checkErrors("lighting depth layers");
  return result;
}

gl::Texture DepthLayerPass::customized(const LayerTextures& layers, const gl::Texture& colors,
                                       const CustomTextures& custom) {
  const gl::Functions& gl = gl::functions();
  gl::Texture result = gpu::textureArray(GL_RGBA32F, layers.size, layers.count);
  const gl::Program& pass =
      program("customize", embedded::fullscreen_vert, embedded::customize_frag);
  pass.use();
  gpu::bindSampler(pass, "colors", 0, colors);
  gpu::bindSampler(pass, "depth", 1, layers.depth);
  gpu::bindSampler(pass, "customOptics", 2, custom.optics());
  const glm::vec4 unproject = unprojectOf(layers.camera, layers.size, 0.0);
  gl.Uniform4fv(pass.uniform("unproject"), 1, glm::value_ptr(unproject));
  const glm::mat4 customFromEye(custom.textureFromWorld() * layers.camera.worldFromEye());
  gl.UniformMatrix4fv(pass.uniform("customFromEye"), 1, GL_FALSE, glm::value_ptr(customFromEye));
  for (int layer = 0; layer < layers.count; ++layer) {
    const gpu::Attachment target{&result, layer};
    gpu::bindTarget(framebuffer_, {&target, 1}, layers.size);
    gl.Uniform1i(pass.uniform("layer"), layer);
    gpu::drawFullscreen(empty_);
  }
  gl::checkErrors("customising layers");
  return result;
}

WarpedView DepthLayerPass::warp(const LayerTextures& layers, const gl::Texture& colors,
                                const gl::Texture* light, const Camera& target, ImageSize size,
                                bool unseen, const Stretch& stretch) {
  const gl::Functions& gl = gl::functions();
  const gl::Texture newColors = gpu::textureArray(GL_RGBA32F, size, layers.count);
  const gl::Texture newPositions = gpu::textureArray(GL_RGBA32F, size, layers.count);
  const gl::Texture depthBuffer =
      gpu::texture2D(GL_DEPTH_COMPONENT32F, size, GL_DEPTH_COMPONENT, GL_FLOAT, nullptr);
  const gl::Program& warp = program("warp", embedded::warp_vert, embedded::warp_frag);
  warp.use();
  gpu::bindSampler(warp, "depth", 0, layers.depth);
  gpu::bindSampler(warp, "normals", 1, layers.normal);
  gpu::bindSampler(warp, "colors", 2, colors);
  gpu::bindSampler(warp, "light", 3, light ? *light : colors);
  gl.Uniform1i(warp.uniform("lit"), light != nullptr);
  const glm::vec4 unproject = unprojectOf(layers.camera, layers.size, kPlainJump);
  gl.Uniform4fv(warp.uniform("unproject"), 1, glm::value_ptr(unproject));
  const Camera camera = bracketed(target, layers.camera, stretch);
  const glm::dmat4 eyeFromEye =
      camera.eyeFromWorld() * stretch.sceneFromWorld() * layers.camera.worldFromEye();
  glm::mat4 clipFromEye(camera.clipFromEye(size.aspect()) * eyeFromEye);
  for (int column = 0; column < 4; ++column) clipFromEye[column][1] *= -1.0f;  // rows from the top
  // Relative to the domain's centre, as far from the origin floats cannot tell its faces apart.
  const glm::mat4 domainFromEye(glm::translate(glm::dmat4(1.0), -layers.domain.center()) *
                                layers.camera.worldFromEye());
  gl.UniformMatrix4fv(warp.uniform("domainFromEye"), 1, GL_FALSE, glm::value_ptr(domainFromEye));
  const glm::vec3 half(0.5 * (layers.domain.high - layers.domain.low));
  gl.Uniform3fv(warp.uniform("domainHalf"), 1, glm::value_ptr(half));
  gl.Uniform1f(warp.uniform("longestGap"), float(kLongestGap * layers.domain.diagonal()));
  gl.UniformMatrix4fv(warp.uniform("clipFromEye"), 1, GL_FALSE, glm::value_ptr(clipFromEye));
  const glm::vec4 planarDepth(-glm::row(eyeFromEye, 2));
  gl.Uniform4fv(warp.uniform("planarDepth"), 1, glm::value_ptr(planarDepth));

  gl.Enable(GL_DEPTH_TEST);
  gl.DepthFunc(GL_LEQUAL);
  gl.DepthMask(GL_TRUE);
  gl.BindVertexArray(empty_.id());
  const std::array<GLsizei, 3> vertices{6 * layers.size.width * layers.size.height,
                                        6 * (layers.size.width - 1) * (layers.size.height - 1),
                                        18 * layers.size.width * layers.size.height};
  const int parts = unseen ? 3 : 2;
  for (int layer = 0; layer < layers.count; ++layer) {
    const std::array<gpu::Attachment, 2> attachments{{{&newColors, layer}, {&newPositions, layer}}};
    gpu::bindTarget(framebuffer_, attachments, size, &depthBuffer);
    const std::array<float, 4> transparent{}, nothing{kNothing, 0.0f, 0.0f, 0.0f};
    const float farthest = 1.0f;
    gl.ClearBufferfv(GL_COLOR, 0, transparent.data());
    gl.ClearBufferfv(GL_COLOR, 1, nothing.data());
    gl.ClearBufferfv(GL_DEPTH, 0, &farthest);
    gl.Uniform1i(warp.uniform("layer"), layer);
    for (int part = 0; part < parts; ++part) {
      gl.Uniform1i(warp.uniform("part"), part);
      gl.DrawArrays(GL_TRIANGLES, 0, vertices[std::size_t(part)]);
    }
  }
  gl.Disable(GL_DEPTH_TEST);

  const gl::Texture color = gpu::texture2D(GL_RGBA32F, size, GL_RGBA, GL_FLOAT, nullptr);
  const gl::Texture info = gpu::texture2D(GL_RGBA32F, size, GL_RGBA, GL_FLOAT, nullptr);
  const gl::Program& resolve =
      program("resolve", embedded::fullscreen_vert, embedded::resolve_frag);
  const std::array<gpu::Attachment, 2> attachments{{{&color}, {&info}}};
  gpu::bindTarget(framebuffer_, attachments, size);
  resolve.use();
  gpu::bindSampler(resolve, "colors", 0, newColors);
  gpu::bindSampler(resolve, "positions", 1, newPositions);
  gl.Uniform1i(resolve.uniform("layers"), layers.count);
  gpu::drawFullscreen(empty_);

  WarpedView view = readDrawnView(size);
  // A framebuffer that had two colour attachments must not keep the second.
  gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, GL_TEXTURE_2D, 0, 0);
  gl::checkErrors("warping depth layers");
  return view;
}

}  // namespace vestige
