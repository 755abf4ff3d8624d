// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/gpu/gpu.h"

#include <algorithm>

#include "proxy/base/error.h"

namespace vestige::gpu {
namespace {

void setUnfiltered(GLenum target) {
  const gl::Functions& gl = gl::functions();
  gl.TexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl.TexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  gl.TexParameteri(target, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  gl.TexParameteri(target, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

}  // namespace

gl::Texture texture2D(GLenum internalFormat, ImageSize size, GLenum format, GLenum type,
                      const void* data) {
  const gl::Functions& gl = gl::functions();
  gl::Texture texture(GL_TEXTURE_2D);
  texture.bind(0);
  setUnfiltered(GL_TEXTURE_2D);
  gl.TexStorage2D(GL_TEXTURE_2D, 1, internalFormat, size.width, size.height);
  if (data) {
    gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    gl.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, size.width, size.height, format, type, data);
  }
  gl::checkErrors("making a texture");
  return texture;
}

gl::Texture textureArray(GLenum internalFormat, ImageSize size, int layers) {
  const gl::Functions& gl = gl::functions();
  gl::Texture texture(GL_TEXTURE_2D_ARRAY);
  texture.bind(0);
  setUnfiltered(GL_TEXTURE_2D_ARRAY);
  gl.TexStorage3D(GL_TEXTURE_2D_ARRAY, 1, internalFormat, size.width, size.height, layers);
  gl::checkErrors("making a texture array");
  return texture;
}

void uploadLayer(const gl::Texture& array, ImageSize size, int layer, GLenum format, GLenum type,
                 const void* data) {
  const gl::Functions& gl = gl::functions();
  array.bind(0);
  gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
  gl.TexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, layer, size.width, size.height, 1, format, type,
                   data);
  gl::checkErrors("uploading a layer");
}

gl::Texture listTexture(std::span<const std::uint32_t> values) {
  const gl::Functions& gl = gl::functions();
  const std::size_t width = std::size_t(1) << kListWidthLog2;
  const std::size_t rows = std::max<std::size_t>(1, (values.size() + width - 1) / width);
  GLint largest = 0;
  gl.GetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
  if (std::size_t(largest) < std::max(rows, width)) {
    throw Error(ErrorCode::Gl, "a list of " + std::to_string(values.size()) +
                                   " segments needs a texture of " + std::to_string(width) + " x " +
                                   std::to_string(rows) + ", this OpenGL has at most " +
                                   std::to_string(largest) + " a side");
  }
  gl::Texture texture =
      texture2D(GL_R32UI, {int(width), int(rows)}, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
  const std::size_t whole = values.size() / width;
  if (whole > 0) {
    gl.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, GLsizei(width), GLsizei(whole), GL_RED_INTEGER,
                     GL_UNSIGNED_INT, values.data());
  }
  if (const std::size_t rest = values.size() - whole * width; rest > 0) {
    gl.TexSubImage2D(GL_TEXTURE_2D, 0, 0, GLint(whole), GLsizei(rest), 1, GL_RED_INTEGER,
                     GL_UNSIGNED_INT, values.data() + whole * width);
  }
  gl::checkErrors("uploading a list");
  return texture;
}

gl::Program program(std::string_view vertex, std::string_view fragment,
                    const std::vector<std::pair<std::string, std::string>>& defines) {
  return gl::Program({{GL_VERTEX_SHADER, vertex}, {GL_FRAGMENT_SHADER, fragment}}, defines);
}

void bindTarget(const gl::Framebuffer& framebuffer, std::span<const Attachment> colors,
                ImageSize size, const gl::Texture* depth) {
  const gl::Functions& gl = gl::functions();
  gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer.id());
  std::vector<GLenum> buffers;
  for (std::size_t i = 0; i < colors.size(); ++i) {
    const GLenum point = GLenum(GL_COLOR_ATTACHMENT0 + i);
    if (colors[i].layer < 0) {
      gl.FramebufferTexture2D(GL_FRAMEBUFFER, point, GL_TEXTURE_2D, colors[i].texture->id(), 0);
    } else {
      gl.FramebufferTextureLayer(GL_FRAMEBUFFER, point, colors[i].texture->id(), 0,
                                 colors[i].layer);
    }
    buffers.push_back(point);
  }
  gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D,
                          depth ? depth->id() : 0, 0);
  gl.DrawBuffers(GLsizei(buffers.size()), buffers.data());
  if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw Error(ErrorCode::Gl, "a framebuffer of " + std::to_string(size.width) + " x " +
                                   std::to_string(size.height) + " pixels is incomplete");
  }
  gl.Viewport(0, 0, size.width, size.height);
}

std::vector<float> readFloats(ImageSize size, int attachment) {
  const gl::Functions& gl = gl::functions();
  std::vector<float> values(4 * size.pixels());
  gl.ReadBuffer(GLenum(GL_COLOR_ATTACHMENT0 + attachment));
  gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
  gl.ReadPixels(0, 0, size.width, size.height, GL_RGBA, GL_FLOAT, values.data());
  gl::checkErrors("reading a picture back");
  return values;
}

void drawFullscreen(const gl::VertexArray& empty) {
  const gl::Functions& gl = gl::functions();
  gl.BindVertexArray(empty.id());
  gl.DrawArrays(GL_TRIANGLES, 0, 3);
}

void bindSampler(const gl::Program& program, const char* name, int unit,
                 const gl::Texture& texture) {
  texture.bind(unit);
  gl::functions().Uniform1i(program.uniform(name), unit);
}

}  // namespace vestige::gpu
