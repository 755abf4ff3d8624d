// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/layout/field_layout.h"

#include <fmt/format.h>
#include <zfp.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>

#include "proxy/base/error.h"
#include "proxy/format/exr/exr_threads.h"

namespace vestige {
namespace {

/// zfp codes blocks of 4 x 4 x 4 by themselves, so slabs of four layers cost nothing and are coded
/// in parallel; their lengths stand before them, 4 bytes each, low byte first.
constexpr int kSlabLayers = 4;
constexpr std::size_t kLengthBytes = 4;
/// A reader refuses fields of more samples, and larger ones than so many bytes that are more than
/// kMostExpansion times their stream (a block of zeros takes a bit, kSlabLayers^3 samples).
constexpr std::size_t kMostCells = std::size_t(1) << 31;
constexpr std::size_t kLargeBytes = std::size_t(512) << 20;
constexpr std::size_t kMostExpansion = 2048;
/// In the file a byte is the half of that many 2^-24.
constexpr double kByteUnit = 0x1p24;
/// A block of zfp's takes no more than this.
constexpr std::size_t kMostBlockBytes = (ZFP_MAX_BITS + 7) / 8;

[[noreturn]] void damaged(const std::string& reason) {
  throw Error(ErrorCode::Format, "field: " + reason);
}

/// zfp's, of normalised samples.
double accuracyOf(const FieldGrid& grid) {
  return std::clamp(grid.tolerance / (grid.high - grid.low), 1e-30, 1.0);
}

int slabsOf(int layers) { return (layers + kSlabLayers - 1) / kSlabLayers; }

std::size_t blocksOf(int width, int height) {
  return std::size_t((width + 3) / 4) * std::size_t((height + 3) / 4);
}

struct ZfpStream {
  zfp_stream* zfp = zfp_stream_open(nullptr);
  zfp_field* field = nullptr;
  bitstream* bits = nullptr;

  /// A slab of floats and the buffer of its code.
  ZfpStream(const float* values, int nx, int ny, int nz, double accuracy, std::byte* buffer,
            std::size_t size) {
    field = zfp_field_3d(const_cast<float*>(values), zfp_type_float, std::size_t(nx),
                         std::size_t(ny), std::size_t(nz));
    zfp_stream_set_accuracy(zfp, accuracy);
    bits = stream_open(buffer, size);
    zfp_stream_set_bit_stream(zfp, bits);
    zfp_stream_rewind(zfp);
  }
  ~ZfpStream() {
    stream_close(bits);
    zfp_field_free(field);
    zfp_stream_close(zfp);
  }
  ZfpStream(const ZfpStream&) = delete;
  ZfpStream& operator=(const ZfpStream&) = delete;
};

/// Room for the code of a slab however bad it is, so that zfp, which does not look where its
/// stream ends, stays within.
std::size_t roomFor(int nx, int ny) { return blocksOf(nx, ny) * (kMostBlockBytes + 8) + 64; }

std::vector<std::byte> compressSlab(const float* values, int nx, int ny, int nz, double accuracy) {
  std::vector<std::byte> code(roomFor(nx, ny));
  const ZfpStream stream(values, nx, ny, nz, accuracy, code.data(), code.size());
  const std::size_t bytes = zfp_compress(stream.zfp, stream.field);
  if (bytes == 0) throw Error(ErrorCode::Internal, "zfp does not compress a slab of a field");
  code.resize(bytes);
  return code;
}

/// Whether the code is whole.
bool expandSlab(std::span<const std::byte> code, float* values, int nx, int ny, int nz,
                double accuracy) {
  std::vector<std::byte> room(roomFor(nx, ny) + code.size());
  std::copy(code.begin(), code.end(), room.begin());
  const ZfpStream stream(values, nx, ny, nz, accuracy, room.data(), room.size());
  const std::size_t read = zfp_decompress(stream.zfp, stream.field);
  return read > 0 && read <= (code.size() + 7) / 8 * 8;
}

/// Samples without data take the value before them along x, so that they cost little; bits tell
/// which they are. No bits at all: every sample has data.
std::vector<std::byte> fillGaps(std::vector<float>& values) {
  std::vector<std::byte> bits;
  float last = 0.5f;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i])) {
      last = values[i];
      continue;
    }
    if (bits.empty()) bits.resize((values.size() + 7) / 8);
    bits[i / 8] |= std::byte(1u << (i % 8));
    values[i] = last;
  }
  return bits;
}

ProxyPart bytePart(const char* name, std::span<const std::byte> bytes, ImageSize size) {
  ProxyPart part;
  part.name = name;
  part.unit = kByteUnit;
  Channel channel{"byte", ChannelStorage::Half, std::vector<float>(size.pixels())};
  for (std::size_t i = 0; i < bytes.size(); ++i) channel.values[i] = float(std::uint8_t(bytes[i]));
  part.channels.push_back(std::move(channel));
  return part;
}

std::vector<std::byte> bytesOf(const ProxyImage& image, const char* name, std::size_t count) {
  const Channel& channel = image.channel(name, "byte");
  if (count > channel.values.size())
    damaged(fmt::format("part '{}' should hold {} bytes, its picture has {} pixels", name, count,
                        channel.values.size()));
  std::vector<std::byte> bytes(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float value = channel.values[i];
    if (!(value >= 0.0f && value <= 255.0f) || value != std::floor(value))
      damaged(fmt::format("part '{}' has {} where a byte belongs", name, value));
    bytes[i] = std::byte(std::uint8_t(value));
  }
  return bytes;
}

void checkSamples(const FieldSamples& field) {
  const auto bad = [](const std::string& what) {
    throw Error(ErrorCode::InvalidArgument, "a field to be stored " + what);
  };
  std::size_t cells = 1;
  for (const FieldAxis& axis : field.axes) {
    if (axis.count < 1) bad(fmt::format("has {} samples along an axis", axis.count));
    cells *= std::size_t(axis.count);
  }
  if (cells > kMostCells) bad(fmt::format("has {} samples, more than {}", cells, kMostCells));
  if (field.values.size() != cells)
    bad(fmt::format("has {} values, its grid needs {}", field.values.size(), cells));
  if (!(field.low < field.high)) bad(fmt::format("has the range {} .. {}", field.low, field.high));
}

/// The axis of groups of `factor` samples.
FieldAxis reducedAxis(const FieldAxis& axis, int factor) {
  FieldAxis result;
  result.count = (axis.count + factor - 1) / factor;
  if (axis.nodes.empty()) {
    result.first = axis.first + 0.5 * (factor - 1) * axis.spacing;
    result.spacing = factor * axis.spacing;
    if (axis.count == 1) result.first = axis.first;
    return result;
  }
  for (int i = 0; i < result.count; ++i) {
    const int begin = i * factor, end = std::min(begin + factor, axis.count);
    double sum = 0.0;
    for (int j = begin; j < end; ++j) sum += axis.at(j);
    result.nodes.push_back(sum / (end - begin));
  }
  return result;
}

}  // namespace

FieldSamples reduced(FieldSamples field, int factor) {
  if (factor == 1) return field;
  FieldSamples result{{}, field.low, field.high, {}};
  std::array<int, 3> from{}, to{};
  for (std::size_t a = 0; a < 3; ++a) {
    result.axes[a] = reducedAxis(field.axes[a], factor);
    from[a] = field.axes[a].count;
    to[a] = result.axes[a].count;
  }
  result.values.resize(std::size_t(to[0]) * std::size_t(to[1]) * std::size_t(to[2]));
  // Even axes go on as they end; groups at the end of uneven ones are smaller.
  const auto source = [&](std::size_t axis, int i) {
    if (i < from[axis]) return i;
    return field.axes[axis].nodes.empty() ? from[axis] - 1 : -1;
  };
  forEachOnExrThreads(to[2], [&](int z) {
    for (int y = 0; y < to[1]; ++y) {
      for (int x = 0; x < to[0]; ++x) {
        double sum = 0.0;
        int have = 0, all = 0;
        for (int n = 0; n < factor * factor * factor; ++n) {
          const int i = source(0, x * factor + n % factor);
          const int j = source(1, y * factor + n / factor % factor);
          const int k = source(2, z * factor + n / (factor * factor));
          if (i < 0 || j < 0 || k < 0) continue;
          ++all;
          const float value =
              field.values[(std::size_t(k) * std::size_t(from[1]) + std::size_t(j)) *
                               std::size_t(from[0]) +
                           std::size_t(i)];
          if (!std::isfinite(value)) continue;
          sum += double(value);
          ++have;
        }
        result.values[(std::size_t(z) * std::size_t(to[1]) + std::size_t(y)) * std::size_t(to[0]) +
                      std::size_t(x)] = 2 * have >= all && have > 0
                                            ? float(sum / have)
                                            : std::numeric_limits<float>::quiet_NaN();
      }
    }
  });
  return result;
}

ProxyImage fieldImage(ProxyHeader header, FieldSamples field, const FieldReduction& reduction) {
  checkSamples(field);
  if (reduction.factor < 1 || reduction.factor > 16)
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("a field is reduced by 1 to 16, not by {}", reduction.factor));
  if (!(reduction.tolerance > 0.0) || !std::isfinite(reduction.tolerance))
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("the tolerance of a stored field is {}", reduction.tolerance));
  field = reduced(std::move(field), reduction.factor);
  const std::vector<std::byte> gaps = fillGaps(field.values);
  FieldGrid grid{field.axes, reduction.factor, field.low, field.high, reduction.tolerance, 0};
  const double accuracy = accuracyOf(grid);
  const int nx = grid.axes[0].count, ny = grid.axes[1].count, nz = grid.axes[2].count;
  std::vector<std::vector<std::byte>> slabs(std::size_t(slabsOf(nz)));
  forEachOnExrThreads(int(slabs.size()), [&](int s) {
    const int z = s * kSlabLayers;
    slabs[std::size_t(s)] =
        compressSlab(field.values.data() + std::size_t(nx) * std::size_t(ny) * std::size_t(z), nx,
                     ny, std::min(kSlabLayers, nz - z), accuracy);
  });
  std::vector<std::byte> stream;
  for (const auto& slab : slabs)
    for (std::size_t i = 0; i < kLengthBytes; ++i)
      stream.push_back(std::byte((slab.size() >> (8 * i)) & 0xff));
  for (const auto& slab : slabs) stream.insert(stream.end(), slab.begin(), slab.end());
  grid.bytes = stream.size();

  const std::size_t most = std::max(stream.size(), gaps.size());
  std::size_t width = 64;
  while (width * width < most) width *= 2;
  header.kind = kind::kField;
  header.view = kFieldView;
  header.size = {int(width), int((most + width - 1) / width)};
  header.grid = grid;
  ProxyImage image{std::move(header), {}};
  image.parts.push_back(bytePart("zfp", stream, image.header.size));
  image.parts.back().error = reduction.tolerance;
  if (!gaps.empty()) image.parts.push_back(bytePart("nodata", gaps, image.header.size));
  return image;
}

FieldSamples fieldSamples(const ProxyImage& image) {
  if (image.header.kind != kind::kField || !image.header.grid)
    damaged("the proxy is of kind '" + image.header.kind + "' or says nothing of a grid");
  const FieldGrid& grid = *image.header.grid;
  const int nx = grid.axes[0].count, ny = grid.axes[1].count, nz = grid.axes[2].count;
  const std::size_t cells = grid.cells();
  const std::size_t slabs = std::size_t(slabsOf(nz));
  if (cells > kMostCells || grid.bytes < slabs * kLengthBytes ||
      (cells * sizeof(float) > kLargeBytes && cells * sizeof(float) > kMostExpansion * grid.bytes))
    damaged(fmt::format("{} x {} x {} samples cannot come from {} bytes", nx, ny, nz, grid.bytes));
  // What zfp may read of a slab of a hostile stream.
  if (roomFor(nx, ny) > kLargeBytes)
    damaged(fmt::format("a layer of {} x {} samples is too large", nx, ny));
  const std::vector<std::byte> stream = bytesOf(image, "zfp", grid.bytes);
  std::vector<std::size_t> begin(slabs + 1, slabs * kLengthBytes);
  for (std::size_t s = 0; s < slabs; ++s) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < kLengthBytes; ++i)
      length |= std::size_t(stream[s * kLengthBytes + i]) << (8 * i);
    begin[s + 1] = begin[s] + length;
    if (begin[s + 1] > stream.size())
      damaged(fmt::format("slab {} of {} bytes passes the end of its stream", s, length));
  }
  FieldSamples field{grid.axes, grid.low, grid.high, std::vector<float>(cells)};
  const double accuracy = accuracyOf(grid);
  std::vector<char> whole(slabs, 0);
  forEachOnExrThreads(int(slabs), [&](int i) {
    const std::size_t s = std::size_t(i);
    const int z = i * kSlabLayers;
    whole[s] = expandSlab(std::span(stream).subspan(begin[s], begin[s + 1] - begin[s]),
                          field.values.data() + std::size_t(nx) * std::size_t(ny) * std::size_t(z),
                          nx, ny, std::min(kSlabLayers, nz - z), accuracy);
  });
  for (std::size_t s = 0; s < slabs; ++s)
    if (!whole[s]) damaged(fmt::format("slab {} does not decode", s));
  for (std::size_t i = 0; i < cells; ++i)
    if (!std::isfinite(field.values[i]))
      damaged(fmt::format("sample {} is {}", i, field.values[i]));
  if (image.find("nodata")) {
    const std::vector<std::byte> gaps = bytesOf(image, "nodata", (cells + 7) / 8);
    for (std::size_t i = 0; i < cells; ++i)
      if (std::uint8_t(gaps[i / 8]) >> (i % 8) & 1u)
        field.values[i] = std::numeric_limits<float>::quiet_NaN();
  }
  return field;
}

}  // namespace vestige
