// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "explorer/picture/picture.h"
#include "proxy/gl/objects.h"
#include "proxy/gl/program.h"

namespace vestige {

/// What the explorer's passes share. Rows are uploaded and read from the top, so gl_FragCoord.xy is
/// the pixel position of method §1 and no pass turns pictures over. Everything here runs inside
/// Device::run and keeps to OpenGL ES 3.0, so that WebGL2 can do the same.
namespace gpu {

/// Immutable, unfiltered, clamped. `data` may be null.
gl::Texture texture2D(GLenum internalFormat, ImageSize size, GLenum format, GLenum type,
                      const void* data);
gl::Texture textureArray(GLenum internalFormat, ImageSize size, int layers);
void uploadLayer(const gl::Texture& array, ImageSize size, int layer, GLenum format, GLenum type,
                 const void* data);
/// A list of integers folded into rows of 2^kListWidthLog2 texels.
inline constexpr int kListWidthLog2 = 13;
gl::Texture listTexture(std::span<const std::uint32_t> values);

/// A program of an embedded vertex and fragment shader.
gl::Program program(std::string_view vertex, std::string_view fragment,
                    const std::vector<std::pair<std::string, std::string>>& defines = {});

/// Binds the framebuffer with these colour attachments (texture, layer; layer < 0 for a 2-D
/// texture) and the viewport of `size`; throws Gl when it is incomplete.
struct Attachment {
  const gl::Texture* texture;
  int layer = -1;
};
void bindTarget(const gl::Framebuffer& framebuffer, std::span<const Attachment> colors,
                ImageSize size, const gl::Texture* depth = nullptr);
/// Reads colour attachment 0 of the bound framebuffer as float RGBA.
std::vector<float> readFloats(ImageSize size, int attachment = 0);
/// One triangle that covers the viewport (fullscreen.vert).
void drawFullscreen(const gl::VertexArray& empty);
/// Sets a sampler uniform and binds its texture.
void bindSampler(const gl::Program& program, const char* name, int unit,
                 const gl::Texture& texture);

}  // namespace gpu
}  // namespace vestige
