// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <string>

#include "explorer/picture/picture.h"

namespace vestige {

/// The font file that annotations use: the environment's VESTIGE_FONT, else DejaVu Sans where
/// Debian and other systems put it. Throws NotFound naming the places that were tried.
std::filesystem::path findFont();

/// Letters of one pixel height, by FreeType. UTF-8. Not thread-safe.
class Font {
 public:
  /// Throws NotFound or Format with the file.
  explicit Font(int pixelHeight);
  ~Font();

  double width(const std::string& text) const;
  /// The height of a digit above the baseline.
  double digitHeight() const;
  /// Draws onto `picture` with the baseline starting at `origin`, in linear RGB.
  void draw(Picture& picture, glm::dvec2 origin, const std::string& text,
            glm::dvec3 colorLinear) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vestige
