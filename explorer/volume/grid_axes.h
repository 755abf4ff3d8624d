// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "explorer/gpu/gpu.h"

namespace vestige {

/// Where the samples of a grid stand along axes on which they are not evenly spaced. A place along
/// an axis is in cells of equal width, [0, count] over the grid; evenly spaced samples would be at
/// i + 1/2. Made, used and destroyed in Device::run.
struct GridAxes {
  std::array<std::vector<double>, 3> nodes;  ///< rising places of the samples; empty: even
  glm::dvec3 finest{1.0};                    ///< least distance of two samples
  std::optional<gl::Texture> table;          ///< RGBA32F as axes.glsl wants it; none: all are even
  glm::vec3 guessesPerCell{1.0f};
  glm::ivec3 guesses{1}, lastNode{1};

  GridAxes() = default;
  /// Of two and more samples an axis, or none.
  explicit GridAxes(std::array<std::vector<double>, 3> nodes);

  /// The defines and uniforms of axes.glsl.
  void define(std::vector<std::pair<std::string, std::string>>& defines) const;
  void bind(const gl::Program& program, int unit) const;
};

}  // namespace vestige
