// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <type_traits>

#include "adaptor/common/adaptor_error.h"
#include "proxy/version.h"

namespace vestige {

/// A struct of the C API as this library knows it, whatever header the caller was compiled with
/// (vestige.h, convention 7). Members that an older header lacks keep what `known` holds; bytes
/// that a newer one appended must be 0, as we do not know what they ask for. `firstSize`: of the
/// struct's first version. Throws VERSION naming the struct.
template <typename Struct>
Struct ofAnyVersion(const Struct& given, Struct known, std::size_t firstSize, const char* name) {
  static_assert(std::is_trivially_copyable_v<Struct>);
  constexpr std::size_t kMost = 4096;  ///< of a header that may come
  const std::size_t size = given.size;
  if (size < firstSize || size > kMost) {
    throw AdaptorError(VESTIGE_ERROR_VERSION,
                       fmt::format("{} has the size {}, which is not in {}..{}: initialise it with "
                                   "the macro of vestige.h",
                                   name, size, firstSize, kMost));
  }
  const auto* bytes = reinterpret_cast<const unsigned char*>(&given);
  for (std::size_t i = sizeof known; i < size; ++i) {
    if (bytes[i] != 0) {
      throw AdaptorError(
          VESTIGE_ERROR_VERSION,
          fmt::format("{} is of a newer header than this library, {}", name, kVersion));
    }
  }
  std::memcpy(&known, bytes, std::min(size, sizeof known));
  return known;
}

}  // namespace vestige
