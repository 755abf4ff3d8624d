// SPDX-License-Identifier: BSD-3-Clause
#include "tests/adaptor/march/march_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "adaptor/compositing/ray_sorter.h"

namespace vestige {
namespace {

using Part = ScenePart;

void uploadPart(Marcher& marcher, const Scene& scene, const MarchRequest& request,
                const Part& part) {
  const BlockGrid grid = part.gridIn(scene);
  const auto size = grid.size();
  marcher.upload(grid, [&](int z0, int z1, float* out) {
    for (int z = z0; z < z1; ++z) {
      for (int y = 0; y < size[1]; ++y) {
        for (int x = 0; x < size[0]; ++x) {
          const glm::dvec3 world{grid.nodes[0][std::size_t(x)], grid.nodes[1][std::size_t(y)],
                                 grid.nodes[2][std::size_t(z)]};
          *out++ = float(request.partition.normalised(scene.field(world)));
        }
      }
    }
  });
}

RayImage marchPart(Marcher& marcher, const Scene& scene, const MarchRequest& request,
                   const Part& part) {
  uploadPart(marcher, scene, request, part);
  return marcher.march(request);
}

}  // namespace

BlockGrid ScenePart::gridIn(const Scene& scene) const {
  BlockGrid grid;
  grid.owned = owned;
  for (int axis = 0; axis < 3; ++axis) {
    const auto& nodes = scene.nodes[std::size_t(axis)];
    grid.nodes[std::size_t(axis)].assign(nodes.begin() + begin[axis],
                                         nodes.begin() + end[axis] + 1);
  }
  return grid;
}

std::vector<Part> partsOf(const Scene& scene, const Camera& camera, const Cuts& cuts, int ghosts) {
  std::vector<Box> boxes;
  std::vector<Part> parts, ordered;
  for (std::size_t k = 0; k + 1 < cuts[2].size(); ++k) {
    for (std::size_t j = 0; j + 1 < cuts[1].size(); ++j) {
      for (std::size_t i = 0; i + 1 < cuts[0].size(); ++i) {
        const glm::ivec3 low{cuts[0][i], cuts[1][j], cuts[2][k]};
        const glm::ivec3 high{cuts[0][i + 1], cuts[1][j + 1], cuts[2][k + 1]};
        Part part;
        for (int axis = 0; axis < 3; ++axis) {
          const auto& nodes = scene.nodes[std::size_t(axis)];
          part.owned.low[axis] = nodes[std::size_t(low[axis])];
          part.owned.high[axis] = nodes[std::size_t(high[axis])];
          part.begin[axis] = std::max(0, low[axis] - ghosts);
          part.end[axis] = std::min(int(nodes.size()) - 1, high[axis] + ghosts);
        }
        boxes.push_back(part.owned);
        parts.push_back(part);
      }
    }
  }
  if (camera.projection == Projection::MultiPerspective) return parts;
  for (std::size_t i : visibilityOrder(boxes, camera)) ordered.push_back(parts[i]);
  return ordered;
}

Cuts Scene::whole() const {
  return {std::vector<int>{0, int(nodes[0].size()) - 1},
          std::vector<int>{0, int(nodes[1].size()) - 1},
          std::vector<int>{0, int(nodes[2].size()) - 1}};
}

Box Scene::box() const {
  return {{nodes[0].front(), nodes[1].front(), nodes[2].front()},
          {nodes[0].back(), nodes[1].back(), nodes[2].back()}};
}

Scene Scene::even(glm::ivec3 count, const Box& box, std::function<double(glm::dvec3)> field) {
  Scene scene;
  scene.field = std::move(field);
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < count[axis]; ++i) {
      const double t = count[axis] > 1 ? double(i) / (count[axis] - 1) : 0.5;
      scene.nodes[std::size_t(axis)].push_back(box.low[axis] * (1.0 - t) + box.high[axis] * t);
    }
  }
  return scene;
}

MarchRequest requestAll(const Box& domain, double low, double high, int intervals,
                        const Camera& camera, ImageSize size) {
  MarchRequest request{camera, size, IntervalPartition::uniform(low, high, intervals),
                       TransferFunction::ramp(low, high, 0.2 * domain.diagonal()), domain};
  request.mip = true;
  request.reference = true;
  request.isovalues = {0.7 * low + 0.3 * high, 0.4 * low + 0.6 * high};
  return request;
}

RayImage marchWhole(Marcher& marcher, const Scene& scene, const MarchRequest& request) {
  const glm::ivec3 last{int(scene.nodes[0].size()) - 1, int(scene.nodes[1].size()) - 1,
                        int(scene.nodes[2].size()) - 1};
  return marchPart(marcher, scene, request, {glm::ivec3(0), last, request.domain});
}

RayImage marchBlocks(Marcher& marcher, const Scene& scene, const MarchRequest& request,
                     const Cuts& cuts, int ghosts) {
  if (request.camera.projection == Projection::MultiPerspective) {
    RaySorter sorter;
    for (const Part& part : partsOf(scene, request.camera, cuts, ghosts)) {
      sorter.add(marchPart(marcher, scene, request, part));
    }
    return sorter.take();
  }
  std::optional<RayImage> result;
  for (const Part& part : partsOf(scene, request.camera, cuts, ghosts)) {
    RayImage image = marchPart(marcher, scene, request, part);
    if (result) {
      compositeUnder(*result, image);
    } else {
      result = std::move(image);
    }
  }
  return std::move(*result);
}

GatheredLayers marchLayers(Marcher& marcher, const Scene& scene, const MarchRequest& request,
                           int layers, std::optional<glm::dvec3> light, const Cuts& cuts,
                           int ghosts) {
  const auto parts = partsOf(scene, request.camera, cuts, ghosts);
  const RayImage rays = marchBlocks(marcher, scene, request, cuts, ghosts);
  std::optional<LightDepth> shadows;
  if (light) {
    shadows.emplace(request.domain, *light);
    for (const Part& part : parts) {
      uploadPart(marcher, scene, request, part);
      marcher.marchLight(request, *shadows);
    }
  }
  LayerGatherer gatherer(layers, rays.transmittance);
  for (const Part& part : parts) {
    uploadPart(marcher, scene, request, part);
    gatherer.add(marcher.marchLayers(request, gatherer.request(shadows ? &*shadows : nullptr)));
  }
  return {gatherer.planes(rays.exit), gatherer.light(), rays};
}

std::vector<SlabRays> marchSlabs(Marcher& marcher, const Scene& scene, const MarchRequest& request,
                                 const std::vector<double>& depths, const Cuts& cuts, int ghosts) {
  std::vector<SlabRays> slabs(depths.size() - 1);
  for (const Part& part : partsOf(scene, request.camera, cuts, ghosts)) {
    uploadPart(marcher, scene, request, part);
    marcher.marchSlabs(request, depths, [&](int s, SlabRays rays) {
      SlabRays& slab = slabs[std::size_t(s)];
      if (slab.cells.empty()) {
        slab = std::move(rays);
      } else {
        compositeSlabs(slab, rays);
      }
    });
  }
  return slabs;
}

std::shared_ptr<gl::Device> sharedDevice(const std::string& backend) {
  static std::map<std::string, std::shared_ptr<gl::Device>> devices;
  auto& device = devices[backend];
  if (!device) device = gl::Device::create(backend);
  return device;
}

double greatestDifference(const std::vector<float>& a, const std::vector<float>& b) {
  if (a.size() != b.size()) return std::numeric_limits<double>::infinity();
  double greatest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i] == b[i] || (std::isnan(a[i]) && std::isnan(b[i]))) continue;
    const double difference = std::abs(double(a[i]) - double(b[i]));
    if (!(difference < 1e300)) return std::numeric_limits<double>::infinity();
    greatest = std::max(greatest, difference);
  }
  return greatest;
}

}  // namespace vestige
