// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/run/vtk_xml_writer.h"

#include <fmt/format.h>

#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>

#include "proxy/base/error.h"

namespace vestige {
namespace {

/// A file that throws.
class File {
 public:
  explicit File(const std::filesystem::path& path)
      : path_(path), file_(std::fopen(path.c_str(), "wb"), &std::fclose) {
    if (!file_) fail();
  }
  void write(const void* data, std::size_t bytes) {
    if (std::fwrite(data, 1, bytes, file_.get()) != bytes) fail();
  }
  void write(const std::string& text) { write(text.data(), text.size()); }
  void close() {
    if (std::fclose(file_.release()) != 0) fail();
  }

 private:
  [[noreturn]] void fail() const {
    const int reason = errno;
    const bool full = reason == ENOSPC || reason == EDQUOT || reason == EFBIG;
    throw Error(full ? ErrorCode::NoSpace : ErrorCode::Io,
                fmt::format("cannot write '{}': {}", path_.string(), std::strerror(reason)));
  }

  std::filesystem::path path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
};

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

/// The appended arrays: elements in the header as they are announced, bytes at the end.
class Appended {
 public:
  std::string announce(const std::string& type, const std::string& name, std::size_t components,
                       std::uint64_t bytes, std::function<void(File&)> write) {
    const auto element = fmt::format(
        "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" "
        "format=\"appended\" offset=\"{}\"/>\n",
        type, escaped(name), components, offset_);
    offset_ += sizeof(std::uint64_t) + bytes;
    parts_.push_back({bytes, std::move(write)});
    return element;
  }
  void write(File& file) const {
    for (const auto& [bytes, write] : parts_) {
      file.write(&bytes, sizeof bytes);
      write(file);
    }
  }

 private:
  std::uint64_t offset_ = 0;
  std::vector<std::pair<std::uint64_t, std::function<void(File&)>>> parts_;
};

/// Row by row, so that whatever the strides no more than a row is copied.
void writeField(File& file, const FieldView& field) {
  const auto [nx, ny, nz] = field.size;
  const auto width = sizeOf(field.type), count = field.components.size();
  std::vector<std::byte> row(std::size_t(nx) * count * width);
  for (int z = 0; z < nz; ++z) {
    for (int y = 0; y < ny; ++y) {
      std::byte* to = row.data();
      for (int x = 0; x < nx; ++x) {
        const auto offset = x * field.strides[0] + y * field.strides[1] + z * field.strides[2];
        for (const auto* component : field.components) {
          std::memcpy(to, component + offset, width);
          to += width;
        }
      }
      file.write(row.data(), row.size());
    }
  }
}

void writeMask(File& file, const MaskView& mask, const std::array<int, 3>& size) {
  std::vector<std::uint8_t> row(static_cast<std::size_t>(size[0]));
  for (int z = 0; z < size[2]; ++z) {
    for (int y = 0; y < size[1]; ++y) {
      const auto* from = mask.data + y * mask.strides[1] + z * mask.strides[2];
      for (int x = 0; x < size[0]; ++x) {
        const auto value = std::to_integer<std::uint8_t>(from[x * mask.strides[0]]);
        row[std::size_t(x)] = (value & mask.bits) != 0 ? 1 : 0;
      }
      file.write(row.data(), row.size());
    }
  }
}

std::string dataElements(const Block& block, Location location, Appended& appended) {
  const auto size = block.samples(location);
  const auto samples = std::uint64_t(size[0]) * std::uint64_t(size[1]) * std::uint64_t(size[2]);
  const std::string element = location == Location::Point ? "PointData" : "CellData";
  std::string text = "<" + element + ">\n";
  for (const auto& field : block.fields) {
    if (field.location != location) continue;
    const auto count = field.components.size();
    text += appended.announce(nameOf(field.type), field.name, count,
                              samples * count * sizeOf(field.type),
                              [&field](File& file) { writeField(file, field); });
  }
  if (const auto& mask = block.masks[std::size_t(location)]) {
    text += appended.announce("UInt8", "vestige:mask", 1, samples,
                              [&mask, size](File& file) { writeMask(file, *mask, size); });
  }
  return text + "</" + element + ">\n";
}

}  // namespace

void writeVtkXml(const std::filesystem::path& path, const Block& block) {
  const auto& grid = block.grid;
  const bool rectilinear = grid.axes[0] || grid.axes[1] || grid.axes[2];
  const std::string type = rectilinear ? "RectilinearGrid" : "ImageData";
  std::string extent;
  for (std::size_t a = 0; a < 3; ++a) {
    extent += fmt::format("{}{} {}", a ? " " : "", grid.first[a],
                          std::int64_t(grid.first[a]) + grid.points[a] - 1);
  }
  Appended appended;
  std::string text = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"{}\" version=\"1.0\" byte_order=\"{}\" "
      "header_type=\"UInt64\">\n",
      type, std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian");
  text += fmt::format("<{} WholeExtent=\"{}\"", type, extent);
  if (!rectilinear) {
    text += fmt::format(" Origin=\"{:.17g} {:.17g} {:.17g}\" Spacing=\"{:.17g} {:.17g} {:.17g}\"",
                        grid.origin[0], grid.origin[1], grid.origin[2], grid.spacing[0],
                        grid.spacing[1], grid.spacing[2]);
  }
  text += fmt::format(">\n<Piece Extent=\"{}\">\n", extent);
  text += dataElements(block, Location::Point, appended);
  text += dataElements(block, Location::Cell, appended);
  if (rectilinear) {
    text += "<Coordinates>\n";
    for (std::size_t a = 0; a < 3; ++a) {
      const auto& points = block.points[a];
      const auto bytes = points.size() * sizeof(double);
      text += appended.announce("Float64", std::string(1, "xyz"[a]), 1, bytes,
                                [&points, bytes](File& file) { file.write(points.data(), bytes); });
    }
    text += "</Coordinates>\n";
  }
  text += fmt::format("</Piece>\n</{}>\n<AppendedData encoding=\"raw\">\n_", type);

  File file(path);
  file.write(text);
  appended.write(file);
  file.write("\n</AppendedData>\n</VTKFile>\n");
  file.close();
}

}  // namespace vestige
