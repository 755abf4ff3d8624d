// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proxy/gl/functions.h"

namespace vestige::gl {

/// A linked program; made, used and destroyed inside Device::run. Throws Gl with the log, the
/// stage and the source line on failure.
class Program {
 public:
  struct Stage {
    GLenum type;
    std::string_view source;
  };
  /// `defines` are inserted after the #version line of every stage.
  Program(const std::vector<Stage>& stages,
          const std::vector<std::pair<std::string, std::string>>& defines = {});
  ~Program();
  Program(Program&& other) noexcept;
  Program& operator=(Program&& other) noexcept;

  GLuint id() const { return id_; }
  void use() const;
  /// -1 where the linker removed it, which GL ignores.
  GLint uniform(const char* name) const;

 private:
  GLuint id_ = 0;
};

}  // namespace vestige::gl
