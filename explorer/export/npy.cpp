// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/export/npy.h"

#include <bit>

namespace vestige {

std::string npyHeader(NpyType type, std::span<const std::size_t> shape) {
  static_assert(std::endian::native == std::endian::little);
  std::string sizes;
  for (std::size_t extent : shape) sizes += std::to_string(extent) + ",";
  std::string header = std::string("{'descr': '") + (type == NpyType::Float32 ? "<f4" : "<f8") +
                       "', 'fortran_order': False, 'shape': (" + sizes + "), }";
  // Magic, version and length take 10 bytes; data start at a multiple of 64.
  const std::size_t padded = (10 + header.size() + 1 + 63) / 64 * 64;
  header.resize(padded - 11, ' ');
  header += '\n';
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += char(header.size() & 0xff);
  bytes += char(header.size() >> 8);
  return bytes + header;
}

}  // namespace vestige
