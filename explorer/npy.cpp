// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/npy.h"

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>

#include "proxy/error.h"

namespace vestige {

std::vector<std::byte> encodeNpy(std::span<const float> values,
                                 std::span<const std::size_t> shape) {
  static_assert(std::endian::native == std::endian::little);
  std::size_t count = 1;
  std::string sizes;
  for (std::size_t extent : shape) {
    count *= extent;
    sizes += std::to_string(extent) + ",";
  }
  if (count != values.size()) {
    throw Error(ErrorCode::InvalidArgument, "an array of shape (" + sizes + ") does not hold " +
                                                std::to_string(values.size()) + " values");
  }
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (" + sizes + "), }";
  // Magic, version and length take 10 bytes; data start at a multiple of 64.
  const std::size_t padded = (10 + header.size() + 1 + 63) / 64 * 64;
  header.resize(padded - 11, ' ');
  header += '\n';
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += char(header.size() & 0xff);
  bytes += char(header.size() >> 8);
  bytes += header;
  std::vector<std::byte> file(bytes.size() + 4 * values.size());
  std::memcpy(file.data(), bytes.data(), bytes.size());
  if (!values.empty()) std::memcpy(file.data() + bytes.size(), values.data(), 4 * values.size());
  return file;
}

}  // namespace vestige
