// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/exr/png_file.h"

#include <png.h>

#include <cstring>

#include "proxy/base/durable_file.h"
#include "proxy/base/error.h"
#include "proxy/format/exr/exr_scan.h"

namespace vestige {
namespace {

constexpr int kLargestSide = 32768;

// libpng leaves by longjmp: nothing with a destructor may live in the frames between its calls and
// setjmp, so the message has a fixed place and every buffer belongs to the caller.
struct Failure {
  char reason[128] = "";
};

[[noreturn]] void onError(png_structp png, png_const_charp message) {
  auto& reason = static_cast<Failure*>(png_get_error_ptr(png))->reason;
  std::strncpy(reason, message, sizeof reason - 1);
  png_longjmp(png, 1);
}
void onWarning(png_structp, png_const_charp) {}

void appendBytes(png_structp png, png_bytep data, png_size_t size) {
  auto* out = static_cast<std::vector<std::byte>*>(png_get_io_ptr(png));
  auto* bytes = reinterpret_cast<const std::byte*>(data);
  bool full = false;
  try {
    out->insert(out->end(), bytes, bytes + size);
  } catch (const std::exception&) {
    full = true;
  }
  if (full) png_error(png, "out of memory");
}
void flushNothing(png_structp) {}

struct PngCursor {
  const std::byte* at;
  std::size_t left;
};
void takeBytes(png_structp png, png_bytep out, png_size_t size) {
  auto* cursor = static_cast<PngCursor*>(png_get_io_ptr(png));
  if (size > cursor->left) png_error(png, "the file ends too early");
  std::memcpy(out, cursor->at, size);
  cursor->at += size;
  cursor->left -= size;
}

bool opaque(const Raster& raster) {
  for (std::size_t i = 3; i < raster.rgba.size(); i += 4)
    if (raster.rgba[i] != 255) return false;
  return true;
}

bool encodeRows(png_structp png, png_infop info, const Raster& raster, bool rgb,
                std::vector<std::byte>& out) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_write_fn(png, &out, appendBytes, flushNothing);
  png_set_compression_level(png, 2);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_IHDR(png, info, png_uint_32(raster.size.width), png_uint_32(raster.size.height), 8,
               rgb ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_RGBA, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_write_info(png, info);
  if (rgb) png_set_filler(png, 0, PNG_FILLER_AFTER);
  const std::size_t stride = std::size_t(raster.size.width) * 4;
  for (int y = 0; y < raster.size.height; ++y)
    png_write_row(png, raster.rgba.data() + std::size_t(y) * stride);
  png_write_end(png, info);
  return true;
}

bool decodeHeader(png_structp png, png_infop info, PngCursor& cursor, ImageSize& size,
                  std::size_t& rowBytes) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_read_fn(png, &cursor, takeBytes);
  png_set_user_limits(png, kLargestSide, kLargestSide);
  png_set_chunk_malloc_max(png, 16 << 20);
  png_read_info(png, info);
  size = {int(png_get_image_width(png, info)), int(png_get_image_height(png, info))};
  rowBytes = png_get_rowbytes(png, info);
  return true;
}

bool decodeRows(png_structp png, png_infop info, const std::vector<png_bytep>& rows) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_expand(png);
  png_set_scale_16(png);
  png_set_gray_to_rgb(png);
  png_set_add_alpha(png, 255, PNG_FILLER_AFTER);
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  png_read_image(png, const_cast<png_bytepp>(rows.data()));
  png_read_end(png, nullptr);
  return true;
}

struct Writer {
  Failure failure;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &failure, onError, onWarning);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  ~Writer() { png_destroy_write_struct(&png, &info); }
};
struct Reader {
  Failure failure;
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &failure, onError, onWarning);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
};

[[noreturn]] void notAPng(const std::filesystem::path& path, const std::string& reason) {
  throw Error(ErrorCode::Format, "'" + path.string() + "' is not a readable PNG: " + reason);
}

}  // namespace

std::vector<std::byte> encodePng(const Raster& raster) {
  const ImageSize size = raster.size;
  if (size.width < 1 || size.height < 1 || size.width > kLargestSide ||
      size.height > kLargestSide || raster.rgba.size() != size.pixels() * 4)
    throw Error(ErrorCode::InvalidArgument, "a picture of " + std::to_string(size.width) + " x " +
                                                std::to_string(size.height) + " pixels with " +
                                                std::to_string(raster.rgba.size()) +
                                                " bytes cannot be a PNG");
  std::vector<std::byte> out;
  Writer writer;
  if (!writer.info) throw Error(ErrorCode::Internal, "libpng cannot start to write");
  if (!encodeRows(writer.png, writer.info, raster, opaque(raster), out))
    throw Error(ErrorCode::Internal, "libpng cannot write: " + std::string(writer.failure.reason));
  return out;
}

Raster readPng(const std::filesystem::path& path) {
  std::vector<std::byte> bytes = readBytes(path);
  if (bytes.size() < 8 || png_sig_cmp(reinterpret_cast<png_const_bytep>(bytes.data()), 0, 8) != 0)
    notAPng(path, "it does not begin like one");
  Reader reader;
  if (!reader.info) throw Error(ErrorCode::Internal, "libpng cannot start to read");
  PngCursor cursor{bytes.data(), bytes.size()};
  Raster raster;
  std::size_t rowBytes = 0;
  if (!decodeHeader(reader.png, reader.info, cursor, raster.size, rowBytes))
    notAPng(path, reader.failure.reason);
  // In RGBA a grey or 1-bit picture takes up to 32 times what it was deflated from.
  if (std::uint64_t(rowBytes) * std::uint64_t(raster.size.height) >
          ExrLimits::kDeflateRatio * bytes.size() ||
      !pictureFitsFile(raster.size.pixels() * 2, bytes.size()))
    notAPng(path, "it claims " + std::to_string(raster.size.width) + " x " +
                      std::to_string(raster.size.height) + " pixels, more than its " +
                      std::to_string(bytes.size()) + " bytes can hold");
  raster.rgba.resize(raster.size.pixels() * 4);
  std::vector<png_bytep> rows(std::size_t(raster.size.height));
  for (std::size_t y = 0; y < rows.size(); ++y)
    rows[y] = raster.rgba.data() + y * std::size_t(raster.size.width) * 4;
  if (!decodeRows(reader.png, reader.info, rows)) notAPng(path, reader.failure.reason);
  return raster;
}

void writePng(const std::filesystem::path& path, const Raster& raster) {
  writeDurably(path, encodePng(raster));
}

}  // namespace vestige
