// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace vestige::test {

/// The bytes of a scan-line EXR, taken apart so that a test can change any
/// claim in it and leave the rest consistent. Written independently of the
/// readers under test.
class ExrSurgeon {
 public:
  struct Attribute {
    std::string name, type, value;
  };
  using Header = std::vector<Attribute>;

  explicit ExrSurgeon(const std::string& bytes) : magic_(bytes.substr(0, 8)) {
    std::size_t at = 8;
    const auto text = [&] {
      std::string s(bytes.c_str() + at);
      at += s.size() + 1;
      return s;
    };
    multiPart_ = bytes[5] & 0x10;
    do {
      Header header;
      while (bytes[at] != 0) {
        Attribute a{text(), text(), {}};
        std::uint32_t size;
        std::memcpy(&size, bytes.data() + at, 4);
        a.value = bytes.substr(at + 4, size);
        at += 4 + size;
        header.push_back(std::move(a));
      }
      ++at;
      headers.push_back(std::move(header));
    } while (multiPart_ && bytes[at] != 0);
    headerEnd_ = multiPart_ ? ++at : at;
    std::uint64_t first;
    std::memcpy(&first, bytes.data() + at, 8);
    for (; at < first; at += 8) {
      offsets.emplace_back();
      std::memcpy(&offsets.back(), bytes.data() + at, 8);
    }
    chunks = bytes.substr(at);
  }

  std::vector<Header> headers;
  std::vector<std::uint64_t> offsets;  ///< of chunks, as in the file that was read
  std::string chunks;

  /// The value of an attribute of a part.
  std::string& value(const std::string& name, std::size_t part = 0) {
    for (Attribute& a : headers.at(part))
      if (a.name == name) return a.value;
    throw std::logic_error("the test's file has no attribute " + name);
  }
  /// Sets an attribute in all parts.
  void everywhere(const std::string& name, const std::string& bytes) {
    for (std::size_t part = 0; part < headers.size(); ++part) value(name, part) = bytes;
  }

  /// The file anew; offsets move along with the chunks.
  std::string bytes() const {
    std::string out = magic_;
    for (const Header& header : headers) {
      for (const Attribute& a : header)
        out += a.name + '\0' + a.type + '\0' + number(std::uint32_t(a.value.size())) + a.value;
      out += '\0';
    }
    if (multiPart_) out += '\0';
    const std::uint64_t moved = out.size() - headerEnd_;
    for (const std::uint64_t offset : offsets) out += number(offset + moved);
    return out + chunks;
  }

  /// Little-endian bytes of integers and floating-point numbers.
  template <typename... Numbers>
  static std::string number(Numbers... numbers) {
    std::string out;
    (out.append(reinterpret_cast<const char*>(&numbers), sizeof numbers), ...);
    return out;
  }

 private:
  std::string magic_;
  bool multiPart_ = false;
  std::size_t headerEnd_ = 0;
};

}  // namespace vestige::test
