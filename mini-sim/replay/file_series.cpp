// SPDX-License-Identifier: BSD-3-Clause
#include "mini-sim/replay/file_series.h"

#include <algorithm>
#include <cctype>
#include <stdexcept>
#include <utility>

namespace minisim {
namespace {

bool isDigit(char c) { return c >= '0' && c <= '9'; }

/// The run of digits at `at`, leading zeros dropped; moves `at` behind it.
std::string digitsAt(const std::string& text, std::size_t& at) {
  while (at < text.size() && text[at] == '0') ++at;
  const std::size_t start = at;
  while (at < text.size() && isDigit(text[at])) ++at;
  return text.substr(start, at - start);
}

}  // namespace

FileKind kindOf(const std::filesystem::path& file) {
  std::string name = file.filename().string();
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  static constexpr std::pair<const char*, FileKind> kExtensions[] = {
      {".vti", FileKind::VtkXmlImage}, {".vtr", FileKind::VtkXmlRectilinear},
      {".vtk", FileKind::VtkLegacy},   {".mhd", FileKind::MetaImage},
      {".mha", FileKind::MetaImage},   {".nrrd", FileKind::Nrrd},
      {".nhdr", FileKind::Nrrd},       {".nii", FileKind::Nifti},
      {".nii.gz", FileKind::Nifti}};
  for (const auto& [extension, kind] : kExtensions)
    if (name.ends_with(extension)) return kind;
  return FileKind::Unknown;
}

bool naturalLess(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (isDigit(a[i]) && isDigit(b[j])) {
      const std::string x = digitsAt(a, i), y = digitsAt(b, j);
      if (x.size() != y.size()) return x.size() < y.size();
      if (x != y) return x < y;
    } else {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i;
      ++j;
    }
  }
  // Equal but for leading zeros, or one is the start of the other.
  return a.size() - i != b.size() - j ? a.size() - i < b.size() - j : a < b;
}

std::vector<std::filesystem::path> stepsOf(const std::vector<std::filesystem::path>& arguments,
                                           bool raw) {
  namespace fs = std::filesystem;
  std::vector<fs::path> steps;
  for (const fs::path& argument : arguments) {
    if (!fs::exists(argument))
      throw std::runtime_error("'" + argument.string() + "' does not exist");
    if (!fs::is_directory(argument)) {
      steps.push_back(argument);
      continue;
    }
    std::vector<fs::path> files;
    bool any = false;
    for (const auto& entry : fs::directory_iterator(argument)) {
      if (!entry.is_regular_file()) continue;
      any = true;
      if (raw || kindOf(entry.path()) != FileKind::Unknown) files.push_back(entry.path());
    }
    if (!any) throw std::runtime_error("folder '" + argument.string() + "' has no files");
    std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
      return naturalLess(a.filename().string(), b.filename().string());
    });
    if (files.empty()) files.push_back(argument);
    steps.insert(steps.end(), files.begin(), files.end());
  }
  return steps;
}

}  // namespace minisim
