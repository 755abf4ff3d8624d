// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/gpu_classify.h"

#include "proxy/gl/functions.h"
#include "proxy/gl/objects.h"
#include "proxy/gl/program.h"

namespace vestige::test {
namespace {

constexpr int kWidth = 1024;  ///< of the textures into which lists are folded

const char* const kVertex = R"glsl(#version 300 es
void main() {
  gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);
}
)glsl";

const char* const kFragment = R"glsl(#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
uniform vec4 parameters[PARAMETERS];
uniform sampler2D startValues, endValues, gradients;
uniform int firstChannel;
out vec4 made;
void classify(vec4 a, vec4 b, float gradientA, float gradientB, out float weights[CHANNELS]);
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec2 gradient = texelFetch(gradients, at, 0).xy;
  float weights[CHANNELS];
  classify(texelFetch(startValues, at, 0), texelFetch(endValues, at, 0), gradient.x, gradient.y,
           weights);
  made = vec4(0.0);
  for (int i = 0; i < 4; ++i) {
    if (firstChannel + i < CHANNELS) made[i] = weights[firstChannel + i];
  }
}
)glsl";

gl::Texture upload(std::span<const float> texels, int rows) {
  const gl::Functions& gl = gl::functions();
  gl::Texture texture(GL_TEXTURE_2D);
  texture.bind(0);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  gl.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, kWidth, rows, 0, GL_RGBA, GL_FLOAT,
                texels.empty() ? nullptr : texels.data());
  return texture;
}

struct Lists {
  std::vector<float> start, end, gradient;
};

Lists listsOf(std::span<const Segment> segments, int rows) {
  const std::size_t floats = std::size_t(4 * kWidth) * std::size_t(rows);
  Lists lists{std::vector<float>(floats), std::vector<float>(floats), std::vector<float>(floats)};
  for (std::size_t i = 0; i < segments.size(); ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      lists.start[4 * i + j] = float(segments[i].a.values[j]);
      lists.end[4 * i + j] = float(segments[i].b.values[j]);
    }
    lists.gradient[4 * i] = float(segments[i].a.gradient);
    lists.gradient[4 * i + 1] = float(segments[i].b.gradient);
  }
  return lists;
}

}  // namespace

std::vector<float> classifyOnGpu(gl::Device& device, const Classifier& classifier,
                                 std::span<const Segment> segments) {
  const std::size_t channels = classifier.channels().size();
  const std::vector<glm::vec4> parameters = classifier.parameters();
  const int rows = int((segments.size() + kWidth - 1) / kWidth);
  std::vector<float> weights(segments.size() * channels);
  device.run([&] {
    const gl::Functions& gl = gl::functions();
    const std::string fragment = kFragment + std::string(classifier.glsl());
    const gl::Program program({{GL_VERTEX_SHADER, kVertex}, {GL_FRAGMENT_SHADER, fragment}},
                              {{"CHANNELS", std::to_string(channels)},
                               {"PARAMETERS", std::to_string(parameters.size())}});
    const Lists lists = listsOf(segments, rows);
    const gl::Texture start = upload(lists.start, rows), end = upload(lists.end, rows),
                      gradient = upload(lists.gradient, rows), target = upload({}, rows);
    const gl::Framebuffer framebuffer;
    gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer.id());
    gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, target.id(), 0);
    const GLenum buffer = GL_COLOR_ATTACHMENT0;
    gl.DrawBuffers(1, &buffer);
    gl.Viewport(0, 0, kWidth, rows);
    program.use();
    gl.Uniform4fv(program.uniform("parameters"), GLsizei(parameters.size()), &parameters[0].x);
    start.bind(0), gl.Uniform1i(program.uniform("startValues"), 0);
    end.bind(1), gl.Uniform1i(program.uniform("endValues"), 1);
    gradient.bind(2), gl.Uniform1i(program.uniform("gradients"), 2);
    const gl::VertexArray empty;
    gl.BindVertexArray(empty.id());
    std::vector<float> texels(std::size_t(4 * kWidth) * std::size_t(rows));
    for (std::size_t first = 0; first < channels; first += 4) {
      gl.Uniform1i(program.uniform("firstChannel"), GLint(first));
      gl.DrawArrays(GL_TRIANGLES, 0, 3);
      gl.ReadPixels(0, 0, kWidth, rows, GL_RGBA, GL_FLOAT, texels.data());
      for (std::size_t i = 0; i < segments.size(); ++i)
        for (std::size_t k = first; k < std::min(first + 4, channels); ++k)
          weights[i * channels + k] = texels[4 * i + k - first];
    }
    gl::checkErrors("classifying segments");
  });
  return weights;
}

std::vector<double> classifyOnCpu(const Classifier& classifier, std::span<const Segment> segments) {
  const std::size_t channels = classifier.channels().size();
  std::vector<double> weights(segments.size() * channels);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    classifier.weights(segments[i].a, segments[i].b, {&weights[i * channels], channels});
  }
  return weights;
}

Segment rounded(Segment segment) {
  for (FieldSample* sample : {&segment.a, &segment.b}) {
    for (double& value : sample->values) value = double(float(value));
    sample->gradient = double(float(sample->gradient));
  }
  return segment;
}

}  // namespace vestige::test
