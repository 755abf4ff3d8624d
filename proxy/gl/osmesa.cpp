// SPDX-License-Identifier: BSD-3-Clause
#include <dlfcn.h>

#include <array>
#include <string>

#include "proxy/base/error.h"
#include "proxy/gl/context.h"

namespace vestige::gl {
namespace {

// The library's interface, declared here because <GL/osmesa.h> brings <GL/gl.h> along, which does
// not go together with <GL/glcorearb.h>.
using OSMesaContext = struct osmesa_context*;
using CreateContextAttribs = OSMesaContext (*)(const int* attributes, OSMesaContext shared);
using MakeCurrent = GLboolean (*)(OSMesaContext, void* buffer, GLenum type, GLsizei width,
                                  GLsizei height);
using GetProcAddress = void (*(*)(const char* name))();
using DestroyContext = void (*)(OSMesaContext);
constexpr int kFormat = 0x22, kProfile = 0x33, kCoreProfile = 0x34;
constexpr int kMajorVersion = 0x36, kMinorVersion = 0x37;

constexpr const char* kOsMesaMend =
    "; install Debian's libosmesa6 (Mesa before 25.1), or set VESTIGE_GL=egl";

template <typename Function>
Function symbol(void* library, const char* name) {
  auto function = reinterpret_cast<Function>(dlsym(library, name));
  if (!function) {
    throw Error(ErrorCode::NoGl, std::string("libOSMesa has no ") + name + kOsMesaMend);
  }
  return function;
}

void* openLibrary() {
  // Local: the names of its OpenGL functions must not shadow those of the host's own library.
  // Never closed: the rasteriser's threads and exit handlers outlive any context.
  for (const char* name : {"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"}) {
    if (void* library = dlopen(name, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE)) return library;
  }
  const char* reason = dlerror();
  throw Error(ErrorCode::NoGl, std::string("OSMesa cannot be opened: ") +
                                   (reason ? reason : "unknown reason") + kOsMesaMend);
}

class OSMesaCurrent final : public Context {
 public:
  OSMesaCurrent() {
    void* library = openLibrary();
    const auto create = symbol<CreateContextAttribs>(library, "OSMesaCreateContextAttribs");
    const auto makeCurrent = symbol<MakeCurrent>(library, "OSMesaMakeCurrent");
    const auto address = symbol<GetProcAddress>(library, "OSMesaGetProcAddress");
    destroy_ = symbol<DestroyContext>(library, "OSMesaDestroyContext");

    for (int minor = 5; minor >= 3 && !context_; --minor) {
      const std::array<int, 11> attributes = {
          kFormat, GL_RGBA, kProfile, kCoreProfile, kMajorVersion, 4, kMinorVersion, minor,
          0,       0,       0};
      context_ = create(attributes.data(), nullptr);
    }
    if (!context_) {
      throw Error(ErrorCode::NoGl,
                  std::string("OSMesa makes no OpenGL 4.3 core context") + kOsMesaMend);
    }
    if (!makeCurrent(context_, buffer_.data(), GL_UNSIGNED_BYTE, kSide, kSide)) {
      destroy_(context_);
      throw Error(ErrorCode::NoGl,
                  std::string("OSMesa does not make its context current") + kOsMesaMend);
    }
    functions_ = Functions::load(
        [address](const char* name) { return reinterpret_cast<void*>(address(name)); });
  }
  ~OSMesaCurrent() override { destroy_(context_); }

  const Functions& functions() const override { return functions_; }
  const char* backend() const override { return "osmesa"; }

 private:
  static constexpr int kSide = 16;  // we draw to framebuffer objects only
  std::array<unsigned char, 4 * kSide * kSide> buffer_{};
  DestroyContext destroy_ = nullptr;
  OSMesaContext context_ = nullptr;
  Functions functions_;
};

}  // namespace

std::unique_ptr<Context> openOSMesa() { return std::make_unique<OSMesaCurrent>(); }

}  // namespace vestige::gl
