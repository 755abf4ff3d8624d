// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/march/layer_march.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <limits>

#include "adaptor/march/tile_plan.h"
#include "march_base_glsl.embed.h"
#include "march_field_glsl.embed.h"
#include "march_layers_glsl.embed.h"
#include "proxy/base/error.h"
#include "proxy/gl/functions.h"

namespace vestige {
namespace {

constexpr int kLightUnit = kNodesUnit + 3;
/// Share of a ray's opacity in front of its first boundary, and behind its last: wisps that would
/// stretch the outermost layers over empty space.
constexpr double kOuterShare = 1.0 / 256.0;

/// Texture coordinates of LightDepth in a frame's local space.
glm::mat4 lightFromLocal(const LightDepth& light, const MarchFrame& frame, const Box& domain) {
  const MarchFrame lightFrame(domain, light.camera);
  const double slice = lightFrame.scale / LightDepth::kSlices;
  // Depths from the nearest corner on; slice i, whose texel centre is at i + 1/2, holds the depth
  // at its far side, i + 1.
  glm::dmat4 unit = glm::scale(glm::dmat4(1.0), glm::dvec3(0.5, -0.5, -1.0 / lightFrame.scale));
  const double height = light.camera.viewHeight;
  unit[0][0] = 1.0 / (height * LightDepth::kSize.aspect());
  unit[1][1] = -1.0 / height;
  unit[3] = glm::dvec4(0.5, 0.5, -(lightFrame.depthOrigin + 0.5 * slice) / lightFrame.scale, 1.0);
  const glm::dmat4 worldFromLocal =
      glm::scale(glm::translate(glm::dmat4(1.0), frame.centre), glm::dvec3(frame.scale));
  return glm::mat4(unit * light.camera.eyeFromWorld() * worldFromLocal);
}

/// LightDepth as a filtered texture, for as long as it lives.
class LightTexture {
 public:
  explicit LightTexture(const LightDepth& light) {
    const gl::Functions& f = gl::functions();
    texture_.bind(kLightUnit);
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
      f.TexParameteri(GL_TEXTURE_3D, filter, GL_LINEAR);
    for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
      f.TexParameteri(GL_TEXTURE_3D, wrap, GL_CLAMP_TO_EDGE);
    const auto [width, height] = LightDepth::kSize;
    f.TexStorage3D(GL_TEXTURE_3D, 1, GL_R32F, width, height, LightDepth::kSlices);
    f.PixelStorei(GL_UNPACK_ALIGNMENT, 4);
    f.TexSubImage3D(GL_TEXTURE_3D, 0, 0, 0, 0, width, height, LightDepth::kSlices, GL_RED, GL_FLOAT,
                    light.depth.data());
    gl::checkErrors("uploading the light's depth");
  }

 private:
  gl::Texture texture_{GL_TEXTURE_3D};
};

/// Runs a program on the tiles in which rays may meet something, band by band of rows: `before`
/// (first row, rows) binds what it reads, `take` (planes, first row, rows) gets what it put.
template <typename Before, typename Take>
void marchBands(const gl::Program& program, const std::vector<glm::vec4>& tiles, ImageSize size,
                std::size_t planeCount, const Before& before, const Take& take) {
  const gl::Functions& f = gl::functions();
  const TilePass pass(program, tiles);
  const gl::Buffer planes;
  const std::size_t rowBytes = planeCount * std::size_t(size.width) * sizeof(float);
  const int rows = TilePlan::bandRows(size.height, rowBytes);
  f.BindBuffer(GL_SHADER_STORAGE_BUFFER, planes.id());
  f.BufferData(GL_SHADER_STORAGE_BUFFER, GLsizeiptr(rowBytes * std::size_t(rows)), nullptr,
               GL_STREAM_READ);
  for (int row = 0; row < size.height; row += rows) {
    const int count = std::min(rows, size.height - row);
    f.BindBuffer(GL_SHADER_STORAGE_BUFFER, planes.id());
    f.ClearBufferData(GL_SHADER_STORAGE_BUFFER, GL_R32F, GL_RED, GL_FLOAT, nullptr);
    before(row, count);
    f.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, planes.id());
    pass.run(row, count);
    f.BindBuffer(GL_SHADER_STORAGE_BUFFER, planes.id());
    f.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    const auto* mapped = static_cast<const float*>(f.MapBufferRange(
        GL_SHADER_STORAGE_BUFFER, 0, GLsizeiptr(rowBytes * std::size_t(count)), GL_MAP_READ_BIT));
    if (!mapped) {
      gl::checkErrors("the read-back of layers");
      throw Error(ErrorCode::Gl, "the read-back of layers: the result could not be mapped");
    }
    take(mapped, row, count);
    f.UnmapBuffer(GL_SHADER_STORAGE_BUFFER);
  }
  gl::checkErrors("a march of layers");
}

}  // namespace

const gl::Program& LayerMarch::program(const MarchDefines& defines) {
  std::string key;
  for (const auto& [name, value] : defines) key += name + "=" + value + ";";
  const auto found = programs_.find(key);
  if (found != programs_.end()) return found->second;
  std::string source(embedded::march_field_glsl);
  source += embedded::march_base_glsl;
  source += embedded::march_layers_glsl;
  return programs_.emplace(key, gl::Program({{GL_COMPUTE_SHADER, source}}, defines)).first->second;
}

LayerRays LayerMarch::layers(const BlockVolume& volume, const MarchRequest& march,
                             const LayerRequest& request) {
  const std::size_t pixels = march.size.pixels(), layers = std::size_t(request.layers);
  if (request.layers < 1 || request.layers > kMostLayers || request.front.size() != pixels ||
      request.end.size() != pixels) {
    throw Error(ErrorCode::InvalidArgument, std::to_string(request.layers) + " layers of " +
                                                std::to_string(request.front.size()) + " and " +
                                                std::to_string(request.end.size()) +
                                                " transmittances cannot be marched for " +
                                                std::to_string(pixels) + " pixels");
  }
  LayerRays rays{std::vector<float>((layers + 1) * pixels, kInfinity),
                 std::vector<float>(3 * layers * pixels), std::vector<float>(pixels)};
  if (volume.grid().empty()) return rays;
  const MarchSetup setup(march, volume, true);
  const TilePlan plan(volume.bricks(), setup.bricks, volume.grid(), setup.frame, march);
  const MarchTables tables(setup, volume);
  MarchDefines defines{{"LAYERS", std::to_string(layers)}, {"REFERENCE", ""}};
  if (request.shadows) {
    defines.push_back({"SHADOWS", ""});
  } else if (march.phong) {
    defines.push_back({"PHONG", ""});
  }
  addFieldDefines(defines, setup, volume, true);
  const gl::Program& used = program(defines);
  setMarchUniforms(used, march, setup, volume);
  const gl::Functions& f = gl::functions();
  f.Uniform1f(used.uniform("outer"), float(kOuterShare));
  std::optional<LightTexture> light;
  if (request.shadows) {
    light.emplace(*request.shadows);
    f.Uniform1i(used.uniform("lightDepth"), kLightUnit);
    f.Uniform1f(used.uniform("ambient"), kShadowAmbient);
    const glm::mat4 matrix = lightFromLocal(*request.shadows, setup.frame, march.domain);
    f.UniformMatrix4fv(used.uniform("lightFromLocal"), 1, GL_FALSE, glm::value_ptr(matrix));
  }

  const auto width = std::size_t(march.size.width);
  const gl::Buffer fronts;
  std::vector<glm::vec2> band;
  const auto before = [&](int row, int count) {
    band.clear();
    for (std::size_t i = std::size_t(row) * width; i < std::size_t(row + count) * width; ++i) {
      band.emplace_back(request.front[i], std::max(request.end[i], float(kSaturatedTransmittance)));
    }
    f.BindBuffer(GL_SHADER_STORAGE_BUFFER, fronts.id());
    f.BufferData(GL_SHADER_STORAGE_BUFFER, GLsizeiptr(band.size() * sizeof(glm::vec2)), band.data(),
                 GL_STREAM_DRAW);
    f.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, fronts.id());
  };
  const auto take = [&](const float* planes, int row, int count) {
    const std::size_t first = std::size_t(row) * width, n = std::size_t(count) * width;
    for (std::size_t b = 0; b <= layers; ++b, planes += n) {
      for (std::size_t i = 0; i < n; ++i) {
        // 1 + the frame's depth; 0 = none.
        if (planes[i] == 0.0f) continue;
        rays.boundary[b * pixels + first + i] =
            float(setup.frame.depthOrigin + setup.frame.scale * (double(planes[i]) - 1.0));
      }
    }
    for (std::size_t c = 0; c < 3 * layers; ++c, planes += n)
      std::copy_n(planes, n, rays.light.begin() + std::ptrdiff_t(c * pixels + first));
    std::copy_n(planes, n, rays.tau.begin() + std::ptrdiff_t(first));
  };
  marchBands(used, plan.marched, march.size, 4 * layers + 2, before, take);
  return rays;
}

void LayerMarch::addLight(const BlockVolume& volume, const MarchRequest& march, LightDepth& light) {
  if (volume.grid().empty()) return;
  MarchRequest seen = march;
  seen.camera = light.camera;
  seen.size = LightDepth::kSize;
  seen.isovalues.clear();
  seen.mip = false;
  const MarchSetup setup(seen, volume, true);
  const TilePlan plan(volume.bricks(), setup.bricks, volume.grid(), setup.frame, seen);
  const MarchTables tables(setup, volume);
  MarchDefines defines{{"SLICES", std::to_string(LightDepth::kSlices)}};
  addFieldDefines(defines, setup, volume, true);
  const gl::Program& used = program(defines);
  setMarchUniforms(used, seen, setup, volume);
  // Depths of the frame reach from 0 to its diagonal, which is 1, at most.
  gl::functions().Uniform1f(used.uniform("sliceDepth"), 1.0f / float(LightDepth::kSlices));
  const std::size_t pixels = LightDepth::kSize.pixels();
  const auto take = [&](const float* planes, int row, int count) {
    const std::size_t width = std::size_t(LightDepth::kSize.width);
    const std::size_t first = std::size_t(row) * width, n = std::size_t(count) * width;
    for (std::size_t s = 0; s < std::size_t(LightDepth::kSlices); ++s, planes += n) {
      for (std::size_t i = 0; i < n; ++i) light.depth[s * pixels + first + i] += planes[i];
    }
  };
  marchBands(
      used, plan.marched, LightDepth::kSize, std::size_t(LightDepth::kSlices), [](int, int) {},
      take);
}

}  // namespace vestige
