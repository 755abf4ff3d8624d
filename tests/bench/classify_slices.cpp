// SPDX-License-Identifier: BSD-3-Clause
#include "tests/bench/classify_slices.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "explorer/gpu/gpu.h"
#include "proxy/base/parallel.h"

namespace vestige::test {
namespace {

const char* const kVertex = R"glsl(#version 300 es
void main() {
  gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);
}
)glsl";

const char* const kFragment = R"glsl(#version 300 es
precision highp float;
precision highp int;
precision highp sampler3D;
uniform vec4 parameters[PARAMETERS];
uniform vec4 optics[CHANNELS];  // emission, extinction
uniform sampler3D volume;       // value, gradient
uniform vec3 rayOrigin[3], rayDirection[3];  // at the picture's origin, per pixel x, per pixel y
uniform vec3 boxLow, boxHigh;
uniform vec2 texelScale[3];  // of a world coordinate: scale, offset
uniform vec2 depths;         // of the first plane, and between planes
uniform int slices;
out vec4 made;
void classify(vec4 a, vec4 b, float gradientA, float gradientB, out float weights[CHANNELS]);

vec2 sampleAt(vec3 world) {
  return texture(volume, vec3(world.x * texelScale[0].x + texelScale[0].y,
                              world.y * texelScale[1].x + texelScale[1].y,
                              world.z * texelScale[2].x + texelScale[2].y)).xy;
}

void main() {
  vec2 pixel = gl_FragCoord.xy;
  vec3 origin = rayOrigin[0] + pixel.x * rayOrigin[1] + pixel.y * rayOrigin[2];
  vec3 direction = rayDirection[0] + pixel.x * rayDirection[1] + pixel.y * rayDirection[2];
  // The direction gains one unit of depth a unit; lengths are in the world.
  float lengthPerDepth = length(direction);
  vec3 t0 = (boxLow - origin) / direction, t1 = (boxHigh - origin) / direction;
  vec3 near = min(t0, t1), far = max(t0, t1);
  float enter = max(max(near.x, near.y), near.z), leave = min(min(far.x, far.y), far.z);
  vec4 light = vec4(0.0, 0.0, 0.0, 1.0);
  for (int i = 0; i < slices; ++i) {
    float from = max(depths.x + float(i) * depths.y, enter);
    float to = min(depths.x + float(i + 1) * depths.y, leave);
    if (!(from < to)) continue;
    float weights[CHANNELS];
#ifdef RIEMANN
    vec2 a = sampleAt(origin + 0.5 * (from + to) * direction), b = a;
#else
    vec2 a = sampleAt(origin + from * direction), b = sampleAt(origin + to * direction);
#endif
    classify(vec4(a.x, 0.0, 0.0, 0.0), vec4(b.x, 0.0, 0.0, 0.0), a.y, b.y, weights);
    vec4 sum = vec4(0.0);
    for (int k = 0; k < CHANNELS; ++k) sum += weights[k] * optics[k];
    float left = exp(-sum.w * (to - from) * lengthPerDepth);
    light.rgb += light.a * (1.0 - left) * sum.rgb / max(sum.w, 1e-20);
    light.a *= left;
  }
  made = vec4(light.rgb, 1.0);
}
)glsl";

/// The triangular primitive at a sample [Kniss 2003, Table 3].
const char* const kSampled = R"glsl(
void classify(vec4 a, vec4 b, float gradientA, float gradientB, out float weights[CHANNELS]) {
  for (int i = 0; i < CHANNELS; ++i) {
    float x = parameters[4 * i].x * (a.x - parameters[4 * i + 3].x);
    x /= parameters[4 * i + 1].w * gradientA;
    weights[i] = gradientA > 0.0 ? exp(-x * x) : 0.0;
  }
}
)glsl";

std::vector<float> texelsOf(const Scene& scene, const FieldDomain& domain) {
  const auto [nx, ny, nz] = scene.size;
  std::vector<float> texels(2 * scene.values.size());
  parallelRanges(nz, [&, nx = nx, ny = ny](int from, int to) {
    for (int z = from; z < to; ++z)
      for (int y = 0; y < ny; ++y)
        for (int x = 0; x < nx; ++x) {
          const auto i = (std::size_t(z) * std::size_t(ny) + std::size_t(y)) * std::size_t(nx) +
                         std::size_t(x);
          const glm::dvec3 world = scene.origin + scene.spacing * glm::dvec3(x, y, z);
          texels[2 * i] = float((double(scene.values[i]) - domain.low) / domain.range());
          texels[2 * i + 1] = float(glm::length(scene.gradient(world)) / domain.range());
        }
  });
  return texels;
}

gl::Texture volumeOf(const Scene& scene, const std::vector<float>& texels) {
  const gl::Functions& gl = gl::functions();
  gl::Texture texture(GL_TEXTURE_3D);
  texture.bind(0);
  for (const GLenum name : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    gl.TexParameteri(GL_TEXTURE_3D, name, GL_LINEAR);
  for (const GLenum name : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
    gl.TexParameteri(GL_TEXTURE_3D, name, GL_CLAMP_TO_EDGE);
  gl.TexImage3D(GL_TEXTURE_3D, 0, GL_RG32F, scene.size[0], scene.size[1], scene.size[2], 0, GL_RG,
                GL_FLOAT, texels.data());
  return texture;
}

/// Rays of an orthographic or perspective camera, as affine functions of the pixel; a direction
/// gains one unit of depth.
void setRays(const gl::Program& program, const SliceScene& scene, int slices) {
  const gl::Functions& gl = gl::functions();
  std::array<glm::vec3, 3> origin, direction;
  const auto rayAt = [&](glm::dvec2 pixel) { return scene.camera.rayThrough(pixel, scene.size); };
  const auto directionAt = [&](glm::dvec2 pixel) {
    const Ray ray = rayAt(pixel);
    return ray.direction / ray.depthPerLength;
  };
  origin[0] = rayAt({0, 0}).origin;
  direction[0] = directionAt({0, 0});
  for (int axis = 0; axis < 2; ++axis) {
    glm::dvec2 pixel(0.0);
    pixel[axis] = 1.0;
    origin[std::size_t(axis) + 1] = rayAt(pixel).origin - rayAt({0, 0}).origin;
    direction[std::size_t(axis) + 1] = directionAt(pixel) - directionAt({0, 0});
  }
  gl.Uniform3fv(program.uniform("rayOrigin"), 3, &origin[0].x);
  gl.Uniform3fv(program.uniform("rayDirection"), 3, &direction[0].x);
  const Box box = scene.scene->domain();
  gl.Uniform3f(program.uniform("boxLow"), float(box.low.x), float(box.low.y), float(box.low.z));
  gl.Uniform3f(program.uniform("boxHigh"), float(box.high.x), float(box.high.y), float(box.high.z));
  std::array<glm::vec2, 3> texel;
  for (int axis = 0; axis < 3; ++axis) {
    const double count = scene.scene->size[std::size_t(axis)];
    const double scale = 1.0 / (scene.scene->spacing[axis] * count);
    texel[std::size_t(axis)] = {scale, 0.5 / count - scene.scene->origin[axis] * scale};
  }
  gl.Uniform2fv(program.uniform("texelScale"), 3, &texel[0].x);
  double least = HUGE_VAL, most = -HUGE_VAL;
  for (int i = 0; i < 8; ++i) {
    const double depth = glm::dot(box.corner(i) - scene.camera.position, scene.camera.forward);
    least = std::min(least, depth);
    most = std::max(most, depth);
  }
  gl.Uniform2f(program.uniform("depths"), float(least), float((most - least) / slices));
  gl.Uniform1i(program.uniform("slices"), slices);
}

void setLook(const gl::Program& program, const Classifier& classifier, double referenceLength,
             const FieldDomain& domain) {
  const gl::Functions& gl = gl::functions();
  const auto parameters = classifier.normalised({&domain, 1})->parameters();
  gl.Uniform4fv(program.uniform("parameters"), GLsizei(parameters.size()), &parameters[0].x);
  std::vector<glm::vec4> optics;
  for (const ChannelOptics& each : classifier.optics(referenceLength))
    optics.emplace_back(each.emission, each.extinction);
  gl.Uniform4fv(program.uniform("optics"), GLsizei(optics.size()), &optics[0].x);
}

}  // namespace

SliceRenderer::SliceRenderer(gl::Device& device, const SliceScene& scene)
    : device_(device),
      scene_(scene),
      domain_{scene.scene->low, scene.scene->high, 0.0},
      texels_(texelsOf(*scene.scene, domain_)) {}

SlicedPicture SliceRenderer::draw(const Classifier& classifier, double referenceLength, Slab slab,
                                  int slices, int repeats) {
  SlicedPicture made{Picture::blank(scene_.size), std::numeric_limits<double>::infinity()};
  device_.run([&] {
    const gl::Functions& gl = gl::functions();
    std::vector<std::pair<std::string, std::string>> defines{
        {"CHANNELS", std::to_string(classifier.channels().size())},
        {"PARAMETERS", std::to_string(classifier.parameters().size())}};
    if (slab == Slab::Riemann) defines.emplace_back("RIEMANN", "1");
    const std::string fragment =
        kFragment + std::string(slab == Slab::Riemann ? kSampled : classifier.glsl());
    const gl::Program program = gpu::program(kVertex, fragment, defines);
    const gl::Texture volume = volumeOf(*scene_.scene, texels_);
    const gl::Texture target = gpu::texture2D(GL_RGBA32F, scene_.size, GL_RGBA, GL_FLOAT, nullptr);
    const gl::Framebuffer framebuffer;
    const std::array<gpu::Attachment, 1> attachments{{{&target}}};
    gpu::bindTarget(framebuffer, attachments, scene_.size);
    program.use();
    gpu::bindSampler(program, "volume", 0, volume);
    setRays(program, scene_, slices);
    setLook(program, classifier, referenceLength, domain_);
    const gl::VertexArray empty;
    // The first pass compiles, and is not timed where there are others.
    for (int repeat = 0; repeat <= (repeats > 1 ? repeats : 0); ++repeat) {
      const auto start = std::chrono::steady_clock::now();
      gpu::drawFullscreen(empty);
      gl.Finish();
      const double seconds =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      if (repeat > 0 || repeats <= 1) made.seconds = std::min(made.seconds, seconds);
    }
    made.picture.rgba = gpu::readFloats(scene_.size);
  });
  return made;
}

}  // namespace vestige::test
