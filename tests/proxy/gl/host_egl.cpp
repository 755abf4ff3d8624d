// SPDX-License-Identifier: BSD-3-Clause
#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/gl.h>

#include <stdexcept>

#include "tests/proxy/gl/host_context.h"

namespace vestige::gl {

struct HostEgl::Impl {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLSurface surface = EGL_NO_SURFACE;
  EGLContext context = EGL_NO_CONTEXT;
  void (*clearColor)(GLfloat, GLfloat, GLfloat, GLfloat);
  void (*clear)(GLbitfield);
  void (*readPixels)(GLint, GLint, GLsizei, GLsizei, GLenum, GLenum, void*);
};

HostEgl::HostEgl() : impl_(std::make_unique<Impl>()) {
  Impl& host = *impl_;
  host.display = eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
  const EGLint wanted[] = {EGL_SURFACE_TYPE,
                           EGL_PBUFFER_BIT,
                           EGL_RENDERABLE_TYPE,
                           EGL_OPENGL_BIT,
                           EGL_RED_SIZE,
                           8,
                           EGL_ALPHA_SIZE,
                           8,
                           EGL_NONE};
  const EGLint side[] = {EGL_WIDTH, 8, EGL_HEIGHT, 8, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint count = 0;
  if (!eglInitialize(host.display, nullptr, nullptr) || !eglBindAPI(EGL_OPENGL_API) ||
      !eglChooseConfig(host.display, wanted, &config, 1, &count) || count < 1) {
    throw std::runtime_error("the host of this test gets no EGL display");
  }
  host.surface = eglCreatePbufferSurface(host.display, config, side);
  host.context = eglCreateContext(host.display, config, EGL_NO_CONTEXT, nullptr);
  if (!eglMakeCurrent(host.display, host.surface, host.surface, host.context)) {
    throw std::runtime_error("the host of this test gets no EGL context");
  }
  const auto load = [](auto& function, const char* name) {
    function =
        reinterpret_cast<std::remove_reference_t<decltype(function)>>(eglGetProcAddress(name));
  };
  load(host.clearColor, "glClearColor");
  load(host.clear, "glClear");
  load(host.readPixels, "glReadPixels");
}
HostEgl::~HostEgl() {
  eglMakeCurrent(impl_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroySurface(impl_->display, impl_->surface);
  eglDestroyContext(impl_->display, impl_->context);
}
void HostEgl::clear(float r, float g, float b) {
  impl_->clearColor(r, g, b, 1.0f);
  impl_->clear(GL_COLOR_BUFFER_BIT);
}
bool HostEgl::isCurrent() const { return eglGetCurrentContext() == impl_->context; }
std::vector<unsigned char> HostEgl::pixel() const {
  std::vector<unsigned char> rgba(4);
  impl_->readPixels(0, 0, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  return rgba;
}

}  // namespace vestige::gl
