// SPDX-License-Identifier: BSD-3-Clause
#include <GL/osmesa.h>

#include <stdexcept>

#include "tests/proxy/gl/host_context.h"

namespace vestige::gl {

struct HostOSMesa::Impl {
  OSMesaContext context = nullptr;
  std::vector<unsigned char> picture = std::vector<unsigned char>(4 * 8 * 8);
};

HostOSMesa::HostOSMesa() : impl_(std::make_unique<Impl>()) {
  impl_->context = OSMesaCreateContext(OSMESA_RGBA, nullptr);
  if (!impl_->context ||
      !OSMesaMakeCurrent(impl_->context, impl_->picture.data(), GL_UNSIGNED_BYTE, 8, 8)) {
    throw std::runtime_error("the host of this test gets no OSMesa context");
  }
}
HostOSMesa::~HostOSMesa() {
  OSMesaMakeCurrent(nullptr, nullptr, 0, 0, 0);
  OSMesaDestroyContext(impl_->context);
}
void HostOSMesa::clear(float r, float g, float b) {
  glClearColor(r, g, b, 1.0f);
  glClear(GL_COLOR_BUFFER_BIT);
  glFinish();
}
bool HostOSMesa::isCurrent() const { return OSMesaGetCurrentContext() == impl_->context; }
std::vector<float> HostOSMesa::clearColor() const {
  std::vector<float> color(4);
  glGetFloatv(GL_COLOR_CLEAR_VALUE, color.data());
  return color;
}
std::vector<unsigned char> HostOSMesa::pixel() const {
  return {impl_->picture.begin(), impl_->picture.begin() + 4};
}

}  // namespace vestige::gl
