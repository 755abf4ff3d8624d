// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <optional>

namespace minisim {

// What VTK's readers do not notice themselves. All throw std::runtime_error naming the file.

/// MetaIO hands out zeros where the data end early.
void checkMetaImageSize(const std::filesystem::path& file);

/// A NRRD file of three axes that does not say (field "kinds") what they are. VTK takes the first
/// of them for components; here are the extents and spacing to mend that. Nothing for other files.
struct NrrdAxes {
  std::array<int, 3> sizes{};
  std::array<double, 3> spacing = {1.0, 1.0, 1.0};
};
std::optional<NrrdAxes> unnamedNrrdAxes(const std::filesystem::path& file);

}  // namespace minisim
