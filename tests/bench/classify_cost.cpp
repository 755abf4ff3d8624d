// SPDX-License-Identifier: BSD-3-Clause
#include "tests/bench/classify_cost.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "proxy/classifier/gaussian.h"
#include "proxy/gl/functions.h"
#include "proxy/gl/objects.h"
#include "proxy/gl/program.h"

namespace vestige::test {
namespace {

constexpr int kPixels = 256, kVolume = 64, kTable = 256;

const char* const kVertex = R"glsl(#version 300 es
void main() {
  gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);
}
)glsl";

const char* const kFragment = R"glsl(#version 300 es
precision highp float;
precision highp int;
precision highp sampler3D;
precision highp sampler2DArray;
uniform vec4 parameters[PARAMETERS];
uniform vec4 optics[CHANNELS];  // emission, extinction
uniform sampler3D volume;       // three fields and the gradient
uniform sampler2DArray tables;
out vec4 made;
void classify(vec4 a, vec4 b, float gradientA, float gradientB, out float weights[CHANNELS]);
void main() {
  const int kSteps = 128;
  vec3 at = vec3(gl_FragCoord.xy / PIXELS, 0.0);
  vec4 light = vec4(0.0, 0.0, 0.0, 1.0), a = texture(volume, at);
  for (int i = 1; i <= kSteps; ++i) {
    at.z = float(i) / float(kSteps);
    vec4 b = texture(volume, at);
    float weights[CHANNELS];
    classify(vec4(a.xyz, 0.0), vec4(b.xyz, 0.0), a.w, b.w, weights);
    vec4 sum = vec4(0.0);
    for (int k = 0; k < CHANNELS; ++k) sum += weights[k] * optics[k];
    float left = exp(-sum.w);
    light.rgb += light.a * (1.0 - left) * sum.rgb / max(sum.w, 1e-20);
    light.a *= left;
    a = b;
  }
  made = light;
}
)glsl";

const char* const kSeparable = R"glsl(
void classify(vec4 a, vec4 b, float gradientA, float gradientB, out float weights[CHANNELS]) {
  for (int i = 0; i < CHANNELS; ++i) {
    weights[i] = texture(tables, vec3(b.xy, float(2 * i))).r *
                 texture(tables, vec3(b.z, gradientB, float(2 * i + 1))).r;
  }
}
)glsl";

const char* const kSampled = R"glsl(
void classify(vec4 a, vec4 b, float gradientA, float gradientB, out float weights[CHANNELS]) {
  for (int i = 0; i < CHANNELS; ++i) {
    int first = 4 * i;
    vec3 width = vec3(parameters[first].x, parameters[first + 1].x, parameters[first + 2].x);
    vec3 v = width * (b.xyz - parameters[first + 3].xyz);
    float thickness = parameters[first + 1].w * gradientB;
#ifdef TRIANGULAR
    v /= thickness;
    weights[i] = gradientB > 0.0 ? exp(-dot(v, v)) : 0.0;
#else
    weights[i] = exp(-dot(v, v));
#endif
  }
}
)glsl";

/// [Kniss 2003, Table 4]: the difference of erf from a table over [-3.6, 3.6]^2, the layer after
/// the others.
const char* const kTabled = R"glsl(
void classify(vec4 a, vec4 b, float gradientA, float gradientB, out float weights[CHANNELS]) {
  for (int i = 0; i < CHANNELS; ++i) {
    int first = 4 * i;
    vec3 width = vec3(parameters[first].x, parameters[first + 1].x, parameters[first + 2].x);
    vec3 v1 = width * (a.xyz - parameters[first + 3].xyz), d = width * (b.xyz - a.xyz);
    float square = dot(d, d), perLength = inversesqrt(max(square, 1e-12));
    float along = dot(d, v1) * perLength, here = dot(v1, v1);
    vec2 ends = vec2(along, along + square * perLength) / 7.2 + 0.5;
    float mean = texture(tables, vec3(ends, float(2 * CHANNELS))).r * perLength *
                 exp(along * along - here);
    weights[i] = square < 1e-6 ? exp(-here) : mean;
  }
}
)glsl";

/// Primitives across the range of the volume's fields.
std::unique_ptr<Classifier> primitivesOf(int count, bool triangular) {
  nlohmann::json object = {{"kind", "gaussian"}, {"fields", {"a", "b", "c"}}};
  for (int i = 0; i < count; ++i) {
    const double place = 0.2 + 0.2 * i;
    nlohmann::json each = {{"center", {place, 1.0 - place, 0.5}}, {"width", {0.1, 0.2, 0.3}}};
    if (triangular) each["thickness"] = 0.5;
    object["primitives"].push_back(each);
  }
  return classifierFromJson(object, "", "bench");
}

gl::Texture volumeTexture() {
  std::vector<float> texels;
  for (int z = 0; z < kVolume; ++z)
    for (int y = 0; y < kVolume; ++y)
      for (int x = 0; x < kVolume; ++x) {
        const double u = 6.0 * x / kVolume, v = 6.0 * y / kVolume, w = 6.0 * z / kVolume;
        for (const double value : {std::sin(u * v + w), std::cos(u + v * w), std::sin(u + v - w),
                                   std::cos(u - v) * std::sin(w)})
          texels.push_back(float(0.5 + 0.5 * value));
      }
  const gl::Functions& gl = gl::functions();
  gl::Texture texture(GL_TEXTURE_3D);
  texture.bind(0);
  for (const GLenum name : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    gl.TexParameteri(GL_TEXTURE_3D, name, GL_LINEAR);
  gl.TexImage3D(GL_TEXTURE_3D, 0, GL_RGBA32F, kVolume, kVolume, kVolume, 0, GL_RGBA, GL_FLOAT,
                texels.data());
  return texture;
}

/// Layers 2 i and 2 i + 1: the two factors of primitive i; the last: ∫ exp(-x²) from column to row.
gl::Texture tableTextures(int primitives) {
  std::vector<float> texels;
  const auto bump = [](double value, double center, double width) {
    return std::exp(-std::pow((value - center) / width, 2));
  };
  for (int i = 0; i < primitives; ++i) {
    const double place = 0.2 + 0.2 * i;
    for (const bool second : {false, true})
      for (int y = 0; y < kTable; ++y)
        for (int x = 0; x < kTable; ++x) {
          const double u = (x + 0.5) / kTable, v = (y + 0.5) / kTable;
          texels.push_back(
              float(second ? bump(u, 0.5, 0.3) : bump(u, place, 0.1) * bump(v, 1.0 - place, 0.2)));
        }
  }
  for (int y = 0; y < kTable; ++y)
    for (int x = 0; x < kTable; ++x) {
      const auto erfAt = [](int i) { return std::erf(7.2 * ((i + 0.5) / kTable - 0.5)); };
      texels.push_back(float(0.5 * std::sqrt(M_PI) * (erfAt(y) - erfAt(x))));
    }
  const gl::Functions& gl = gl::functions();
  gl::Texture texture(GL_TEXTURE_2D_ARRAY);
  texture.bind(0);
  for (const GLenum name : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    gl.TexParameteri(GL_TEXTURE_2D_ARRAY, name, GL_LINEAR);
  for (const GLenum name : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
    gl.TexParameteri(GL_TEXTURE_2D_ARRAY, name, GL_CLAMP_TO_EDGE);
  gl.TexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_R32F, kTable, kTable, 2 * primitives + 1, 0, GL_RED,
                GL_FLOAT, texels.data());
  return texture;
}

struct Prepared {
  gl::Program program;
  std::vector<glm::vec4> parameters;
};

Prepared prepare(const ClassifyWay& way, int primitives) {
  const bool triangular = way.name.ends_with("triangular");
  std::vector<glm::vec4> parameters = primitivesOf(primitives, triangular)->parameters();
  std::vector<std::pair<std::string, std::string>> defines{
      {"CHANNELS", std::to_string(primitives)},
      {"PARAMETERS", std::to_string(parameters.size())},
      {"PIXELS", std::to_string(kPixels) + ".0"}};
  if (triangular) defines.emplace_back("TRIANGULAR", "1");
  const std::string fragment = kFragment + way.glsl;
  return {gl::Program({{GL_VERTEX_SHADER, kVertex}, {GL_FRAGMENT_SHADER, fragment}}, defines),
          std::move(parameters)};
}

double secondsOfFrame(const Prepared& way, int primitives) {
  const gl::Functions& gl = gl::functions();
  way.program.use();
  gl.Uniform4fv(way.program.uniform("parameters"), GLsizei(way.parameters.size()),
                &way.parameters[0].x);
  const std::vector<glm::vec4> optics(std::size_t(primitives), glm::vec4(0.01f));
  gl.Uniform4fv(way.program.uniform("optics"), primitives, &optics[0].x);
  gl.Uniform1i(way.program.uniform("volume"), 0);
  gl.Uniform1i(way.program.uniform("tables"), 1);
  const auto start = std::chrono::steady_clock::now();
  gl.DrawArrays(GL_TRIANGLES, 0, 3);
  gl.Finish();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

std::vector<ClassifyWay> tableOfWays() {
  const std::string analytic(primitivesOf(1, false)->glsl());
  return {{"separable", kSeparable},   {"gaussian", kSampled}, {"triangular", kSampled},
          {"analytic_table", kTabled}, {"analytic", analytic}, {"analytic_triangular", analytic}};
}

std::vector<double> secondsToClassify(gl::Device& device, const std::vector<ClassifyWay>& ways,
                                      int primitives, int frames) {
  std::vector<double> least(ways.size(), std::numeric_limits<double>::infinity());
  device.run([&] {
    const gl::Functions& gl = gl::functions();
    gl::Texture target(GL_TEXTURE_2D);
    target.bind(0);
    gl.TexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA32F, kPixels, kPixels);
    const gl::Framebuffer framebuffer;
    gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer.id());
    gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, target.id(), 0);
    const GLenum buffer = GL_COLOR_ATTACHMENT0;
    gl.DrawBuffers(1, &buffer);
    gl.Viewport(0, 0, kPixels, kPixels);
    const gl::VertexArray empty;
    gl.BindVertexArray(empty.id());
    const gl::Texture tables = tableTextures(primitives), volume = volumeTexture();
    volume.bind(0);
    tables.bind(1);
    std::vector<Prepared> prepared;
    for (const ClassifyWay& way : ways) prepared.push_back(prepare(way, primitives));
    for (const Prepared& way : prepared) secondsOfFrame(way, primitives);  // compiles
    for (int frame = 0; frame < frames; ++frame)
      for (std::size_t i = 0; i < ways.size(); ++i)
        least[i] = std::min(least[i], secondsOfFrame(prepared[i], primitives));
    gl::checkErrors("measuring classification");
  });
  return least;
}

}  // namespace vestige::test
