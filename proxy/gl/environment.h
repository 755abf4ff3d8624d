// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <csignal>
#include <optional>
#include <string>

namespace vestige::gl {

/// Blocks every signal on this thread while alive; threads started meanwhile inherit that.
class SignalsBlocked {
 public:
  SignalsBlocked();
  ~SignalsBlocked();
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;

 private:
  sigset_t before_;
};

/// Gives this thread what a process starts with: floating-point exceptions masked, rounding to
/// nearest, no flush to zero (x87 and MXCSR), and every processor that the system lets it have.
void resetThread();

/// Processors that this thread may run on.
int allowedProcessors();

/// Whether Mesa can keep compiled shaders where the environment says, or in ~/.cache; where it
/// cannot, it prints so. Makes the folder, as Mesa would.
bool hasShaderCache();

/// Has getenv(name) give `value` while alive. The host's environment array is neither edited nor
/// reallocated: `environ` points to a copy with one more entry meanwhile, so other threads that
/// read the environment at this moment see the old array or the new one, both whole. (setenv
/// may move the array under them.) The copy is kept for ever for the sake of such readers.
class ScopedEnvironment {
 public:
  ScopedEnvironment(const std::string& name, const std::string& value);
  ~ScopedEnvironment();
  ScopedEnvironment(const ScopedEnvironment&) = delete;
  ScopedEnvironment& operator=(const ScopedEnvironment&) = delete;

 private:
  std::string name_;
  char** before_;
  char** during_;
};

}  // namespace vestige::gl
