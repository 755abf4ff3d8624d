// SPDX-License-Identifier: BSD-3-Clause
#include "mini-sim/replay/image_headers.h"

#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>

namespace minisim {
namespace {

using Header = std::map<std::string, std::string>;

std::string trimmed(const std::string& text) {
  const auto from = text.find_first_not_of(" \t\r");
  const auto to = text.find_last_not_of(" \t\r");
  return from == std::string::npos ? std::string() : text.substr(from, to - from + 1);
}

/// Lines "key SEPARATOR value" until one without, or until `last` was read.
Header readHeader(std::istream& in, char separator, const std::string& last) {
  constexpr int kMostLines = 1000;
  Header header;
  std::string line;
  for (int count = 0; count < kMostLines && !header.count(last) && std::getline(in, line);
       ++count) {
    if (line.starts_with("#") || line.starts_with("NRRD")) continue;
    const auto at = line.find(separator);
    if (at == std::string::npos) break;
    header[trimmed(line.substr(0, at))] = trimmed(line.substr(at + 1));
  }
  return header;
}

int metaTypeBytes(const std::string& type) {
  static const std::map<std::string, int> kBytes = {
      {"MET_CHAR", 1}, {"MET_UCHAR", 1}, {"MET_SHORT", 2},     {"MET_USHORT", 2}, {"MET_INT", 4},
      {"MET_UINT", 4}, {"MET_FLOAT", 4}, {"MET_LONG_LONG", 8}, {"MET_DOUBLE", 8}};
  const auto found = kBytes.find(type);
  return found == kBytes.end() ? 0 : found->second;
}

}  // namespace

void checkMetaImageSize(const std::filesystem::path& file) {
  const auto fail = [](const std::filesystem::path& which, const std::string& reason) {
    throw std::runtime_error("'" + which.string() + "': " + reason);
  };
  std::ifstream in(file, std::ios::binary);
  Header header = readHeader(in, '=', "ElementDataFile");
  const std::string data = header["ElementDataFile"];
  if (data.empty()) fail(file, "its header names no ElementDataFile");
  const bool local = data == "LOCAL" || data == "Local" || data == "local";
  if (!local && (data.find('%') != std::string::npos || data == "LIST")) return;  // several files
  const auto dataFile = local ? file : file.parent_path() / data;
  std::error_code error;
  auto have = std::filesystem::file_size(dataFile, error);
  if (error) fail(file, "its data file '" + dataFile.string() + "' cannot be read");
  if (local) have -= std::uintmax_t(in.tellg());
  const int bytes = metaTypeBytes(header["ElementType"]);
  if (header["CompressedData"] == "True" || bytes == 0) return;
  double need = bytes;
  std::istringstream shape(header["DimSize"]);
  for (double extent; shape >> extent;) need *= extent;
  std::istringstream channelText(header["ElementNumberOfChannels"]);
  if (double channels; channelText >> channels) need *= channels;
  if (double(have) < need)
    fail(dataFile, "has " + std::to_string(have) + " bytes of data, the header of '" +
                       file.filename().string() + "' promises " +
                       std::to_string(std::uintmax_t(need)));
}

std::optional<NrrdAxes> unnamedNrrdAxes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  Header header = readHeader(in, ':', "");
  if (header.count("kinds") || header["dimension"] != "3") return std::nullopt;
  NrrdAxes axes;
  std::istringstream sizes(header["sizes"]);
  for (int& size : axes.sizes)
    if (!(sizes >> size) || size < 1)
      throw std::runtime_error("'" + file.string() + "': sizes '" + header["sizes"] +
                               "' are not three extents");
  std::istringstream spacings(header["spacings"]);
  for (double& spacing : axes.spacing)
    if (double value; spacings >> value && value > 0.0) spacing = value;
  // "(0.5,0,0) (0,1.5,0) (0,0,2.5)": the length of each vector.
  std::istringstream directions(header["space directions"]);
  std::string vector;
  for (double& spacing : axes.spacing) {
    if (!(directions >> vector)) break;
    double x = 0.0, y = 0.0, z = 0.0;
    char mark;
    std::istringstream numbers(vector);
    if (numbers >> mark >> x >> mark >> y >> mark >> z)
      if (const double length = std::hypot(x, y, z); length > 0.0) spacing = length;
  }
  return axes;
}

}  // namespace minisim
