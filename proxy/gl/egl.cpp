// SPDX-License-Identifier: BSD-3-Clause
#define EGL_NO_X11
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>

#include <array>
#include <cstdio>
#include <string>
#include <string_view>

#include "proxy/base/error.h"
#include "proxy/gl/context.h"

namespace vestige::gl {
namespace {

constexpr const char* kEglMend =
    "; install Debian's libegl1 and libegl-mesa0, or set VESTIGE_GL=osmesa";

[[noreturn]] void fail(const std::string& sentence) {
  throw Error(ErrorCode::NoGl, sentence + kEglMend);
}

/// The entry points of libEGL that we use.
struct EglLibrary {
  PFNEGLGETPROCADDRESSPROC getProcAddress;
  PFNEGLQUERYSTRINGPROC queryString;
  PFNEGLINITIALIZEPROC initialize;
  PFNEGLBINDAPIPROC bindApi;
  PFNEGLCHOOSECONFIGPROC chooseConfig;
  PFNEGLCREATECONTEXTPROC createContext;
  PFNEGLDESTROYCONTEXTPROC destroyContext;
  PFNEGLMAKECURRENTPROC makeCurrent;
  PFNEGLGETERRORPROC getError;
  PFNEGLRELEASETHREADPROC releaseThread;

  EglLibrary() {
    library_ = dlopen("libEGL.so.1", RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    if (!library_) {
      const char* reason = dlerror();
      fail(std::string("EGL cannot be opened: ") + (reason ? reason : "unknown reason"));
    }
    load(getProcAddress, "eglGetProcAddress");
    load(queryString, "eglQueryString");
    load(initialize, "eglInitialize");
    load(bindApi, "eglBindAPI");
    load(chooseConfig, "eglChooseConfig");
    load(createContext, "eglCreateContext");
    load(destroyContext, "eglDestroyContext");
    load(makeCurrent, "eglMakeCurrent");
    load(getError, "eglGetError");
    load(releaseThread, "eglReleaseThread");
  }

  /// Core entry points too: EGL_KHR_get_all_proc_addresses is not everywhere.
  void* address(const char* name) const {
    if (auto function = reinterpret_cast<void*>(getProcAddress(name))) return function;
    return dlsym(library_, name);
  }

  std::string lastError() const {
    char text[16];
    std::snprintf(text, sizeof text, "0x%04x", unsigned(getError()));
    return std::string("EGL error ") + text;
  }

 private:
  template <typename Function>
  void load(Function& function, const char* name) {
    function = reinterpret_cast<Function>(dlsym(library_, name));
    if (!function) fail(std::string("libEGL has no ") + name);
  }
  void* library_;
};

bool lists(const char* extensions, std::string_view name) {
  std::string_view rest = extensions ? extensions : "";
  while (!rest.empty()) {
    const auto end = rest.find(' ');
    if (rest.substr(0, end) == name) return true;
    if (end == std::string_view::npos) break;
    rest.remove_prefix(end + 1);
  }
  return false;
}

class EglCurrent final : public Context {
 public:
  EglCurrent() {
    openDisplay();
    createContext();
    if (!egl_.makeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) {
      egl_.destroyContext(display_, context_);
      fail("EGL does not make a context without a surface current (" + egl_.lastError() + ")");
    }
    functions_ = Functions::load([this](const char* name) { return egl_.address(name); });
  }
  ~EglCurrent() override {
    // The display stays initialised: it belongs to the whole process, and the host may use it.
    egl_.makeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    egl_.destroyContext(display_, context_);
    egl_.releaseThread();
  }

  const Functions& functions() const override { return functions_; }
  const char* backend() const override { return "egl"; }

 private:
  void openDisplay() {
    const char* client = egl_.queryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (!lists(client, "EGL_MESA_platform_surfaceless")) {
      fail("EGL has no surfaceless platform");
    }
    const auto getDisplay = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
        egl_.getProcAddress("eglGetPlatformDisplayEXT"));
    if (!getDisplay) fail("libEGL has no eglGetPlatformDisplayEXT");
    display_ = getDisplay(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
    if (display_ == EGL_NO_DISPLAY || !egl_.initialize(display_, nullptr, nullptr)) {
      fail("EGL's surfaceless display cannot be initialised (" + egl_.lastError() + ")");
    }
    if (!egl_.bindApi(EGL_OPENGL_API)) fail("EGL does not know desktop OpenGL");
  }

  EGLConfig chooseConfig() const {
    const char* extensions = egl_.queryString(display_, EGL_EXTENSIONS);
    if (lists(extensions, "EGL_KHR_no_config_context")) return nullptr;
    const std::array<EGLint, 5> wanted = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0,
                                          EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (!egl_.chooseConfig(display_, wanted.data(), &config, 1, &count) || count < 1) {
      fail("EGL has no configuration for desktop OpenGL");
    }
    return config;
  }

  void createContext() {
    const EGLConfig config = chooseConfig();
    for (EGLint minor = 5; minor >= 3; --minor) {
      const std::array<EGLint, 7> attributes = {EGL_CONTEXT_MAJOR_VERSION,
                                                4,
                                                EGL_CONTEXT_MINOR_VERSION,
                                                minor,
                                                EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                                EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                                EGL_NONE};
      context_ = egl_.createContext(display_, config, EGL_NO_CONTEXT, attributes.data());
      if (context_ != EGL_NO_CONTEXT) return;
    }
    fail("EGL makes no OpenGL 4.3 core context (" + egl_.lastError() + ")");
  }

  EglLibrary egl_;
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
  Functions functions_;
};

}  // namespace

std::unique_ptr<Context> openEgl() { return std::make_unique<EglCurrent>(); }

}  // namespace vestige::gl
