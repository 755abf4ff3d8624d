// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <memory>
#include <vector>

#include "explorer/volume/volume_pass.h"
#include "proxy/gl/device.h"

namespace vestige {

inline constexpr ImageSize kSize{48, 36};
inline gl::Device& device() {
  static const std::shared_ptr<gl::Device> device = gl::Device::create();
  return *device;
}

using Field = std::function<double(glm::dvec3 world)>;

/// A grid over a box.
inline glm::dmat4 over(const Box& box) {
  return glm::scale(glm::translate(glm::dmat4(1.0), box.low), box.size());
}

/// Calls with the index and the centre in world space of each cell.
template <typename Cell>
void forEachCell(glm::ivec3 size, const glm::dmat4& worldFromGrid, const Cell& cell) {
  std::size_t index = 0;
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x) {
        const glm::dvec3 grid = (glm::dvec3(x, y, z) + 0.5) / glm::dvec3(size);
        cell(index++, glm::dvec3(worldFromGrid * glm::dvec4(grid, 1.0)));
      }
    }
  }
}

inline LookGrid scalarGrid(glm::ivec3 size, const glm::dmat4& worldFromGrid, const Field& field) {
  std::vector<float> values(std::size_t(size.x * size.y * size.z));
  forEachCell(size, worldFromGrid,
              [&](std::size_t i, glm::dvec3 at) { values[i] = float(field(at)); });
  return LookGrid::scalar(size, worldFromGrid, values);
}

inline Camera cameraOf(const Box& box, glm::dvec3 forward, Projection projection,
                       glm::dvec3 up = {0, 0, 1}) {
  return frameBox(box, forward, up, kSize.aspect(), projection, 0.6);
}

/// Casts every ray: probes have a test of their own.
inline VolumeView draw(VolumePass& pass, const LookGrid& grid, VolumeSetup setup) {
  setup.size = kSize;
  setup.tolerance = 0.0;
  return pass.render(grid, setup);
}

inline const Box kBox{{-1.0, -0.7, 2.0}, {1.2, 0.9, 3.0}};

}  // namespace vestige
