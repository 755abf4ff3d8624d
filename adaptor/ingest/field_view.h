// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace vestige {

/// As vestige_type and vestige_location, value for value.
enum class SampleType {
  Float32 = 0,
  Float64 = 1,
  Int8 = 2,
  UInt8 = 3,
  Int16 = 4,
  UInt16 = 5,
  Int32 = 6,
  UInt32 = 7,
  Int64 = 8,
  UInt64 = 9
};
enum class Location { Point = 0, Cell = 1 };

inline constexpr int kSampleTypes = 10;
std::size_t sizeOf(SampleType type);
/// "Float32", "UInt8" ...: the names that VTK's XML files use too.
const char* nameOf(SampleType type);
const char* nameOf(Location location);

/// A field of one block in the host's memory; nothing is owned. Sample (x, y, z) of component c is
/// at components[c] + x * strides[0] + y * strides[1] + z * strides[2] bytes; any alignment.
struct FieldView {
  std::string name;
  SampleType type = SampleType::Float32;
  Location location = Location::Point;
  std::vector<const std::byte*> components;
  std::array<std::ptrdiff_t, 3> strides{};
  std::array<int, 3> size{};  ///< samples along x, y, z, ghosts included
};

/// Samples [low, high) per axis.
struct SampleRange {
  std::array<int, 3> low{}, high{};
  bool empty() const { return high[0] <= low[0] || high[1] <= low[1] || high[2] <= low[2]; }
  friend bool operator==(const SampleRange&, const SampleRange&) = default;
};

/// Samples with (value & bits) != 0 are no data.
struct MaskView {
  const std::byte* data = nullptr;
  std::uint8_t bits = 0xff;
  std::array<std::ptrdiff_t, 3> strides{};
};

/// Values low .. high, both included; one value where they are equal.
struct ValueRange {
  double low = 0.0, high = 0.0;
  friend bool operator==(const ValueRange&, const ValueRange&) = default;
};

/// The scalar that a field of the configuration is made of.
struct Derivation {
  int component = 0;      ///< -1: the magnitude over all components
  bool gradient = false;  ///< the gradient's magnitude of that, in world units (method §1)
  /// What stands for no data in any of the components that are read. A value is compared as the
  /// host's type holds it.
  std::vector<ValueRange> noData;
  friend bool operator==(const Derivation&, const Derivation&) = default;
};

/// Reads rows of a derived scalar in double; no data (NaN, infinite, masked, a fill value) is NaN.
/// Const and usable from several threads; the views must outlive it.
class FieldReader {
 public:
  /// `nodes` are the world positions of the samples per axis (for gradients).
  FieldReader(const FieldView& field, std::optional<MaskView> mask, Derivation derivation,
              const std::array<std::vector<double>, 3>& nodes);

  /// The multi-field gradient norm (FieldSample::gradient): of the gradients of all `terms`, each
  /// divided by its range. All on the same nodes; no data in one is none at all.
  FieldReader(std::vector<FieldReader> terms, std::vector<double> ranges);

  const std::array<int, 3>& size() const { return field_.size; }
  /// Values (0..size x, y, z).
  void row(int y, int z, double* out) const;

 private:
  void scalarRow(int y, int z, double* out) const;
  /// A row of a component; `offset`: of the row's first sample, bytes.
  void componentRow(std::size_t component, std::ptrdiff_t offset, double* out) const;
  void magnitudeRow(std::ptrdiff_t offset, double* out) const;
  void gradientRow(int y, int z, double* out) const;
  void normRow(int y, int z, double* out) const;

  FieldView field_;
  std::optional<MaskView> mask_;
  Derivation derivation_;  ///< noData as the host's type holds it
  std::array<std::vector<double>, 3> nodes_;
  std::vector<FieldReader> terms_;  ///< of a norm
  std::vector<double> ranges_;
};

/// What lies far beyond a range is no infinity, which would stand for no data; its square fits a
/// float.
inline constexpr double kFarBeyondRange = 1e15;

/// Normalised samples [z0, z1), all y, all x of a window of a reader, z counted from the window's
/// first, for Marcher::upload: (f - low) / (high - low) in double, cut at `most` on either side of
/// 0, then float; no data is NaN.
void fillNormalised(const FieldReader& reader, double low, double high, const SampleRange& window,
                    int z0, int z1, float* out, int threads, double most = kFarBeyondRange);

}  // namespace vestige
