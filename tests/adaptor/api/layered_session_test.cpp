// SPDX-License-Identifier: BSD-3-Clause
//
// Layered proxies through a session.
#include <gtest/gtest.h>

#include <cmath>

#include "proxy/archive/archive.h"
#include "proxy/format/layout/analytic_layers_layout.h"
#include "simulation.h"

namespace vestige::test {
namespace {

ProxyImage imageOf(const Archive& archive, std::string_view kind) {
  return archive.open(*archive.find(1, "front", "f", kind)).image();
}

TEST(LayeredSession, StoresLayersThatCompositeToTheReferencePicture) {
  const Folder folder;
  const std::string path = folder / "a.cdb";
  for (const char* phong : {"false", "true"}) {
    {
      Simulation run(path, std::string("[output]\nexisting = 'overwrite'\n") + kSmallImage +
                               "proxies = ['reference', 'layered']\nphong = " + phong +
                               "\n[layered]\nlayers = 3\n");
      ASSERT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
    }
    EXPECT_EQ(damageOf(path), "");
    const Archive archive(path);
    const ProxyImage image = imageOf(archive, kind::kLayered);
    EXPECT_EQ(image.header.shading, std::string(phong) == "true" ? "headlight" : "unlit");
    const ProxyImage reference = imageOf(archive, kind::kReference);
    const AnalyticLayerPlanes planes = layeredPlanes(image);
    ASSERT_EQ(planes.layers, 3);
    const std::size_t pixels = planes.state.size();
    // As each of the parts is rounded.
    const double tolerance =
        reference.part("reference").error + 3.0 * image.part("layer00").error + kEmptyOpacity;
    const char* const names[] = {"R", "G", "B"};
    double brightest = 0.0;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto& wanted = reference.channel("reference", names[c]).values;
      for (std::size_t p = 0; p < pixels; ++p) {
        double light = 0.0, left = 1.0;
        for (std::size_t i = 0; i < 3; ++i) {
          light += left * double(planes.color[(3 * i + c) * pixels + p]);
          left *= std::exp(-double(planes.tau[i * pixels + p]));
        }
        ASSERT_NEAR(light, wanted[p], tolerance) << p;
        brightest = std::max(brightest, light);
      }
    }
    EXPECT_GT(brightest, 0.2);
  }
}

TEST(LayeredSession, ShadowsDarkenAndAreNamed) {
  const Folder folder;
  double sums[2] = {};
  for (const bool shadowed : {false, true}) {
    const std::string path = folder / (shadowed ? "lit.cdb" : "plain.cdb");
    {
      Simulation run(path, std::string(kSmallImage) + "proxies = ['layered']\n[layered]\n" +
                               (shadowed ? "light = [0, 2, -2]\n" : ""));
      ASSERT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
    }
    EXPECT_EQ(damageOf(path), "");
    const ProxyImage image = imageOf(Archive(path), kind::kLayered);
    if (shadowed) {
      EXPECT_EQ(image.header.shading,
                "shadows of a light along (0, 0.7071067811865475, -0.7071067811865475), ambient "
                "0.25");
    }
    for (const float v : layeredPlanes(image).color) sums[shadowed] += v;
  }
  EXPECT_LT(sums[1], 0.9 * sums[0]);
  EXPECT_GT(sums[1], 0.25 * sums[0]);
}

}  // namespace
}  // namespace vestige::test
