// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

#include "adaptor/compositing/layer_gather.h"
#include "adaptor/march/march_pass.h"

namespace vestige {

/// Second marches of a block, for layers and for shadows. On the device's thread only.
class LayerMarch {
 public:
  LayerRays layers(const BlockVolume& volume, const MarchRequest& march,
                   const LayerRequest& request);
  /// Adds what the block puts in the light's way. `march` gives the medium, the step, the domain.
  void addLight(const BlockVolume& volume, const MarchRequest& march, LightDepth& light);

 private:
  const gl::Program& program(const MarchDefines& defines);

  std::map<std::string, gl::Program> programs_;
};

}  // namespace vestige
