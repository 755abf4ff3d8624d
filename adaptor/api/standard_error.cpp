// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/api/standard_error.h"

#include <fcntl.h>
#include <unistd.h>

#include <thread>

#include "proxy/gl/environment.h"

namespace vestige {

bool hasStandardError() {
  // Streams are inherited; libraries' files, which may have any free number, close on exec.
  const int flags = ::fcntl(STDERR_FILENO, F_GETFD);
  return flags >= 0 && (flags & FD_CLOEXEC) == 0;
}

void printLine(std::string line) noexcept {
  try {
    if (!hasStandardError()) return;
    line += '\n';
    // SIGPIPE and SIGXFSZ go to the thread that writes: to one that blocks them, and ends.
    const gl::SignalsBlocked blocked;
    std::thread([&line] {
      [[maybe_unused]] const auto written = ::write(STDERR_FILENO, line.data(), line.size());
    }).join();
  } catch (...) {
    // Without memory or threads the code has to do.
  }
}

}  // namespace vestige
