// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "proxy/customization/customization.h"
#include "proxy/gl/device.h"
#include "proxy/customization/natural_neighbours.h"

namespace vestige {

/// naturalNeighbours in a compute shader; Voronoi cells are the CPU's. Counts are the same
/// integers, means the same sums in double precision: equal bit for bit where the device divides
/// doubles as IEEE 754 asks (Mesa's software rasteriser does), else to the last bit of a float. A
/// GPU that is there anyway leaves the solver's cores alone; a software rasteriser is slower than
/// the CPU's own. Throws as naturalNeighbours, and Gl.
std::vector<NodeValues> naturalNeighbours(gl::Device& device, glm::ivec3 nodes,
                                          std::span<const GridSeed> seeds,
                                          std::span<const NodeValues> rows, SeedMetric metric);

/// customVolume by the same shader. Throws as it, and Gl.
CustomVolume customVolume(gl::Device& device, const Customization& customization, const Box& box);

}  // namespace vestige
