// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/annotation/text.h"

#include <ft2build.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>
#include FT_FREETYPE_H

#include "proxy/base/error.h"

namespace vestige {
namespace {

/// The next code point of UTF-8 text; malformed bytes count as one replacement character each.
char32_t nextCodePoint(const std::string& text, std::size_t& at) {
  const auto byte = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
  };
  const unsigned lead = byte(at++);
  const int follow = lead < 0x80       ? 0
                     : lead >> 5 == 6  ? 1
                     : lead >> 4 == 14 ? 2
                     : lead >> 3 == 30 ? 3
                                       : -1;
  if (follow == 0) return lead;
  if (follow < 0) return 0xfffd;
  char32_t code = lead & (0x3fu >> follow);
  for (int i = 0; i < follow; ++i) {
    if (byte(at) >> 6 != 2) return 0xfffd;
    code = code << 6 | (byte(at++) & 0x3fu);
  }
  return code;
}

}  // namespace

std::filesystem::path findFont() {
  std::vector<std::filesystem::path> places;
  if (const char* chosen = std::getenv("VESTIGE_FONT"); chosen && *chosen) {
    places.emplace_back(chosen);
  } else {
    for (const char* folder : {"/usr/share/fonts/truetype/dejavu", "/usr/share/fonts/dejavu",
                               "/usr/share/fonts/dejavu-sans-fonts", "/usr/share/fonts/TTF",
                               "/usr/local/share/fonts", "/opt/homebrew/share/fonts"}) {
      places.push_back(std::filesystem::path(folder) / "DejaVuSans.ttf");
    }
  }
  std::string tried;
  for (const std::filesystem::path& place : places) {
    std::error_code error;
    if (std::filesystem::is_regular_file(place, error)) return place;
    tried += (tried.empty() ? "" : ", ") + place.string();
  }
  throw Error(ErrorCode::NotFound, "no font for annotations: tried " + tried +
                                       "; install fonts-dejavu-core or set VESTIGE_FONT");
}

struct Font::Impl {
  FT_Library library = nullptr;
  FT_Face face = nullptr;

  ~Impl() {
    if (face) FT_Done_Face(face);
    if (library) FT_Done_FreeType(library);
  }
};

Font::Font(int pixelHeight) : impl_(std::make_unique<Impl>()) {
  const std::filesystem::path path = findFont();
  if (FT_Init_FreeType(&impl_->library) != 0) {
    throw Error(ErrorCode::Internal, "FreeType does not start");
  }
  if (FT_New_Face(impl_->library, path.c_str(), 0, &impl_->face) != 0 ||
      FT_Set_Pixel_Sizes(impl_->face, 0, FT_UInt(std::clamp(pixelHeight, 4, 512))) != 0) {
    throw Error(ErrorCode::Format, path.string() + " is not a font that FreeType reads");
  }
}

Font::~Font() = default;

double Font::width(const std::string& text) const {
  double width = 0.0;
  for (std::size_t at = 0; at < text.size();) {
    if (FT_Load_Char(impl_->face, nextCodePoint(text, at), FT_LOAD_DEFAULT) == 0) {
      width += double(impl_->face->glyph->advance.x) / 64.0;
    }
  }
  return width;
}

double Font::digitHeight() const {
  if (FT_Load_Char(impl_->face, '0', FT_LOAD_DEFAULT) != 0) return 0.0;
  return double(impl_->face->glyph->metrics.horiBearingY) / 64.0;
}

void Font::draw(Picture& picture, glm::dvec2 origin, const std::string& text,
                glm::dvec3 colorLinear) const {
  double pen = origin.x;
  const int baseline = int(std::lround(origin.y));
  for (std::size_t at = 0; at < text.size();) {
    if (FT_Load_Char(impl_->face, nextCodePoint(text, at), FT_LOAD_RENDER) != 0) continue;
    const FT_GlyphSlot glyph = impl_->face->glyph;
    const int left = int(std::lround(pen)) + glyph->bitmap_left;
    const int top = baseline - glyph->bitmap_top;
    for (int row = 0; row < int(glyph->bitmap.rows); ++row) {
      for (int column = 0; column < int(glyph->bitmap.width); ++column) {
        const int x = left + column, y = top + row;
        if (x < 0 || y < 0 || x >= picture.size.width || y >= picture.size.height) continue;
        const float cover =
            float(glyph->bitmap.buffer[row * glyph->bitmap.pitch + column]) / 255.0f;
        float* pixel = picture.pixel(x, y);
        for (int c = 0; c < 3; ++c) {
          pixel[c] = pixel[c] * (1.0f - cover) + cover * float(colorLinear[c]);
        }
        pixel[3] = pixel[3] * (1.0f - cover) + cover;
      }
    }
    pen += double(glyph->advance.x) / 64.0;
  }
}

}  // namespace vestige
