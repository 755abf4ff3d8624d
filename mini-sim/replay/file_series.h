// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace minisim {

/// How a file is read; by its extension (.vti .vtr .vtk .mhd .mha .nrrd .nhdr .nii .nii.gz).
enum class FileKind { VtkXmlImage, VtkXmlRectilinear, VtkLegacy, MetaImage, Nrrd, Nifti, Unknown };
FileKind kindOf(const std::filesystem::path& file);

/// "step2" before "step10": runs of digits compare as numbers, the rest as bytes.
bool naturalLess(const std::string& a, const std::string& b);

/// The steps that the arguments name: files stand for themselves; a folder stands for the files in
/// it that can be read, in natural order, or, if there are none, for itself (DICOM slices of one
/// volume). With `raw` every file of a folder counts. Throws std::runtime_error naming the path
/// that does not exist or the folder that is empty.
std::vector<std::filesystem::path> stepsOf(const std::vector<std::filesystem::path>& arguments,
                                           bool raw);

}  // namespace minisim
