// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/layers/analytic_layer_pass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>

#include "analytic_layers_frag.embed.h"
#include "fullscreen_vert.embed.h"
#include "proxy/base/error.h"
#include "proxy/base/parallel.h"
#include "proxy/format/layout/proxy_layout.h"

namespace vestige {
namespace {

/// Between rays through every other pixel (ProbedRays), in pictures of so many pixels: in smaller
/// ones neighbours differ too much (turbulence at 1024^2 takes half of the time, at 512^2 more).
constexpr double kTolerance = 1.0 / 256.0;
constexpr std::size_t kProbed = std::size_t(1) << 19;
constexpr int kTile = 8;  ///< as in analytic_layers.frag
constexpr double kLevels = 65535.0;
/// Rays end where less light is left: a little more than saturated ones leave.
constexpr float kOpaque = float(2.0 * kSaturatedTransmittance);
/// A step of storage, as a share of the depths: thin layers may push each other out of the domain
/// by one for each boundary.
constexpr double kStep = 1.0 / 2000.0;
/// Boundaries of neighbours that differ by more pixels than this are not one surface.
constexpr double kLongestJump = 8.0;

/// Planar depths that levels span: the domain's.
DepthRange levelRange(const Camera& camera, const Box& domain) {
  DepthRange range = depthRange(camera, domain);
  range.high = std::max(range.high, range.low + std::max(domain.diagonal() * 1e-6, 1e-300));
  return range;
}

/// Ends of the directions across a picture, and length along a ray for each unit of planar depth.
struct PicturePlane {
  glm::dvec3 across, down;  ///< perspective: at depth 1

  PicturePlane(const Camera& camera, double aspect) {
    const double height = camera.projection == Projection::Orthographic
                              ? camera.viewHeight
                              : 2.0 * std::tan(0.5 * camera.fieldOfView);
    across = camera.right() * (height * aspect * camera.pixelAspect);
    down = camera.up * -height;
  }
};

/// World places along the rays of a camera as origin + t direction, each [0] + x [1] + y [2].
struct RayFan {
  std::array<glm::dvec3, 3> origin, direction;

  RayFan(const Camera& camera, double aspect, const Stretch& stretch) {
    const PicturePlane plane(camera, aspect);
    if (camera.projection == Projection::Orthographic) {
      origin = {camera.position, plane.across, plane.down};
      direction = {camera.forward, glm::dvec3(0.0), glm::dvec3(0.0)};
    } else {
      origin = {camera.position, glm::dvec3(0.0), glm::dvec3(0.0)};
      const glm::dvec2 shift(camera.shift.x / (aspect * camera.pixelAspect), -camera.shift.y);
      direction = {camera.forward - shift.x * plane.across - shift.y * plane.down, plane.across,
                   plane.down};
    }
    if (stretch.none()) return;
    for (std::size_t i = 0; i < 3; ++i) {
      origin[i] = glm::dvec3(stretch.worldFromScene() * glm::dvec4(origin[i], i == 0 ? 1.0 : 0.0));
      direction[i] /= stretch.factors();
    }
  }
};

/// (x w, y w, w, level) of world points in a stored picture: an affine map.
class SourceMap {
 public:
  SourceMap(const Camera& camera, ImageSize size, const Box& domain) : position_(camera.position) {
    const PicturePlane plane(camera, size.aspect());
    const glm::dvec3 x = plane.across / glm::dot(plane.across, plane.across);
    const glm::dvec3 y = plane.down / glm::dot(plane.down, plane.down);
    const DepthRange range = levelRange(camera, domain);
    const double levels = kLevels / (range.high - range.low);
    const bool perspective = camera.projection == Projection::Perspective;
    // In units of the domain for perspective. The picture's middle is half its size from its
    // corner.
    const double unit = perspective ? 1.0 / std::max(domain.diagonal(), 1e-300) : 1.0;
    w_ = perspective ? camera.forward * unit : glm::dvec3(0.0);
    constant_.z = perspective ? 0.0 : 1.0;
    x_ = x * (unit * size.width) + w_ * (0.5 * size.width);
    y_ = y * (unit * size.height) + w_ * (0.5 * size.height);
    constant_.x = perspective ? 0.0 : 0.5 * size.width;
    constant_.y = perspective ? 0.0 : 0.5 * size.height;
    level_ = camera.forward * levels;
    constant_.w = -range.low * levels;
  }
  glm::dvec4 direction(glm::dvec3 v) const {
    return {dustless(glm::dot(x_, v), x_, v), dustless(glm::dot(y_, v), y_, v), glm::dot(w_, v),
            glm::dot(level_, v)};
  }
  glm::dvec4 point(glm::dvec3 world) const { return direction(world - position_) + constant_; }

 private:
  /// A ray along the stored ones stays in its pixel.
  static double dustless(double value, glm::dvec3 a, glm::dvec3 b) {
    return std::abs(value) < 1e-13 * glm::length(a) * glm::length(b) ? 0.0 : value;
  }
  glm::dvec3 position_, x_, y_, w_, level_;
  glm::dvec4 constant_{0.0};
};

/// Levels that boundaries of one surface may differ by between neighbours.
float longestJump(const Camera& camera, ImageSize size, const Box& domain) {
  const DepthRange range = levelRange(camera, domain);
  const double pixel =
      camera.projection == Projection::Orthographic
          ? camera.viewHeight / size.height
          : 2.0 * std::tan(0.5 * camera.fieldOfView) * 0.5 * (range.low + range.high) / size.height;
  return float(kLongestJump * pixel * kLevels / (range.high - range.low));
}

/// Length along the ray of each pixel for a unit of planar depth.
double lengthPerDepth(const Camera& camera, ImageSize size, int x, int y) {
  return 1.0 / camera.rayThrough({x + 0.5, y + 0.5}, size).depthPerLength;
}

}  // namespace

AnalyticLayerTextures::AnalyticLayerTextures(const ProxyHeader& header,
                                             const AnalyticLayerPlanes& planes)
    : camera(header.camera),
      size(header.size),
      domain(header.domain),
      layers(planes.layers),
      shading(header.shading),
      boundaries(gpu::textureArray(GL_RGBA32UI, header.size, (planes.layers + 2 + 7) / 8)),
      media(gpu::textureArray(GL_RGBA32F, header.size, planes.layers)),
      tiles(gpu::texture2D(
          GL_RGBA32F,
          {(header.size.width + kTile - 1) / kTile, (header.size.height + kTile - 1) / kTile},
          GL_RGBA, GL_FLOAT, nullptr)) {
  const std::size_t pixels = size.pixels(), width = std::size_t(size.width);
  const DepthRange range = levelRange(camera, domain);
  const double perDepth = kLevels / (range.high - range.low);
  const auto levelOf = [&](int boundary, std::size_t p) {
    const double depth = planes.boundary[std::size_t(boundary) * pixels + p];
    return std::uint32_t(std::lround(std::clamp((depth - range.low) * perDepth, 0.0, kLevels)));
  };

  const ImageSize tileCount{(size.width + kTile - 1) / kTile, (size.height + kTile - 1) / kTile};
  std::vector<float> inTiles(4 * tileCount.pixels());
  for (std::size_t i = 0; i < inTiles.size(); i += 4) {
    inTiles[i] = float(kLevels) + 1.0f;
    inTiles[i + 1] = -1.0f;
  }
  // With a ring of neighbours: surfaces reach halfway to theirs.
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const std::size_t p = std::size_t(y) * width + std::size_t(x);
      if (planes.state[p] == AnalyticLayerState::Empty) continue;
      const float near = float(levelOf(0, p)), far = float(levelOf(layers, p));
      for (int ty = std::max(y - 1, 0) / kTile; ty <= std::min(y + 1, size.height - 1) / kTile;
           ++ty) {
        for (int tx = std::max(x - 1, 0) / kTile; tx <= std::min(x + 1, size.width - 1) / kTile;
             ++tx) {
          float* tile = inTiles.data() +
                        4 * (std::size_t(ty) * std::size_t(tileCount.width) + std::size_t(tx));
          tile[0] = std::min(tile[0], near);
          tile[1] = std::max(tile[1], far);
          if (planes.state[p] == AnalyticLayerState::Saturated) tile[2] = 1.0f;
        }
      }
    }
  }
  const gl::Functions& gl = gl::functions();
  tiles.bind(0);
  gl.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, tileCount.width, tileCount.height, GL_RGBA, GL_FLOAT,
                   inTiles.data());

  std::vector<std::uint32_t> packed(4 * pixels);
  for (int first = 0; first < layers + 2; first += 8) {
    std::fill(packed.begin(), packed.end(), 0u);
    for (int slot = first; slot < std::min(first + 8, layers + 2); ++slot) {
      const int shift = 16 * (slot & 1);
      for (std::size_t p = 0; p < pixels; ++p) {
        if (planes.state[p] == AnalyticLayerState::Empty) continue;
        const std::uint32_t value =
            slot <= layers ? levelOf(slot, p) : std::uint32_t(planes.state[p]);
        packed[4 * p + std::size_t(slot - first) / 2] |= value << shift;
      }
    }
    gpu::uploadLayer(boundaries, size, first / 8, GL_RGBA_INTEGER, GL_UNSIGNED_INT, packed.data());
  }

  const double diagonal = domain.diagonal();
  std::vector<float> medium(4 * pixels);
  for (int layer = 0; layer < layers; ++layer) {
    const std::size_t at = std::size_t(layer) * pixels;
    parallelRanges(size.height, [&](int begin, int end) {
      for (std::size_t p = std::size_t(begin) * width; p < std::size_t(end) * width; ++p) {
        float* out = medium.data() + 4 * p;
        std::fill_n(out, 4, 0.0f);
        const double tau = planes.tau[at + p];
        if (planes.state[p] == AnalyticLayerState::Empty || !(tau > 0.0)) continue;
        const double opacity = -std::expm1(-tau);
        for (std::size_t c = 0; c < 3; ++c) {
          out[c] = float(double(planes.color[(3 * std::size_t(layer) + c) * pixels + p]) / opacity);
        }
        const double levels = double(levelOf(layer + 1, p)) - double(levelOf(layer, p));
        const double length = std::max(levels, 1.0) / perDepth *
                              lengthPerDepth(camera, size, int(p % width), int(p / width));
        out[3] = float(tau / length * diagonal);
      }
    });
    gpu::uploadLayer(media, size, layer, GL_RGBA, GL_FLOAT, medium.data());
  }
  gl::checkErrors("uploading layers");
}

const gl::Program& AnalyticLayerPass::program(int layers, bool custom) {
  const std::pair key(layers, custom);
  const auto found = programs_.find(key);
  if (found != programs_.end()) return found->second;
  std::vector<std::pair<std::string, std::string>> defines{{"LAYERS", std::to_string(layers)}};
  if (custom) defines.emplace_back("CUSTOM", "1");
  return programs_
      .emplace(key,
               gpu::program(embedded::fullscreen_vert, embedded::analytic_layers_frag, defines))
      .first->second;
}

AnalyticLayerView AnalyticLayerPass::render(const AnalyticLayerTextures& layers,
                                            const Camera& target, ImageSize size, bool guess,
                                            const CustomTextures* custom, const Stretch& stretch) {
  const gl::Functions& gl = gl::functions();
  const gl::Program& cast = program(layers.layers, custom);
  cast.use();
  gl.Uniform2i(cast.uniform("sourceSize"), layers.size.width, layers.size.height);
  gl.Uniform2f(cast.uniform("targetSize"), float(size.width), float(size.height));
  gl.Uniform1f(cast.uniform("opaque"), kOpaque);
  gl.Uniform1f(cast.uniform("longestJump"), longestJump(layers.camera, layers.size, layers.domain));

  // Depth along the new rays in units of the domain's diagonal, from the plane through its centre
  // on: small numbers, whatever the domain's place and size.
  const double diagonal = std::max(layers.domain.diagonal(), 1e-300);
  const glm::dvec3 centre = layers.domain.center();
  const double start = glm::dot(centre - target.position, target.forward);
  gl.Uniform1f(cast.uniform("firstDepth"), float(-start / diagonal));
  const RayFan fan(target, size.aspect(), stretch);
  const SourceMap source(layers.camera, layers.size, layers.domain);
  const DepthRange range = levelRange(layers.camera, layers.domain);
  const double marginShare = kStep * (layers.layers + 1);
  const glm::dvec3 half = glm::max(0.5 * layers.domain.size(), glm::dvec3(1e-9 * diagonal));
  const glm::vec3 margin(marginShare * (range.high - range.low) / half);
  gl.Uniform3fv(cast.uniform("margin"), 1, glm::value_ptr(margin));
  gl.Uniform1f(cast.uniform("marginLevels"), float(marginShare * kLevels));
  if (custom) {
    glm::vec3 scale;
    for (int i = 0; i < 3; ++i) scale[i] = float(custom->textureFromWorld()[i][i] * half[i]);
    gl.Uniform3fv(cast.uniform("customFromBox"), 1, glm::value_ptr(scale));
  }
  std::array<glm::vec4, 3> origin, direction;
  std::array<glm::vec3, 3> boxOrigin, boxDirection, lengths;
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3 along = fan.direction[i] * diagonal;
    const glm::dvec3 at = fan.origin[i] + fan.direction[i] * start;
    origin[i] = i == 0 ? source.point(at) : source.direction(at);
    direction[i] = source.direction(along);
    boxOrigin[i] = (i == 0 ? at - centre : at) / half;
    boxDirection[i] = along / half;
    lengths[i] = fan.direction[i];
  }
  gl.Uniform4fv(cast.uniform("originAt"), 3, glm::value_ptr(origin[0]));
  gl.Uniform4fv(cast.uniform("directionAt"), 3, glm::value_ptr(direction[0]));
  gl.Uniform3fv(cast.uniform("boxOriginAt"), 3, glm::value_ptr(boxOrigin[0]));
  gl.Uniform3fv(cast.uniform("boxDirectionAt"), 3, glm::value_ptr(boxDirection[0]));
  gl.Uniform3fv(cast.uniform("lengthAt"), 3, glm::value_ptr(lengths[0]));

  const gl::Texture color = gpu::texture2D(GL_RGBA32F, size, GL_RGBA, GL_FLOAT, nullptr);
  const gl::Texture info = gpu::texture2D(GL_RGBA32F, size, GL_RGBA, GL_FLOAT, nullptr);
  // The stored view is exact: all of it is cast.
  const bool probes = target != layers.camera && size.pixels() >= kProbed;
  const double tolerance = probes ? kTolerance : 0.0;
  rays_.render(color, info, size, tolerance, [&](float pixelStep) {
    cast.use();
    gpu::bindSampler(cast, "boundaries", 0, layers.boundaries);
    gpu::bindSampler(cast, "media", 1, layers.media);
    gpu::bindSampler(cast, "tiles", 2, layers.tiles);
    if (custom) gpu::bindSampler(cast, "customOptics", 3, custom->optics());
    gl.Uniform1f(cast.uniform("pixelStep"), pixelStep);
    gpu::drawFullscreen(empty_);
  });
  AnalyticLayerView view;
  view.picture = {size, gpu::readFloats(size, 0)};
  if (guess) {
    const std::vector<float> values = gpu::readFloats(size, 1);
    view.guess.resize(size.pixels());
    for (std::size_t i = 0; i < size.pixels(); ++i) view.guess[i] = values[4 * i + 1];
  }
  gl::checkErrors("casting rays through layers");
  return view;
}

}  // namespace vestige
