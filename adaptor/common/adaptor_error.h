// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "adaptor/include/vestige.h"
#include "proxy/base/error.h"

namespace vestige {

/// A reason that only the in-situ side knows: it carries its code of the C API.
class AdaptorError : public Error {
 public:
  AdaptorError(vestige_code code, const std::string& sentence)
      : Error(ErrorCode::InvalidArgument, sentence), apiCode_(code) {}
  vestige_code apiCode() const { return apiCode_; }

 private:
  vestige_code apiCode_;
};

}  // namespace vestige
