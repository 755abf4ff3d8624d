// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "adaptor/compositing/march_types.h"
#include "proxy/camera/box.h"

namespace vestige::test {

/// A scalar field on a uniform or rectilinear grid of points, x fastest; its domain reaches from
/// the first sample to the last.
struct Scene {
  std::string name;
  std::array<int, 3> size{};
  glm::dvec3 origin{0.0}, spacing{1.0};
  /// Per axis: where its points stand, increasing; empty = evenly, by origin and spacing.
  std::array<std::vector<double>, 3> nodes{};
  std::vector<float> values;
  double low = 0.0, high = 1.0;  ///< what its partitions span
  int nativeBytes = 4;           ///< of a sample in the data's own type

  Box domain() const;
  BlockGrid block() const;
  double minimumSpacing() const;
  float at(int x, int y, int z) const {
    return values[(std::size_t(z) * std::size_t(size[1]) + std::size_t(y)) * std::size_t(size[0]) +
                  std::size_t(x)];
  }
  /// Trilinear, clamped to the outermost samples; of samples that are not NaN, which weigh by their
  /// shares; NaN where the nearest one is (method §1).
  double sample(glm::dvec3 world) const;
  /// World-space gradient: differences between the points one grid point before and one after, on
  /// the trilinear field; at the border, to the outermost one, beside NaN, to the place itself
  /// (method §1).
  glm::dvec3 gradient(glm::dvec3 world) const;
};

/// A field from a formula on n^3 points over a box.
Scene makeScene(std::string name, int n, const Box& box,
                const std::function<double(glm::dvec3)>& formula);

/// The scenes of method §10: "smooth", "turbulent", "blob" with n points a side, "plume" (the mini
/// simulation, developed, n cells a side), "plume-vorticity" (there and then), "ct" (the CT head as
/// it is; n is ignored). Slow ones are kept in `cache` (made if need be). Throws NotFound when the
/// CT head has not been fetched (scripts/fetch-ct-head), InvalidArgument for any other name.
Scene namedScene(const std::string& name, int n, const std::filesystem::path& cache);

/// Where benches and slow tests keep scenes: $VESTIGE_SCENES or build/scenes in the source tree.
std::filesystem::path sceneCache();
/// The CT head's header file as scripts/fetch-ct-head leaves it, or empty.
std::filesystem::path ctHeadPath();

}  // namespace vestige::test
