// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

namespace vestige {

/// Why something failed; one code per reason that a caller could act upon.
enum class ErrorCode {
  InvalidArgument = 1,  ///< a value that the caller gave is out of its stated range
  Config = 2,           ///< a configuration, look or transfer function does not parse or make sense
  NoGl = 3,             ///< no OpenGL implementation could be opened
  Gl = 4,               ///< OpenGL failed: shader does not compile, out of texture memory ...
  Io = 5,               ///< a file could not be read or written
  NoSpace = 6,          ///< the disk, a quota or a file-size limit is full
  Format = 7,           ///< a file is not what it should be: truncated, hostile, unknown version
  Exists = 8,           ///< the archive exists and the policy is to refuse
  NotFound = 9,         ///< what was asked for is not in the archive
  Internal = 10,        ///< a fault of ours
};

/// The exception of the whole project. `what()` is one sentence that names the offending value.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& sentence) : std::runtime_error(sentence), code_(code) {}
  ErrorCode code() const { return code_; }

 private:
  ErrorCode code_;
};

}  // namespace vestige
