// SPDX-License-Identifier: BSD-3-Clause
//
// Vestige for C++ solvers: the C API (vestige.h, whose conventions hold) with a session that closes
// itself and with types deduced. Nothing here throws; every call returns a vestige_code. C++17.
#ifndef VESTIGE_HPP
#define VESTIGE_HPP

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "vestige.h"

namespace vestige {

/// The vestige_type of a C++ type.
template <class T>
struct TypeOf;
// clang-format off
template <> struct TypeOf<float> { static constexpr int value = VESTIGE_FLOAT32; };
template <> struct TypeOf<double> { static constexpr int value = VESTIGE_FLOAT64; };
template <> struct TypeOf<std::int8_t> { static constexpr int value = VESTIGE_INT8; };
template <> struct TypeOf<std::uint8_t> { static constexpr int value = VESTIGE_UINT8; };
template <> struct TypeOf<std::int16_t> { static constexpr int value = VESTIGE_INT16; };
template <> struct TypeOf<std::uint16_t> { static constexpr int value = VESTIGE_UINT16; };
template <> struct TypeOf<std::int32_t> { static constexpr int value = VESTIGE_INT32; };
template <> struct TypeOf<std::uint32_t> { static constexpr int value = VESTIGE_UINT32; };
template <> struct TypeOf<std::int64_t> { static constexpr int value = VESTIGE_INT64; };
template <> struct TypeOf<std::uint64_t> { static constexpr int value = VESTIGE_UINT64; };
// clang-format on

/// A uniform grid of points; see vestige_grid for axes, ghosts and blocks.
inline vestige_grid uniformGrid(std::array<int, 3> points, std::array<double, 3> origin,
                                std::array<double, 3> spacing) {
  vestige_grid grid = VESTIGE_GRID_INIT;
  for (std::size_t a = 0; a < 3; ++a) {
    grid.points[a] = points[a];
    grid.origin[a] = origin[a];
    grid.spacing[a] = spacing[a];
  }
  return grid;
}

/// Owns a session (vestige_open, vestige_close). Movable, not copyable.
class Adaptor {
 public:
  /// Opens with the defaults, or as the options say. Look at code() for the result; a session that
  /// could not be opened is harmless.
  Adaptor() : code_(vestige_open(nullptr, &session_)) {}
  explicit Adaptor(const vestige_options& options) : code_(vestige_open(&options, &session_)) {}
  ~Adaptor() { vestige_close(session_); }
  Adaptor(Adaptor&& other) noexcept
      : session_(std::exchange(other.session_, nullptr)), code_(other.code_) {}
  Adaptor& operator=(Adaptor&& other) noexcept {
    std::swap(session_, other.session_);
    std::swap(code_, other.code_);
    return *this;
  }
  Adaptor(const Adaptor&) = delete;
  Adaptor& operator=(const Adaptor&) = delete;

  /// What vestige_open returned.
  int code() const { return code_; }
  /// The C session, for calls that are not here.
  vestige_session* get() const { return session_; }
  /// The sentence of the last error, "" if there was none.
  std::string lastError() const { return vestige_last_error(session_); }

  /// The whole domain in world units; optional.
  int domain(const std::array<double, 3>& low, const std::array<double, 3>& high) {
    return vestige_domain(session_, low.data(), high.data());
  }
  /// Whether the step may be stored; ask before preparing anything.
  bool wants(std::int64_t cycle, double time) { return vestige_wants(session_, cycle, time) != 0; }
  /// Whether the field of this name is stored; others need not be gathered.
  bool wantsField(const char* name) { return vestige_wants_field(session_, name) != 0; }
  /// Describes a block; holds until described again.
  int block(int index, const vestige_grid& grid) { return vestige_block(session_, index, &grid); }
  /// Shares a field; the memory stays the caller's and must be valid until execute returns. Null
  /// strides: x fastest, components side by side.
  template <class T>
  int shareField(int block, const char* name, int location, const T* data, int components = 1,
                 const std::ptrdiff_t* strides = nullptr) {
    return vestige_share_field(session_, block, name, TypeOf<T>::value, location, components, data,
                               strides);
  }
  /// The same for components in arrays of their own.
  template <class T, std::size_t N>
  int shareComponents(int block, const char* name, int location,
                      const std::array<const T*, N>& data,
                      const std::ptrdiff_t* strides = nullptr) {
    std::array<const void*, N> pointers{};
    for (std::size_t i = 0; i < N; ++i) pointers[i] = data[i];
    return vestige_share_components(session_, block, name, TypeOf<T>::value, location, int(N),
                                    pointers.data(), strides);
  }
  /// Samples where (mask & bits) is not 0 are no data.
  int shareMask(int block, int location, const std::uint8_t* mask, std::uint8_t bits = 0xff,
                const std::ptrdiff_t* strides = nullptr) {
    return vestige_share_mask(session_, block, location, mask, bits, strides);
  }
  /// The units of a field.
  int units(const char* name, const char* units) { return vestige_units(session_, name, units); }
  /// Stores the step if a trigger fires; what was shared is forgotten.
  int execute(std::int64_t cycle, double time) { return vestige_execute(session_, cycle, time); }
  /// Ends the session before its time; the code says how it went (vestige_close).
  int close() { return vestige_close(std::exchange(session_, nullptr)); }
  /// Steps stored so far.
  std::int64_t storedSteps() const { return vestige_stored_steps(session_); }

 private:
  vestige_session* session_ = nullptr;
  int code_ = VESTIGE_OK;
};

}  // namespace vestige

#endif
