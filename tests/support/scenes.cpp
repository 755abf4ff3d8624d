// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/scenes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include "proxy/base/error.h"
#include "tests/support/plume_scene.h"
#include "tests/support/turbulence.h"

namespace vestige::test {
namespace {

namespace fs = std::filesystem;

/// Position of a world coordinate on an axis, in nodes: i + u between nodes i and i + 1.
double indexOf(const Scene& scene, int axis, double world) {
  const auto a = std::size_t(axis);
  const int n = scene.size[a];
  if (scene.nodes[a].empty()) {
    return std::clamp((world - scene.origin[axis]) / scene.spacing[axis], 0.0, double(n - 1));
  }
  const auto& nodes = scene.nodes[a];
  if (n < 2 || world <= nodes.front()) return 0.0;
  if (world >= nodes.back()) return n - 1;
  const auto next = std::upper_bound(nodes.begin(), nodes.end(), world);
  return double(next - nodes.begin() - 1) + (world - *(next - 1)) / (*next - *(next - 1));
}

double worldOf(const Scene& scene, int axis, double index) {
  const auto a = std::size_t(axis);
  if (scene.nodes[a].empty()) return scene.origin[axis] + index * scene.spacing[axis];
  const auto i = std::size_t(std::min(int(index), std::max(scene.size[a] - 2, 0)));
  const auto j = std::min(i + 1, scene.nodes[a].size() - 1);
  return std::lerp(scene.nodes[a][i], scene.nodes[a][j], index - double(i));
}

double trilinear(const Scene& scene, glm::dvec3 index) {
  const glm::ivec3 low(index);
  const glm::ivec3 high =
      glm::min(low + 1, glm::ivec3(scene.size[0], scene.size[1], scene.size[2]) - 1);
  const glm::dvec3 u = index - glm::dvec3(low);
  const auto corner = [&](bool x, bool y, bool z) {
    return double(scene.at(x ? high.x : low.x, y ? high.y : low.y, z ? high.z : low.z));
  };
  if (std::isnan(corner(u.x >= 0.5, u.y >= 0.5, u.z >= 0.5))) return std::nan("");
  double sum = 0.0, weights = 0.0;
  for (int i = 0; i < 8; ++i) {
    const bool x = i & 1, y = i & 2, z = i & 4;
    const double value = corner(x, y, z);
    const double weight = (x ? u.x : 1.0 - u.x) * (y ? u.y : 1.0 - u.y) * (z ? u.z : 1.0 - u.z);
    if (std::isnan(value)) continue;
    sum += weight * value;
    weights += weight;
  }
  return sum / weights;
}

glm::dvec3 indexOf(const Scene& scene, glm::dvec3 world) {
  return {indexOf(scene, 0, world.x), indexOf(scene, 1, world.y), indexOf(scene, 2, world.z)};
}

Scene smooth(int n) {
  return makeScene("smooth", n, {glm::dvec3(-3.0), glm::dvec3(3.0)}, [](glm::dvec3 p) {
    return 0.5 + 0.5 * std::sin(p.x * p.y + p.z) * std::cos(p.x + p.y * p.z);
  });
}

/// A lopsided body of four Gaussian lobes; its isosurfaces from 0.2 to 0.8 lie inside the box.
Scene blob(int n) {
  struct Lobe {
    glm::dvec3 center;
    double radius, weight;
  };
  static const Lobe lobes[] = {{{0.0, 0.0, -0.1}, 0.34, 1.0},
                               {{0.34, -0.18, 0.22}, 0.2, 0.62},
                               {{-0.3, 0.16, 0.3}, 0.17, 0.55},
                               {{-0.12, -0.34, -0.36}, 0.19, 0.5}};
  return makeScene("blob", n, {glm::dvec3(-1.0), glm::dvec3(1.0)}, [](glm::dvec3 p) {
    double left = 1.0;  // a smooth union: 1 - Π (1 - lobe)
    for (const Lobe& lobe : lobes) {
      const glm::dvec3 r = (p - lobe.center) / lobe.radius;
      left *= 1.0 - lobe.weight * std::exp(-0.5 * glm::dot(r, r));
    }
    return 1.0 - left;
  });
}

Scene turbulent(int n) {
  Scene scene;
  scene.name = "turbulent";
  scene.size = {n, n, n};
  scene.spacing = glm::dvec3(1.0 / n);  // the field is periodic: n samples span one period
  scene.values = turbulence(n, 1);
  return scene;
}

Scene ctHead() {
  const fs::path header = ctHeadPath();
  if (header.empty()) {
    throw Error(ErrorCode::NotFound, "the CT head is not there: run scripts/fetch-ct-head");
  }
  Scene scene;
  scene.name = "ct";
  scene.size = {256, 256, 108};
  scene.spacing = {0.957, 0.957, 1.5};
  scene.low = -1024.0;
  scene.high = 2986.0;
  scene.nativeBytes = 2;
  const fs::path raw = header.parent_path() / "matrix.dat";
  std::vector<std::int16_t> native(std::size_t(256) * 256 * 108);
  std::ifstream file(raw, std::ios::binary);
  if (!file.read(reinterpret_cast<char*>(native.data()), std::streamsize(native.size() * 2))) {
    throw Error(ErrorCode::Io, raw.string() + " does not hold 256 x 256 x 108 16-bit samples");
  }
  scene.values.assign(native.begin(), native.end());
  return scene;
}

/// Values of a scene from `path`, or made and left there by way of a rename.
void cached(Scene& scene, const fs::path& path, const std::function<void(Scene&)>& make) {
  const std::size_t count =
      std::size_t(scene.size[0]) * std::size_t(scene.size[1]) * std::size_t(scene.size[2]);
  std::error_code none;
  if (fs::file_size(path, none) == count * sizeof(float) && !none) {
    scene.values.resize(count);
    std::ifstream file(path, std::ios::binary);
    if (file.read(reinterpret_cast<char*>(scene.values.data()),
                  std::streamsize(count * sizeof(float)))) {
      return;
    }
  }
  make(scene);
  fs::create_directories(path.parent_path());
  const fs::path temporary = path.string() + ".tmp";
  std::ofstream file(temporary, std::ios::binary);
  file.write(reinterpret_cast<const char*>(scene.values.data()),
             std::streamsize(count * sizeof(float)));
  file.close();
  if (!file) throw Error(ErrorCode::Io, "cannot write " + temporary.string());
  fs::rename(temporary, path);
}

}  // namespace

Box Scene::domain() const {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = worldOf(*this, axis, 0);
    box.high[axis] = worldOf(*this, axis, size[std::size_t(axis)] - 1);
  }
  return box;
}

BlockGrid Scene::block() const {
  BlockGrid grid;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = std::size_t(axis);
    for (int i = 0; i < size[a]; ++i) grid.nodes[a].push_back(worldOf(*this, axis, i));
  }
  grid.owned = domain();
  return grid;
}

double Scene::minimumSpacing() const {
  double least = HUGE_VAL;
  for (const auto& axis : block().nodes) {
    for (std::size_t i = 1; i < axis.size(); ++i) least = std::min(least, axis[i] - axis[i - 1]);
  }
  return least;
}

double Scene::sample(glm::dvec3 world) const { return trilinear(*this, indexOf(*this, world)); }

glm::dvec3 Scene::gradient(glm::dvec3 world) const {
  const glm::dvec3 index = indexOf(*this, world);
  glm::dvec3 slope{0.0};
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 a = index, b = index;
    a[axis] = std::max(index[axis] - 1.0, 0.0);
    b[axis] = std::min(index[axis] + 1.0, size[std::size_t(axis)] - 1.0);
    if (std::isnan(trilinear(*this, a))) a = index;
    if (std::isnan(trilinear(*this, b))) b = index;
    const double run = worldOf(*this, axis, b[axis]) - worldOf(*this, axis, a[axis]);
    const double rise = trilinear(*this, b) - trilinear(*this, a);
    if (run > 0.0 && !std::isnan(rise)) slope[axis] = rise / run;
  }
  return slope;
}

Scene makeScene(std::string name, int n, const Box& box,
                const std::function<double(glm::dvec3)>& formula) {
  Scene scene;
  scene.name = std::move(name);
  scene.size = {n, n, n};
  scene.origin = box.low;
  scene.spacing = box.size() / double(n - 1);
  scene.values.reserve(std::size_t(n) * std::size_t(n) * std::size_t(n));
  for (int z = 0; z < n; ++z) {
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        scene.values.push_back(float(formula(box.low + scene.spacing * glm::dvec3(x, y, z))));
      }
    }
  }
  return scene;
}

Scene namedScene(const std::string& name, int n, const fs::path& cache) {
  const fs::path file = cache / (name + "-" + std::to_string(n) + ".raw");
  if (name == "smooth") return smooth(n);
  if (name == "blob") return blob(n);
  if (name == "ct") return ctHead();
  if (name == "turbulent") {
    Scene scene;
    scene.name = name;
    scene.size = {n, n, n};
    scene.spacing = glm::dvec3(1.0 / n);
    cached(scene, file, [n](Scene& s) { s.values = turbulent(n).values; });
    return scene;
  }
  if (name == "plume" || name == "plume-vorticity") {
    Scene scene;
    scene.name = name;
    scene.size = {n, n, n};
    scene.spacing = glm::dvec3(1.0 / n);
    scene.origin = glm::dvec3(0.5 / n);
    cached(scene, file,
           [&](Scene& s) { s.values = name == "plume" ? plumeTemperature(n) : plumeVorticity(n); });
    const auto [low, high] = std::minmax_element(scene.values.begin(), scene.values.end());
    scene.low = double(*low);
    scene.high = double(*high);
    return scene;
  }
  throw Error(ErrorCode::InvalidArgument,
              "there is no scene '" + name +
                  "': choose smooth, turbulent, blob, plume, plume-vorticity or ct");
}

fs::path sceneCache() {
  if (const char* folder = std::getenv("VESTIGE_SCENES")) return folder;
  return fs::path(VESTIGE_SOURCE_DIR) / "build" / "scenes";
}

fs::path ctHeadPath() {
  const char* cache = std::getenv("XDG_CACHE_HOME");
  const char* home = std::getenv("HOME");
  if (cache == nullptr && home == nullptr) return {};
  const fs::path base = cache != nullptr ? fs::path(cache) : fs::path(home) / ".cache";
  const fs::path header = base / "vestige" / "ct" / "head.mhd";
  return fs::exists(header) ? header : fs::path();
}

}  // namespace vestige::test
