// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <utility>

#include "proxy/gl/functions.h"

namespace vestige::gl {

/// RAII for GL names; made, used and destroyed inside Device::run.
class Texture {
 public:
  explicit Texture(GLenum target);
  ~Texture();
  Texture(Texture&& other) noexcept;
  Texture& operator=(Texture&& other) noexcept;
  GLuint id() const { return id_; }
  GLenum target() const { return target_; }
  void bind(int unit) const;

 private:
  GLuint id_ = 0;
  GLenum target_;
};

class Buffer {
 public:
  Buffer();
  ~Buffer();
  Buffer(Buffer&& other) noexcept;
  Buffer& operator=(Buffer&& other) noexcept;
  GLuint id() const { return id_; }

 private:
  GLuint id_ = 0;
};

class Framebuffer {
 public:
  Framebuffer();
  ~Framebuffer();
  Framebuffer(Framebuffer&& other) noexcept;
  Framebuffer& operator=(Framebuffer&& other) noexcept;
  GLuint id() const { return id_; }

 private:
  GLuint id_ = 0;
};

class VertexArray {
 public:
  VertexArray();
  ~VertexArray();
  VertexArray(VertexArray&& other) noexcept;
  VertexArray& operator=(VertexArray&& other) noexcept;
  GLuint id() const { return id_; }

 private:
  GLuint id_ = 0;
};

/// Throws Gl naming `where` and the error if GL has one pending.
void checkErrors(const char* where);

}  // namespace vestige::gl
