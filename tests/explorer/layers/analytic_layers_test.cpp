// SPDX-License-Identifier: BSD-3-Clause
//
// Epipolar ray casting of layers (method §2).
#include <gtest/gtest.h>

#include <cmath>
#include <glm/trigonometric.hpp>
#include <random>

#include "explorer/layers/analytic_layer_pass.h"
#include "explorer/renderer/renderer.h"
#include "proxy/base/error.h"
#include "proxy/format/layout/proxy_layout.h"
#include "proxy/gl/device.h"
#include "tests/explorer/synthetic.h"

namespace vestige {
namespace {

constexpr ImageSize kSize{48, 40};

std::shared_ptr<gl::Device> device() {
  static const std::shared_ptr<gl::Device> device = gl::Device::create();
  return device;
}

ProxyHeader headerOf(Projection projection, const Box& domain = {{-1, -2, 3}, {1, 2, 4.5}}) {
  ProxyHeader header = synthetic::header(kind::kLayered, kSize);
  header.domain = domain;
  header.camera = frameBox(domain, {0.2, 1.0, -0.3}, {0, 0, 1}, kSize.aspect(), projection, 0.6);
  return header;
}

AnalyticLayerPlanes emptyPlanes(int layers) {
  const std::size_t pixels = kSize.pixels(), k = std::size_t(layers);
  return {layers, std::vector<float>((k + 1) * pixels), std::vector<float>(3 * k * pixels),
          std::vector<float>(k * pixels), std::vector<AnalyticLayerState>(pixels)};
}

/// Where the ray of a pixel is in the domain, as planar depths; near > far: nowhere.
std::pair<double, double> depthsInDomain(const ProxyHeader& header, std::size_t p,
                                         const Camera& camera) {
  const Ray ray =
      camera.rayThrough({double(p % kSize.width) + 0.5, double(p / kSize.width) + 0.5}, kSize);
  double near = 0.0, far = HUGE_VAL;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (header.domain.low[axis] - ray.origin[axis]) / ray.direction[axis];
    const double b = (header.domain.high[axis] - ray.origin[axis]) / ray.direction[axis];
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
  return {near * ray.depthPerLength, far * ray.depthPerLength};
}

/// Layers anywhere along the rays, of any thickness and opacity.
AnalyticLayerPlanes randomPlanes(const ProxyHeader& header, int layers) {
  AnalyticLayerPlanes planes = emptyPlanes(layers);
  const std::size_t pixels = kSize.pixels();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (std::size_t p = 0; p < pixels; ++p) {
    const auto [near, far] = depthsInDomain(header, p, header.camera);
    if (!(near < far) || p % 7 == 0) continue;
    planes.state[p] = AnalyticLayerState::Whole;
    std::vector<double> at;
    for (int i = 0; i <= layers; ++i) at.push_back(near + unit(random) * (far - near));
    std::sort(at.begin(), at.end());
    for (int i = 0; i <= layers; ++i)
      planes.boundary[std::size_t(i) * pixels + p] = float(at[std::size_t(i)]);
    for (std::size_t i = 0; i < std::size_t(layers); ++i) {
      const double tau = 3.0 * unit(random) * unit(random);
      planes.tau[i * pixels + p] = float(tau);
      for (std::size_t c = 0; c < 3; ++c)
        planes.color[(3 * i + c) * pixels + p] = float(-std::expm1(-tau) * unit(random));
    }
  }
  return planes;
}

/// The medium of extinction `extinction` and one colour that fills the domain.
AnalyticLayerPlanes uniformPlanes(const ProxyHeader& header, int layers, double extinction) {
  AnalyticLayerPlanes planes = emptyPlanes(layers);
  const std::size_t pixels = kSize.pixels();
  for (std::size_t p = 0; p < pixels; ++p) {
    const auto [near, far] = depthsInDomain(header, p, header.camera);
    if (!(near < far)) continue;
    const Ray ray = header.camera.rayThrough(
        {double(p % kSize.width) + 0.5, double(p / kSize.width) + 0.5}, kSize);
    planes.state[p] = AnalyticLayerState::Whole;
    for (int i = 0; i <= layers; ++i)
      planes.boundary[std::size_t(i) * pixels + p] = float(near + (far - near) * i / layers);
    const double tau = extinction * (far - near) / layers / ray.depthPerLength;
    for (std::size_t i = 0; i < std::size_t(layers); ++i) {
      planes.tau[i * pixels + p] = float(tau);
      planes.color[3 * i * pixels + p] = float(-std::expm1(-tau));
    }
  }
  return planes;
}

AnalyticLayerView render(const ProxyHeader& header, const AnalyticLayerPlanes& planes,
                         const Camera& target) {
  AnalyticLayerView view;
  device()->run([&] {
    AnalyticLayerPass pass;
    view = pass.render(AnalyticLayerTextures(header, planes), target, kSize);
  });
  return view;
}

Camera turned(const ProxyHeader& header, double azimuth, double elevation = 0.0) {
  return header.camera.orbited(header.domain.center(), glm::radians(azimuth),
                               glm::radians(elevation));
}

TEST(Layered, TheStoredViewIsTheStoredPicture) {
  for (const Projection projection : {Projection::Orthographic, Projection::Perspective}) {
    for (const int layers : {1, 4, 6, 8, 16}) {
      const ProxyHeader header = headerOf(projection);
      // As they are stored: no layer is thinner than a step.
      const AnalyticLayerPlanes planes =
          layeredPlanes(layeredImage(header, randomPlanes(header, layers)));
      const AnalyticLayerView view = render(header, planes, header.camera);
      const std::size_t pixels = kSize.pixels();
      for (std::size_t p = 0; p < pixels; ++p) {
        double light[3] = {}, left = 1.0;
        for (std::size_t i = 0; i < std::size_t(layers); ++i) {
          for (std::size_t c = 0; c < 3; ++c)
            light[c] += left * double(planes.color[(3 * i + c) * pixels + p]);
          left *= std::exp(-double(planes.tau[i * pixels + p]));
        }
        for (std::size_t c = 0; c < 3; ++c)
          ASSERT_NEAR(view.picture.rgba[4 * p + c], light[c], 5e-4) << layers << " " << p;
        ASSERT_NEAR(view.picture.rgba[4 * p + 3], 1.0 - left, 5e-4) << layers << " " << p;
        EXPECT_EQ(view.guess[p], 0.0f);
      }
    }
  }
}

TEST(Layered, AUniformMediumIsExponentialFromEverySide) {
  constexpr double kExtinction = 0.7;
  for (const Projection stored : {Projection::Orthographic, Projection::Perspective}) {
    const ProxyHeader header = headerOf(stored);
    const AnalyticLayerPlanes planes = uniformPlanes(header, 4, kExtinction);
    for (const Projection seen : {Projection::Orthographic, Projection::Perspective}) {
      for (const double azimuth : {10.0, 45.0, 90.0, 135.0, 180.0}) {
        ProxyHeader from = headerOf(seen);
        const Camera target = turned(from, azimuth, 0.3 * azimuth);
        const AnalyticLayerView view = render(header, planes, target);
        double sum = 0.0, worst = 0.0;
        int inside = 0;
        for (std::size_t p = 0; p < kSize.pixels(); ++p) {
          const auto [near, far] = depthsInDomain(header, p, target);
          const Ray ray = target.rayThrough(
              {double(p % kSize.width) + 0.5, double(p / kSize.width) + 0.5}, kSize);
          const double chord = std::max(0.0, far - near) / ray.depthPerLength;
          const double difference =
              double(view.picture.rgba[4 * p]) + std::expm1(-kExtinction * chord);
          EXPECT_NEAR(view.picture.rgba[4 * p], view.picture.rgba[4 * p + 3], 1e-4);
          sum += std::abs(difference);
          // Pixels are columns: the domain's faces are as rough as a pixel.
          if (chord > 1.5) worst = std::max(worst, std::abs(difference));
          inside += chord > 0.0;
        }
        EXPECT_GT(inside, 100);
        EXPECT_LT(sum / inside, 0.03) << azimuth;
        EXPECT_LT(worst, 0.35) << azimuth;
      }
    }
  }
}

/// Two opaque plates, red before blue, in the middle half of the picture; saturated.
AnalyticLayerPlanes plates(const ProxyHeader& header) {
  AnalyticLayerPlanes planes = emptyPlanes(2);
  const std::size_t pixels = kSize.pixels();
  const DepthRange range = depthRange(header.camera, header.domain);
  const double extent = range.high - range.low;
  for (int y = 14; y < 26; ++y) {
    for (int x = 16; x < 32; ++x) {
      const std::size_t p = std::size_t(y) * kSize.width + std::size_t(x);
      planes.state[p] = AnalyticLayerState::Saturated;
      for (std::size_t i = 0; i < 3; ++i)
        planes.boundary[i * pixels + p] = float(range.low + (0.45 + 0.04 * double(i)) * extent);
      planes.tau[p] = planes.tau[pixels + p] = 6.0f;
      planes.color[p] = 1.0f;               // red
      planes.color[5 * pixels + p] = 1.0f;  // blue
    }
  }
  return planes;
}

TEST(Layered, OrderFlipsFromBehindAndWhatWasHiddenIsAGuess) {
  const ProxyHeader header = headerOf(Projection::Orthographic, {{-1, -1, -1}, {1, 1, 1}});
  const AnalyticLayerPlanes planes = plates(header);
  const std::size_t middle = std::size_t(20 * kSize.width + 24);
  const AnalyticLayerView front = render(header, planes, header.camera);
  EXPECT_GT(front.picture.rgba[4 * middle], 0.99f);
  EXPECT_LT(front.picture.rgba[4 * middle + 2], 0.01f);
  EXPECT_LT(front.guess[middle], 0.05f);
  const AnalyticLayerView back = render(header, planes, turned(header, 180.0));
  EXPECT_LT(back.picture.rgba[4 * middle], 0.01f);
  EXPECT_GT(back.picture.rgba[4 * middle + 2], 0.99f);
  EXPECT_EQ(back.guess[middle], 1.0f) << "anything may be behind the plates";
  // Beside the plates everything was seen, from behind as well; nothing is drawn into the void.
  EXPECT_EQ(back.guess[std::size_t(20 * kSize.width + 40)], 0.0f);
  const AnalyticLayerView side = render(header, planes, turned(header, 60.0));
  int drawn = 0, guesses = 0, both = 0;
  for (std::size_t p = 0; p < kSize.pixels(); ++p) {
    const bool opaque = side.picture.rgba[4 * p + 3] > 0.5f, guess = side.guess[p] > 0.5f;
    drawn += opaque;
    guesses += guess;
    both += opaque && guess;
  }
  EXPECT_GT(drawn, 80);
  EXPECT_GT(guesses, 60) << "the shadow of the plates";
  EXPECT_LT(both, drawn / 2) << "what is in front of the shadow is known";
  // Wider than when seen from the front in nothing: no smear.
  EXPECT_LT(drawn, 16 * 12);
}

TEST(Layered, WhatThePictureDoesNotShowIsAGuess) {
  ProxyHeader header = headerOf(Projection::Orthographic, {{-1, -1, -1}, {1, 1, 1}});
  header.camera.viewHeight *= 0.5;
  const AnalyticLayerPlanes planes = emptyPlanes(3);
  Camera wide = header.camera;
  wide.viewHeight *= 2.0;
  const AnalyticLayerView view = render(header, planes, wide);
  EXPECT_EQ(view.guess[std::size_t(20 * kSize.width + 24)], 0.0f);
  EXPECT_EQ(view.guess[std::size_t(20 * kSize.width + 9)], 1.0f);
  EXPECT_EQ(view.guess[0], 0.0f) << "outside of the domain there is nothing to know";
}

TEST(Layered, AnswersRotatedViewsOfAnArchiveThatHoldsNothingElse) {
  const synthetic::TemporaryFolder folder;
  const auto path = folder.path() / "a.cdb";
  ProxyHeader header = headerOf(Projection::Orthographic, {{-1, -1, -1}, {1, 1, 1}});
  header.shading = "unlit";
  const ProxyImage image = layeredImage(header, plates(header));
  ArchiveWriter(path, ExistingArchive::Refuse).writeStep({encodeProxy(image)});
  Renderer renderer(device(), std::make_shared<const Archive>(path));
  Look look;
  look.trust = true;
  const Rendered stored = renderer.render(look);
  ASSERT_FALSE(stored.notes.empty());
  EXPECT_NE(stored.notes[0].find("uses layered: 2 piecewise-analytic layers"), std::string::npos);
  EXPECT_EQ(stored.shares.guess, 0.0);
  look.rotate.azimuth = 40.0;
  const Rendered rotated = renderer.render(look);
  EXPECT_GT(rotated.shares.interpolation, 0.1);
  EXPECT_GT(rotated.shares.guess, 0.1);
  look.source = Source::Layers;
  EXPECT_THROW(renderer.render(look), Error);
}

}  // namespace
}  // namespace vestige
