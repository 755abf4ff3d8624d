// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>

#include "adaptor/compositing/layer_gather.h"
#include "adaptor/compositing/march_types.h"
#include "adaptor/compositing/slab_rays.h"
#include "proxy/gl/device.h"

namespace vestige {

/// Marches rays through one block on the GL device; one pass feeds every proxy of a MarchRequest,
/// split analytically at interval boundaries. Programs and buffers are kept between calls.
class Marcher {
 public:
  explicit Marcher(std::shared_ptr<gl::Device> device);
  ~Marcher();

  /// Uploads a block, slab by slab, replacing the one before; `threads` look for what a march can
  /// skip. Throws Gl when it does not fit.
  void upload(const BlockGrid& grid, const FillSlab& fill, int threads = 1);
  /// Marches the uploaded block. Throws Gl or InvalidArgument.
  RayImage march(const MarchRequest& request);
  /// Marches it once more for layers, or for what it puts in a light's way; InvalidArgument for a
  /// multi-perspective camera.
  LayerRays marchLayers(const MarchRequest& request, const LayerRequest& layers);
  void marchLight(const MarchRequest& request, LightDepth& light);
  /// Marches it slab by slab for sliced opacity lengths; `take` runs on the device's thread. Of the
  /// request, camera, size, partition, domain and stepLength count. `depths` are planar and rise.
  void marchSlabs(const MarchRequest& request, std::span<const double> depths,
                  const TakeSlab& take);

  const MarchTimes& times() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vestige
