// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "proxy/camera/camera.h"
#include "proxy/transfer/transfer_function.h"
#include "tests/support/scenes.h"

namespace vestige::test {

/// What vtk_side.py is to draw: the scene's samples, raw floats in the file `volume`, in square
/// pictures of `pixels` a side. Colours ("colors": [value, r, g, b]) are the caller's to add.
inline nlohmann::json vtkScene(const Scene& scene, const std::filesystem::path& volume,
                               const Camera& camera, int pixels,
                               std::span<const OpacityPoint> opacity, double referenceLength) {
  const auto vec = [](glm::dvec3 v) { return std::vector<double>{v.x, v.y, v.z}; };
  nlohmann::json json{{"volume", volume.string()},
                      {"size", scene.size},
                      {"spacing", vec(scene.spacing)},
                      {"origin", vec(scene.origin)},
                      {"image", {pixels, pixels}},
                      {"referenceLength", referenceLength},
                      {"threads", 2},
                      {"camera",
                       {{"position", vec(camera.position)},
                        {"forward", vec(camera.forward)},
                        {"up", vec(camera.up)},
                        {"viewHeight", camera.viewHeight},
                        {"nearDepth", camera.nearDepth},
                        {"farDepth", camera.farDepth}}}};
  for (const OpacityPoint& p : opacity) json["opacity"].push_back({p.value, p.opacity});
  return json;
}

}  // namespace vestige::test
