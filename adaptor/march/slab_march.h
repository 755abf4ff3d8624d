// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>

#include "adaptor/compositing/slab_rays.h"
#include "adaptor/march/march_pass.h"

namespace vestige {

/// Marches a block slab by slab (march.glsl, SLAB); one slab of rays is held at a time. On the
/// device's thread only.
class SlabMarch {
 public:
  struct Times {
    double march = 0.0, readBack = 0.0;
  };
  /// `depths`: planar, rising, one more than slabs. Of the request, camera, size, partition, domain
  /// and stepLength count.
  void march(const BlockVolume& volume, const MarchRequest& request, std::span<const double> depths,
             const TakeSlab& take, Times& times);

 private:
  struct Passes;
  const gl::Program& program(const MarchRequest& request, const MarchSetup& setup,
                             const BlockVolume& volume, bool empty, bool direct);
  SlabRays readSlab(const Passes& passes, const MarchRequest& request, glm::vec2 slab,
                    Times& times);

  std::map<std::string, gl::Program> programs_;
  std::optional<gl::Buffer> planes_;
};

}  // namespace vestige
