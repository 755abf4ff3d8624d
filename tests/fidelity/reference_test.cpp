// SPDX-License-Identifier: BSD-3-Clause
//
// The reference picture equals that of an independent renderer in double precision, to 1/255 at
// every pixel.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <string>

#include "tests/adaptor/march/march_scene.h"
#include "tests/support/cpu_renderer.h"
#include "tests/support/scenes.h"

namespace vestige::test {
namespace {

constexpr ImageSize kSize{120, 90};
constexpr double kStep8 = 1.0 / 255.0;

/// The turbulent field on nodes of which the widest gap is seven times the narrowest.
Scene stretched() {
  Scene scene = namedScene("turbulent", 64, testing::TempDir());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    scene.size[axis] = 64;
    for (int i = 0; i < 64; ++i) {
      const double t = i / 63.0;
      scene.nodes[axis].push_back(axis == 1 ? t : 0.25 * t + 0.75 * t * t);
    }
  }
  return scene;
}

/// The turbulent field over the floor of a sea, and with an island in it.
Scene holed() {
  Scene scene = namedScene("turbulent", 64, testing::TempDir());
  for (int z = 0; z < 64; ++z)
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x) {
        const bool floor = z < 20 + 10 * std::sin(0.13 * x) * std::cos(0.17 * y);
        const bool island = std::hypot(x - 40, y - 20) < 12 - 0.1 * z;
        if (floor || island) scene.values[std::size_t(x + 64 * (y + 64 * z))] = std::nanf("");
      }
  return scene;
}

/// No scene where the CT head has not been fetched.
std::optional<Scene> sceneOf(const std::string& name) {
  if (name == "ct" && ctHeadPath().empty()) return std::nullopt;
  if (name == "stretched") return stretched();
  if (name == "holed") return holed();
  return namedScene(name, 64, testing::TempDir());
}

/// Opacity over the share of the scene's range. "hard" is a surface, opaque within a few voxels;
/// "spike" is 1e-4 of the range wide.
TransferFunction functionOf(const std::string& name, const Scene& scene) {
  std::vector<OpacityPoint> points;
  if (name == "ramp") points = {{0.25, 0.0}, {1.0, 0.5}};
  if (name == "peaks") {
    points = {{0.3, 0.0}, {0.35, 0.3}, {0.4, 0.0}, {0.6, 0.0}, {0.7, 0.6}, {0.8, 0.02}};
  }
  if (name == "hard") points = {{0.5, 0.0}, {0.51, 0.9}};
  if (name == "spike") points = {{0.45, 0.0}, {0.45005, 0.8}, {0.4501, 0.0}};
  const double range = scene.high - scene.low;
  for (OpacityPoint& point : points) point.value = scene.low + range * point.value;
  return TransferFunction(points, scene.domain().diagonal() / 100, Colormap::named("inferno"),
                          scene.low, scene.high);
}

MarchRequest requestOf(const Scene& scene, const std::string& function, Projection projection) {
  const Box domain = scene.domain();
  MarchRequest request{
      .camera = frameBox(domain, {-0.5, 1.0, 0.4}, {0, 0, 1}, kSize.aspect(), projection, 0.7),
      .size = kSize,
      .partition = IntervalPartition::uniform(scene.low, scene.high, 16),
      .base = functionOf(function, scene),
      .domain = domain};
  // A block's own smallest gap is not the domain's.
  request.stepLength = scene.minimumSpacing();
  for (const auto& nodes : scene.nodes) {
    if (!nodes.empty()) request.stepLength = domain.size().x / 64;
  }
  request.attenuation = request.length = false;
  request.reference = true;
  return request;
}

/// The same samples as the march's own tests hold them.
vestige::Scene nodesOf(const Scene& scene) {
  return {scene.block().nodes, [&](glm::dvec3 p) { return scene.sample(p); }};
}

double greatestDifference(const RayImage& image, const RgbPicture& truth) {
  std::vector<float> planes;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < kSize.pixels(); ++i) planes.push_back(truth.rgb[3 * i + c]);
  }
  return vestige::greatestDifference(image.reference, planes);
}

struct Case {
  const char *scene, *function;
  Projection projection;
  bool phong;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.scene << " " << c.function; }

class Reference : public testing::TestWithParam<Case> {};

TEST_P(Reference, EqualsTheCpuRenderer) {
  const Case& c = GetParam();
  const auto scene = sceneOf(c.scene);
  if (!scene) GTEST_SKIP() << "the CT head is not there: run scripts/fetch-ct-head";
  MarchRequest request = requestOf(*scene, c.function, c.projection);
  request.phong = c.phong;
  Marcher marcher(sharedDevice("auto"));
  const RayImage image = marchWhole(marcher, nodesOf(*scene), request);
  const RgbPicture truth = renderReference(*scene, request);
  EXPECT_GT(*std::max_element(truth.rgb.begin(), truth.rgb.end()), 0.02f) << "something to see";
  EXPECT_LE(greatestDifference(image, truth), kStep8);
}

constexpr auto kOrtho = Projection::Orthographic, kPerspective = Projection::Perspective,
               kDistorted = Projection::MultiPerspective;
INSTANTIATE_TEST_SUITE_P(
    Scenes, Reference,
    testing::Values(
        Case{"turbulent", "ramp", kOrtho, false}, Case{"turbulent", "ramp", kPerspective, true},
        Case{"turbulent", "peaks", kOrtho, true}, Case{"turbulent", "peaks", kPerspective, false},
        Case{"turbulent", "hard", kOrtho, false}, Case{"turbulent", "hard", kPerspective, true},
        Case{"turbulent", "spike", kOrtho, false}, Case{"turbulent", "spike", kPerspective, true},
        Case{"stretched", "ramp", kOrtho, true}, Case{"stretched", "peaks", kPerspective, true},
        Case{"stretched", "hard", kOrtho, false}, Case{"turbulent", "peaks", kDistorted, true},
        Case{"turbulent", "hard", kDistorted, false}, Case{"stretched", "ramp", kDistorted, true},
        Case{"holed", "ramp", kOrtho, true}, Case{"holed", "peaks", kPerspective, true},
        Case{"holed", "peaks", kOrtho, false}, Case{"ct", "ramp", kOrtho, false},
        Case{"ct", "ramp", kPerspective, true}, Case{"ct", "peaks", kOrtho, true},
        Case{"ct", "hard", kPerspective, false}),
    [](const auto& instance) {
      const Case& c = instance.param;
      return std::string(c.scene) + "_" + c.function +
             (c.projection == kPerspective ? "_perspective"
              : c.projection == kDistorted ? "_distorted"
                                           : "") +
             (c.phong ? "_lit" : "");
    });

/// Blocks with ghost layers get the samples of the whole to the last bit, so even where rays graze
/// a bound they are as long in an interval.
TEST(Blocks, MakeWhatOneBlockMakesAndTheReferenceOfTheCpuRenderer) {
  constexpr double kTolerance = 1e-5;
  for (const char* name : {"turbulent", "stretched"}) {
    for (const char* function : {"ramp", "peaks", "hard", "spike"}) {
      for (const Projection projection : {kOrtho, kPerspective, kDistorted}) {
        const bool smooth = std::string(function) == "ramp" || std::string(function) == "peaks";
        if (projection == kDistorted && !smooth) continue;  // time
        SCOPED_TRACE(std::string(name) + " " + function +
                     (projection == kOrtho         ? ""
                      : projection == kPerspective ? " in perspective"
                                                   : " distorted"));
        const Scene scene = *sceneOf(name);
        MarchRequest request = requestOf(scene, function, projection);
        request.attenuation = request.length = true;
        Marcher marcher(sharedDevice("auto"));
        const RayImage whole = marchWhole(marcher, nodesOf(scene), request);
        const RayImage blocks = marchBlocks(marcher, nodesOf(scene), request,
                                            {{{0, 23, 63}, {0, 31, 50, 63}, {0, 40, 63}}}, 3);
        EXPECT_LE(vestige::greatestDifference(whole.attenuation, blocks.attenuation), kTolerance);
        EXPECT_LE(vestige::greatestDifference(whole.transmittance, blocks.transmittance),
                  kTolerance);
        EXPECT_LE(vestige::greatestDifference(whole.length, blocks.length),
                  kTolerance * request.domain.diagonal());
        EXPECT_LE(vestige::greatestDifference(whole.reference, blocks.reference), kTolerance);
        if (std::string(function) != "ramp") continue;
        EXPECT_LE(greatestDifference(blocks, renderReference(scene, request)), kStep8);
      }
    }
  }
}

TEST(ReferenceOfShortSteps, ConvergesToThatOfTheContinuousField) {
  for (const char* name : {"turbulent", "smooth"}) {
    for (const Projection projection : {kOrtho, kPerspective}) {
      SCOPED_TRACE(std::string(name) + (projection == kOrtho ? "" : " in perspective"));
      const Scene scene = *sceneOf(name);
      MarchRequest request = requestOf(scene, "ramp", projection);
      const Medium medium = [&](double f) {
        return Optics{request.base.extinction(f), request.base.color(f)};
      };
      const auto truth = renderContinuous(scene, request.camera, kSize, {&medium, 1}, 12)[0];
      Marcher marcher(sharedDevice("auto"));
      request.stepLength = scene.minimumSpacing() / 4;
      EXPECT_LE(greatestDifference(marchWhole(marcher, nodesOf(scene), request), truth), kStep8);
    }
  }
}

}  // namespace
}  // namespace vestige::test
