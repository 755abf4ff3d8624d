// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/gl/functions.h"

#include <string>

#include "proxy/base/error.h"
#include "proxy/gl/context.h"

namespace vestige::gl {
namespace {

thread_local const Functions* currentFunctions = nullptr;

}  // namespace

Functions Functions::load(const Loader& loader) {
  Functions f;
#define VESTIGE_GL_LOAD(name, NAME)                                                              \
  f.name = reinterpret_cast<PFNGL##NAME##PROC>(loader("gl" #name));                              \
  if (!f.name) {                                                                                 \
    throw Error(ErrorCode::NoGl,                                                                 \
                std::string("the OpenGL library has no gl") + #name + "; OpenGL 4.3 is needed"); \
  }
  VESTIGE_GL_FUNCTIONS(VESTIGE_GL_LOAD)
#undef VESTIGE_GL_LOAD
  return f;
}

const Functions& functions() {
  if (!currentFunctions) {
    throw Error(ErrorCode::Internal, "an OpenGL function was called outside gl::Device::run");
  }
  return *currentFunctions;
}

void setThreadFunctions(const Functions* functions) { currentFunctions = functions; }

}  // namespace vestige::gl
