// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vtkSmartPointer.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

class vtkDataSet;

namespace minisim {

/// What a headerless file holds.
struct RawLayout {
  std::array<int, 3> shape{};  ///< samples along x (fastest), y, z
  std::string type = "int16";  ///< int8 uint8 int16 uint16 int32 uint32 float32 float64
  std::array<double, 3> spacing = {1.0, 1.0, 1.0};
  bool bigEndian = false;
  std::uintmax_t header = 0;  ///< bytes to skip
};

/// The name that arrays of formats without names get.
inline constexpr char kUnnamedArray[] = "scalars";

/// Reads a file, or a folder of DICOM slices, through VTK's readers; with `raw`, headerless bytes.
/// Samples stand in the order of the files, x fastest; those of DICOM along rows, down columns and
/// along the slices' positions, without VTK's half turn.
/// Whatever is missing, truncated or not what its name says throws std::runtime_error naming the
/// file and VTK's reason. VTK itself prints nothing.
vtkSmartPointer<vtkDataSet> readDataSet(const std::filesystem::path& file,
                                        const std::optional<RawLayout>& raw);

/// The time that a VTK file states (field data "TimeValue"), if any.
std::optional<double> statedTime(vtkDataSet* data);

}  // namespace minisim
