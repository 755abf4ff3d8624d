// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <optional>

#include "explorer/gpu/gpu.h"
#include "proxy/customization/customization.h"

namespace vestige {

/// A customisation over a box on the GPU: filtered RGBA16F volumes with texels on its nodes. Made,
/// used and destroyed in Device::run.
class CustomTextures {
 public:
  /// Throws Config naming a seed outside the box.
  CustomTextures(const Customization& customization, const Box& box);

  bool is(const Customization& customization, const Box& box) const {
    return customization == customization_ && box == box_;
  }
  const Customization& customization() const { return customization_; }
  /// World to texture coordinates.
  const glm::dmat4& textureFromWorld() const { return textureFromWorld_; }
  /// The least and greatest gamma of any place.
  glm::dvec2 gammas() const { return gammas_; }
  /// Where every gamma is 1 and there are no functions, the second volume is not needed.
  bool hasValues() const { return hasValues_; }
  const gl::Texture& optics() const { return optics_; }  ///< factor of extinction, shift of colour
  const gl::Texture& values() const { return values_; }  ///< gamma, shares of functions

 private:
  Customization customization_;
  Box box_;
  glm::dmat4 textureFromWorld_{1.0};
  glm::dvec2 gammas_{1.0};
  bool hasValues_ = false;
  gl::Texture optics_{GL_TEXTURE_3D}, values_{GL_TEXTURE_3D};
};

}  // namespace vestige
