// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/volume/grid_axes.h"

#include <algorithm>
#include <cmath>
#include <glm/vec4.hpp>

namespace vestige {
namespace {

constexpr int kMostGuesses = 4096;

}  // namespace

GridAxes::GridAxes(std::array<std::vector<double>, 3> places) : nodes(std::move(places)) {
  int width = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto& at = nodes[std::size_t(axis)];
    if (at.empty()) continue;
    const int count = int(at.size());
    double least = HUGE_VAL;
    for (int i = 1; i < count; ++i)
      least = std::min(least, at[std::size_t(i)] - at[std::size_t(i) - 1]);
    finest[axis] = least;
    lastNode[axis] = count - 1;
    guesses[axis] = int(std::clamp(std::ceil(count / least), 1.0, double(kMostGuesses)));
    guessesPerCell[axis] = float(double(guesses[axis]) / count);
    width = std::max({width, count, guesses[axis]});
  }
  if (width == 0) return;
  std::vector<glm::vec4> texels(9 * std::size_t(width), glm::vec4(0.0f));
  for (int axis = 0; axis < 3; ++axis) {
    const auto& at = nodes[std::size_t(axis)];
    if (at.empty()) continue;
    const int count = int(at.size());
    const auto widthOf = [&](int i) {
      const auto k = std::size_t(std::clamp(i, 0, count - 2));
      return at[k + 1] - at[k];
    };
    glm::vec4* row = texels.data() + std::size_t(3 * axis) * std::size_t(width);
    for (int i = 0; i + 1 < count; ++i) {
      const auto k = std::size_t(i);
      row[k] = {float(at[k]), float(1.0 / widthOf(i)), float(at[k + 1]), 0.0f};
      row[std::size_t(width) + k] = {float(widthOf(i - 1)), float(widthOf(i)),
                                     float(widthOf(i + 1)), 0.0f};
    }
    int node = 0;
    for (int i = 0; i < guesses[axis]; ++i) {
      const double place = double(i) * count / guesses[axis];
      while (node < count - 2 && at[std::size_t(node) + 1] <= place) ++node;
      row[std::size_t(2 * width + i)].x = float(node);
    }
  }
  table = gpu::texture2D(GL_RGBA32F, {width, 9}, GL_RGBA, GL_FLOAT, texels.data());
}

void GridAxes::define(std::vector<std::pair<std::string, std::string>>& defines) const {
  constexpr std::array<const char*, 3> kNames{"AXIS_X", "AXIS_Y", "AXIS_Z"};
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (!nodes[axis].empty()) defines.emplace_back(kNames[axis], "1");
  if (table) defines.emplace_back("UNEVEN", "1");
}

void GridAxes::bind(const gl::Program& program, int unit) const {
  if (!table) return;
  const gl::Functions& gl = gl::functions();
  gpu::bindSampler(program, "axes", unit, *table);
  gl.Uniform3f(program.uniform("guessesPerCell"), guessesPerCell.x, guessesPerCell.y,
               guessesPerCell.z);
  gl.Uniform3i(program.uniform("guesses"), guesses.x, guesses.y, guesses.z);
  gl.Uniform3i(program.uniform("lastNode"), lastNode.x, lastNode.y, lastNode.z);
}

}  // namespace vestige
