// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <exception>
#include <string>

#include "adaptor/include/vestige.h"

namespace vestige {

/// The code of the C API for an exception, and its sentence. The only place where exceptions become
/// codes; throws nothing.
vestige_code codeOf(const std::exception_ptr& failure, std::string& sentence) noexcept;

}  // namespace vestige
