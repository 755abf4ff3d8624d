// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "proxy/gl/functions.h"

namespace vestige::gl {

/// One way to an OpenGL context. Made, used and destroyed on the thread where it is current.
class Context {
 public:
  virtual ~Context() = default;
  virtual const Functions& functions() const = 0;
  virtual const char* backend() const = 0;
};

/// Each opens its library with dlopen, makes a context of OpenGL 4.3 or later core, and makes it
/// current; throws NoGl with the reason and how to mend it.
std::unique_ptr<Context> openOSMesa();
std::unique_ptr<Context> openEgl();

/// What gl::functions() gives on this thread.
void setThreadFunctions(const Functions* functions);

}  // namespace vestige::gl
