// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/gl/objects.h"

#include <string>

#include "proxy/base/error.h"

namespace vestige::gl {

Texture::Texture(GLenum target) : target_(target) { functions().GenTextures(1, &id_); }
Texture::~Texture() {
  if (id_) functions().DeleteTextures(1, &id_);
}
Texture::Texture(Texture&& other) noexcept
    : id_(std::exchange(other.id_, 0)), target_(other.target_) {}
Texture& Texture::operator=(Texture&& other) noexcept {
  std::swap(id_, other.id_);
  std::swap(target_, other.target_);
  return *this;
}
void Texture::bind(int unit) const {
  functions().ActiveTexture(GL_TEXTURE0 + GLenum(unit));
  functions().BindTexture(target_, id_);
}

Buffer::Buffer() { functions().GenBuffers(1, &id_); }
Buffer::~Buffer() {
  if (id_) functions().DeleteBuffers(1, &id_);
}
Buffer::Buffer(Buffer&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
Buffer& Buffer::operator=(Buffer&& other) noexcept {
  std::swap(id_, other.id_);
  return *this;
}

Framebuffer::Framebuffer() { functions().GenFramebuffers(1, &id_); }
Framebuffer::~Framebuffer() {
  if (id_) functions().DeleteFramebuffers(1, &id_);
}
Framebuffer::Framebuffer(Framebuffer&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
Framebuffer& Framebuffer::operator=(Framebuffer&& other) noexcept {
  std::swap(id_, other.id_);
  return *this;
}

VertexArray::VertexArray() { functions().GenVertexArrays(1, &id_); }
VertexArray::~VertexArray() {
  if (id_) functions().DeleteVertexArrays(1, &id_);
}
VertexArray::VertexArray(VertexArray&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
VertexArray& VertexArray::operator=(VertexArray&& other) noexcept {
  std::swap(id_, other.id_);
  return *this;
}

namespace {

const char* errorName(GLenum error) {
  switch (error) {
    case GL_INVALID_ENUM:
      return "invalid enum";
    case GL_INVALID_VALUE:
      return "invalid value";
    case GL_INVALID_OPERATION:
      return "invalid operation";
    case GL_INVALID_FRAMEBUFFER_OPERATION:
      return "invalid framebuffer operation";
    case GL_OUT_OF_MEMORY:
      return "out of memory";
    default:
      return "unknown error";
  }
}

}  // namespace

void checkErrors(const char* where) {
  const GLenum error = functions().GetError();
  if (error == GL_NO_ERROR) return;
  // A lost context may report errors for ever; a few reads empty the queue of a sane one.
  for (int i = 0; i < 16 && functions().GetError() != GL_NO_ERROR; ++i) {
  }
  throw Error(ErrorCode::Gl, std::string("OpenGL: ") + errorName(error) + " in " + where);
}

}  // namespace vestige::gl
