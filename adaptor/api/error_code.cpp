// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/api/error_code.h"

#include <filesystem>
#include <new>
#include <system_error>

#include "adaptor/common/adaptor_error.h"

namespace vestige {
namespace {

static_assert(int(ErrorCode::InvalidArgument) == VESTIGE_ERROR_ARGUMENT &&
              int(ErrorCode::Config) == VESTIGE_ERROR_CONFIG &&
              int(ErrorCode::NoGl) == VESTIGE_ERROR_NO_GL &&
              int(ErrorCode::Gl) == VESTIGE_ERROR_GL && int(ErrorCode::Io) == VESTIGE_ERROR_IO &&
              int(ErrorCode::NoSpace) == VESTIGE_ERROR_NO_SPACE &&
              int(ErrorCode::Format) == VESTIGE_ERROR_FORMAT &&
              int(ErrorCode::Exists) == VESTIGE_ERROR_EXISTS &&
              int(ErrorCode::NotFound) == VESTIGE_ERROR_NOT_FOUND &&
              int(ErrorCode::Internal) == VESTIGE_ERROR_INTERNAL);

/// Out of memory there may be none for the sentence either.
void keep(std::string& sentence, const char* text) noexcept {
  try {
    sentence = text;
  } catch (...) {
    sentence.clear();
  }
}

}  // namespace

vestige_code codeOf(const std::exception_ptr& failure, std::string& sentence) noexcept {
  try {
    std::rethrow_exception(failure);
  } catch (const AdaptorError& error) {
    keep(sentence, error.what());
    return error.apiCode();
  } catch (const Error& error) {
    keep(sentence, error.what());
    return vestige_code(int(error.code()));
  } catch (const std::bad_alloc&) {
    keep(sentence, "out of memory");
    return VESTIGE_ERROR_MEMORY;
  } catch (const std::length_error&) {
    keep(sentence, "out of memory: a size is beyond what can be addressed");
    return VESTIGE_ERROR_MEMORY;
  } catch (const std::filesystem::filesystem_error& error) {
    keep(sentence, error.what());
    return VESTIGE_ERROR_IO;
  } catch (const std::exception& error) {
    keep(sentence, error.what());
    return VESTIGE_ERROR_INTERNAL;
  } catch (...) {
    keep(sentence, "unknown fault");
    return VESTIGE_ERROR_INTERNAL;
  }
}

}  // namespace vestige
