// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "explorer/gpu/gpu.h"
#include "explorer/layers/depth_layer_pass.h"
#include "explorer/layers/layers.h"
#include "proxy/gl/device.h"
#include "tests/explorer/synthetic.h"

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

/// The planes seen after a turn, each pixel of the layer as opaque as `opacity` tells.
WarpedView turned(const LayerPlanes& planes, double azimuth, bool unseen,
                  const std::vector<float>& opacity = std::vector<float>(kSize.pixels(), 1.0f)) {
  static const std::shared_ptr<gl::Device> device = gl::Device::create();
  WarpedView view;
  device->run([&] {
    DepthLayerPass pass;
    const LayerTextures layers(planes);
    const gl::Texture colors = gpu::textureArray(GL_RGBA32F, kSize, 1);
    std::vector<float> grey;
    for (float alpha : opacity) grey.insert(grey.end(), 4, alpha);
    gpu::uploadLayer(colors, kSize, 0, GL_RGBA, GL_FLOAT, grey.data());
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

TEST(WarpTrust, ShadowsAreAsDoubtfulAsTheLayerIsOpaque) {
  const WarpedView whole = turned(plate(), 40.0, true);
  for (const float opacity : {0.25f, 0.02f}) {
    const WarpedView view =
        turned(plate(), 40.0, true, std::vector<float>(kSize.pixels(), opacity));
    for (int x = 0; x < kSize.width; ++x) {
      if (whole.picture.pixel(x, 32)[3] > 0.0f) continue;
      EXPECT_EQ(at(view.guess, x, 32), opacity * at(whole.guess, x, 32)) << "column " << x;
    }
  }
  const WarpedView unseen = turned(plate(), 40.0, true, std::vector<float>(kSize.pixels(), 0.003f));
  for (float guess : unseen.guess) EXPECT_EQ(guess, 0.0f) << "below 1/255";
}

TEST(WarpTrust, AThinEdgeDoesNotHideTheShadowOfWhatIsMoreOpaque) {
  std::vector<float> opacity(kSize.pixels(), 0.01f);
  for (int y = 26; y < 38; ++y) {
    for (int x = 26; x < 38; ++x) opacity[std::size_t(y * kSize.width + x)] = 0.9f;
  }
  const WarpedView view = turned(plate(), 40.0, true, opacity);
  int deep = 0;
  for (int x = 0; x < kSize.width; ++x)
    deep += view.picture.pixel(x, 32)[3] == 0.0f && at(view.guess, x, 32) == 0.9f;
  const WarpedView whole = turned(plate(), 40.0, true);
  int voids = 0;
  for (int x = 0; x < kSize.width; ++x)
    voids += whole.picture.pixel(x, 32)[3] == 0.0f && at(whole.guess, x, 32) > 0.5f;
  EXPECT_GE(deep, voids - 4) << "two columns of edge on either side";
}

TEST(WarpTrust, IsTheSameFarFromTheOrigin) {
  const LayerPlanes near = plate();
  LayerPlanes far = near;
  const glm::dvec3 away{3e8, -2e8, 1e8};
  far.camera.position += away;
  far.domain.low += away;
  far.domain.high += away;
  const WarpedView here = turned(near, 40.0, true), there = turned(far, 40.0, true);
  int different = 0;
  for (std::size_t i = 0; i < here.guess.size(); ++i) different += here.guess[i] != there.guess[i];
  EXPECT_LE(different, 8) << "double coordinates round to 6e-8 here";
}

TEST(Warp, LeavesNoCracksInARoughSurface) {
  LayerPlanes planes = plate();
  const double pixel = planes.camera.viewHeight / kSize.height;
  unsigned state = 1;
  for (float& z : planes.depth[0]) {
    state = state * 1664525u + 1013904223u;
    z += float(pixel * 4.5 * double(state >> 8) / double(1u << 24));  // nothing stays infinite
    planes.normal[0].insert(planes.normal[0].end(), {0.0f, 0.0f, 1.0f});
  }
  const WarpedView view = turned(planes, 35.0, false);
  for (int y = 26; y < 38; ++y) {
    int first = kSize.width, last = -1;
    for (int x = 0; x < kSize.width; ++x) {
      if (view.picture.pixel(x, y)[3] == 0.0f) continue;
      first = std::min(first, x);
      last = x;
    }
    for (int x = first; x <= last; ++x)
      EXPECT_GT(view.picture.pixel(x, y)[3], 0.0f) << x << ", " << y;
  }
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
  const std::vector<Segment> truth = synthetic::trueSegments(lengths.header, 32, 32);
  std::vector<bool> met(lengths.length.size());
  double z = 0.0;
  for (std::size_t k = 0; k < lengths.length.size(); ++k)
    z += lengths.length[k].empty() ? 0.0 : double(lengths.length[k][middle]);
  const double centerDepth =
      glm::dot(lengths.header.domain.center() - lengths.header.camera.position,
               lengths.header.camera.forward);
  z = centerDepth - 0.5 * z;
  for (const Segment& segment : truth) {
    const auto k = std::size_t(segment.channel);
    if (!met[k]) {
      EXPECT_NEAR(planes.depth[std::size_t(layerOf[k])][middle], z, 0.02) << "channel " << k;
      EXPECT_EQ(planes.likely[std::size_t(layerOf[k])][middle], 0);
    }
    met[k] = true;
    z += segment.amount;
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
