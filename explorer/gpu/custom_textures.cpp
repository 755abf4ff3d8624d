// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/gpu/custom_textures.h"

#include <algorithm>

#include "proxy/base/error.h"

namespace vestige {
namespace {

CustomVolume volumeOf(const Customization& customization, const Box& box) {
  try {
    return customVolume(customization, box);
  } catch (const Error& error) {
    throw Error(ErrorCode::Config, std::string("look key 'customization': ") + error.what());
  }
}

void fill(const gl::Texture& texture, glm::ivec3 size, const std::vector<glm::vec4>& texels) {
  const gl::Functions& gl = gl::functions();
  texture.bind(0);
  for (const GLenum name : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    gl.TexParameteri(GL_TEXTURE_3D, name, GL_LINEAR);
  for (const GLenum name : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
    gl.TexParameteri(GL_TEXTURE_3D, name, GL_CLAMP_TO_EDGE);
  gl.TexStorage3D(GL_TEXTURE_3D, 1, GL_RGBA16F, size.x, size.y, size.z);
  gl.PixelStorei(GL_UNPACK_ALIGNMENT, 4);
  gl.TexSubImage3D(GL_TEXTURE_3D, 0, 0, 0, 0, size.x, size.y, size.z, GL_RGBA, GL_FLOAT,
                   texels.data());
  gl::checkErrors("uploading a customisation");
}

}  // namespace

CustomTextures::CustomTextures(const Customization& customization, const Box& box)
    : customization_(customization), box_(box) {
  const CustomVolume volume = volumeOf(customization, box);
  for (int axis = 0; axis < 3; ++axis) {
    // The first and the last texel have their middles on the faces.
    const double size = box.size()[axis], count = volume.nodes[axis];
    textureFromWorld_[axis][axis] = size > 0.0 ? (count - 1.0) / count / size : 0.0;
    textureFromWorld_[3][axis] = 0.5 / count - textureFromWorld_[axis][axis] * box.low[axis];
  }
  const auto [least, most] =
      std::minmax_element(volume.values.begin(), volume.values.end(),
                          [](const glm::vec4& a, const glm::vec4& b) { return a.x < b.x; });
  gammas_ = {least->x, most->x};
  hasValues_ = customization.hasGamma() || !customization.functions().empty();
  fill(optics_, volume.nodes, volume.optics);
  if (hasValues_) fill(values_, volume.nodes, volume.values);
}

}  // namespace vestige
