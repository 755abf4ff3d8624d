// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/export/camera_info.h"

#include <nlohmann/json.hpp>

namespace vestige {

using nlohmann::json;

json cameraInfo(const Camera& camera) {
  const auto vector = [](glm::dvec3 v) { return json{v.x, v.y, v.z}; };
  json info{{"projection", camera.projection == Projection::Orthographic  ? "orthographic"
                           : camera.projection == Projection::Perspective ? "perspective"
                                                                          : "multi-perspective"},
            {"position", vector(camera.position)},
            {"forward", vector(camera.forward)},
            {"up", vector(camera.up)}};
  if (camera.projection == Projection::Perspective) {
    info["fieldOfViewRadians"] = camera.fieldOfView;
  } else {
    info["viewHeight"] = camera.viewHeight;
  }
  if (camera.projection == Projection::MultiPerspective) info["convergence"] = camera.convergence;
  return info;
}

}  // namespace vestige
