// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "explorer/gpu.h"
#include "explorer/layer_pass.h"
#include "explorer/layers.h"
#include "proxy/gl/device.h"
#include "synthetic.h"

namespace vestige {
namespace {

constexpr ImageSize kSize{64, 64};

/// A square plate in the middle of the domain, seen from the front: pixels 24 to 39, halfway deep.
LayerPlanes plate() {
  const ProxyHeader header = synthetic::header(kind::kDepth, kSize);
  LayerPlanes planes{header.camera, kSize, {}, {{}}, header.domain, {}};
  std::vector<float> depth(kSize.pixels(), std::numeric_limits<float>::infinity());
  const double middle = 0.5 * (header.camera.nearDepth + header.camera.farDepth);
  for (int y = 24; y < 40; ++y) {
    for (int x = 24; x < 40; ++x) depth[std::size_t(y * kSize.width + x)] = float(middle);
  }
  planes.depth.push_back(std::move(depth));
  return planes;
}

WarpedView turned(const LayerPlanes& planes, double azimuth, bool unseen) {
  static const std::shared_ptr<gl::Device> device = gl::Device::create();
  WarpedView view;
  device->run([&] {
    LayerPass pass;
    const LayerTextures layers(planes);
    const gl::Texture colors = gpu::textureArray(GL_RGBA32F, kSize, 1);
    const std::vector<float> opaque(4 * kSize.pixels(), 1.0f);
    gpu::uploadLayer(colors, kSize, 0, GL_RGBA, GL_FLOAT, opaque.data());
    const Camera camera =
        planes.camera.orbited(planes.domain.center(), azimuth * 3.14159265358979 / 180, 0.0, 0.0);
    view = pass.warp(layers, colors, nullptr, camera, kSize, unseen);
  });
  return view;
}

float at(const std::vector<float>& plane, int x, int y) {
  return plane[std::size_t(y * kSize.width + x)];
}

TEST(WarpTrust, NothingIsAGuessFromTheStoredView) {
  const WarpedView view = turned(plate(), 0.0, true);
  EXPECT_EQ(view.picture.pixel(32, 32)[3], 1.0f);
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      // On the very edge walls are seen along their plane.
      if ((x >= 23 && x <= 40) && (y >= 23 && y <= 40) && !(x > 24 && x < 39 && y > 24 && y < 39))
        continue;
      EXPECT_EQ(at(view.guess, x, y), 0.0f) << x << ", " << y;
    }
  }
}

TEST(WarpTrust, SpaceRevealedBehindASilhouetteIsAGuessThoughNothingIsDrawnThere) {
  // Turned by 40 degrees the viewer looks past one side of the plate into its shadow.
  const WarpedView view = turned(plate(), 40.0, true);
  int voids = 0, besides = 0;
  for (int x = 0; x < kSize.width; ++x) {
    const bool drawn = view.picture.pixel(x, 32)[3] > 0.0f;
    if (drawn) continue;
    if (at(view.guess, x, 32) > 0.5f)
      ++voids;
    else
      ++besides;
  }
  EXPECT_GT(voids, 8);
  EXPECT_GT(besides, 20) << "space that stored rays saw to be empty";
  EXPECT_EQ(at(view.guess, 32, 32), 0.0f) << "the plate itself was seen";
  EXPECT_EQ(at(view.guess, 32, 4), 0.0f) << "above the plate all was seen";
}

TEST(WarpTrust, IsNotPaidForUnlessAskedFor) {
  const WarpedView view = turned(plate(), 40.0, false);
  for (float guess : view.guess) EXPECT_EQ(guess, 0.0f);
}

TEST(WarpTrust, ASurfaceSeenFromBehindIsAGuess) {
  const WarpedView view = turned(plate(), 180.0, true);
  EXPECT_GT(view.picture.pixel(32, 32)[3], 0.0f);
  EXPECT_GT(at(view.guess, 32, 32), 0.5f);
}

TEST(Fronts, AreExactWhereTheOrderTellsAndLikelyWhereItDoesNot) {
  // Nested shells, each met twice but the innermost: mean - length / 2 would lie inside the ball.
  LengthPlanes lengths = lengthPlanes(synthetic::lengthProxy(kSize));
  std::vector<int> layerOf;
  LayerPlanes planes = layersFromLengths(lengths, layerOf);
  const auto middle = std::size_t(32 * kSize.width + 32);
  const std::vector<Piece> truth = synthetic::truePieces(lengths.header, 32, 32);
  std::vector<bool> met(lengths.length.size());
  double z = 0.0;
  for (std::size_t k = 0; k < lengths.length.size(); ++k)
    z += lengths.length[k].empty() ? 0.0 : double(lengths.length[k][middle]);
  const double centerDepth =
      glm::dot(lengths.header.domain.center() - lengths.header.camera.position,
               lengths.header.camera.forward);
  z = centerDepth - 0.5 * z;
  for (const Piece& piece : truth) {
    const auto k = std::size_t(piece.channel);
    if (!met[k]) {
      EXPECT_NEAR(planes.depth[std::size_t(layerOf[k])][middle], z, 0.02) << "channel " << k;
      EXPECT_EQ(planes.likely[std::size_t(layerOf[k])][middle], 0);
    }
    met[k] = true;
    z += piece.amount;
  }
  // Without the ends of rays nobody knows.
  lengths.first.clear();
  planes = layersFromLengths(lengths, layerOf);
  int likely = 0;
  for (const auto& layer : planes.likely) likely += layer.empty() ? 0 : layer[middle];
  EXPECT_GE(likely, 2);
}

}  // namespace
}  // namespace vestige
