// SPDX-License-Identifier: BSD-3-Clause
#include "tests/support/scenes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>

#include "proxy/error.h"
#include "tests/support/plume_scene.h"
#include "tests/support/turbulence.h"

namespace vestige::test {
namespace {

namespace fs = std::filesystem;

/// The cell of a coordinate on an axis of n points and the weight of its upper point.
struct AxisPosition {
  int low, high;
  double weight;
};

AxisPosition onAxis(double world, double origin, double spacing, int n) {
  const double u = std::clamp((world - origin) / spacing, 0.0, double(n - 1));
  const int low = std::min(int(u), std::max(n - 2, 0));
  return {low, std::min(low + 1, n - 1), u - low};
}

/// Trilinear mix of `value(x, y, z)` at the eight points around a position.
template <typename Value>
auto trilinear(const Scene& scene, glm::dvec3 world, const Value& value) {
  const AxisPosition x = onAxis(world.x, scene.origin.x, scene.spacing.x, scene.size[0]);
  const AxisPosition y = onAxis(world.y, scene.origin.y, scene.spacing.y, scene.size[1]);
  const AxisPosition z = onAxis(world.z, scene.origin.z, scene.spacing.z, scene.size[2]);
  const auto row = [&](int j, int k) {
    return value(x.low, j, k) * (1.0 - x.weight) + value(x.high, j, k) * x.weight;
  };
  const auto plane = [&](int k) {
    return row(y.low, k) * (1.0 - y.weight) + row(y.high, k) * y.weight;
  };
  return plane(z.low) * (1.0 - z.weight) + plane(z.high) * z.weight;
}

glm::dvec3 gradientAtPoint(const Scene& scene, int x, int y, int z) {
  const auto along = [&](int axis) {
    std::array<int, 3> a{x, y, z}, b{x, y, z};
    const auto i = std::size_t(axis);
    a[i] = std::max(a[i] - 1, 0);
    b[i] = std::min(b[i] + 1, scene.size[i] - 1);
    if (a[i] == b[i]) return 0.0;
    const double rise = double(scene.at(b[0], b[1], b[2])) - double(scene.at(a[0], a[1], a[2]));
    return rise / (scene.spacing[axis] * (b[i] - a[i]));
  };
  return {along(0), along(1), along(2)};
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
  return {origin, origin + spacing * glm::dvec3(size[0] - 1, size[1] - 1, size[2] - 1)};
}

BlockGrid Scene::block() const {
  BlockGrid grid;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int a = int(axis);
    for (int i = 0; i < size[axis]; ++i) grid.nodes[axis].push_back(origin[a] + i * spacing[a]);
  }
  grid.owned = domain();
  return grid;
}

double Scene::minimumSpacing() const { return std::min({spacing.x, spacing.y, spacing.z}); }

double Scene::sample(glm::dvec3 world) const {
  return trilinear(*this, world, [this](int x, int y, int z) { return double(at(x, y, z)); });
}

glm::dvec3 Scene::gradient(glm::dvec3 world) const {
  return trilinear(*this, world,
                   [this](int x, int y, int z) { return gradientAtPoint(*this, x, y, z); });
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
  if (name == "plume") {
    Scene scene;
    scene.name = name;
    scene.size = {n, n, n};
    scene.spacing = glm::dvec3(1.0 / n);
    scene.origin = glm::dvec3(0.5 / n);
    cached(scene, file, [n](Scene& s) { s.values = plumeTemperature(n); });
    const auto [low, high] = std::minmax_element(scene.values.begin(), scene.values.end());
    scene.low = double(*low);
    scene.high = double(*high);
    return scene;
  }
  throw Error(ErrorCode::InvalidArgument,
              "there is no scene '" + name + "': choose smooth, turbulent, blob, plume or ct");
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
