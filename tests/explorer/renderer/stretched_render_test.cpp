// SPDX-License-Identifier: BSD-3-Clause
//
// Looks that zoom, pan and stretch: every source shows the same place at the same pixel, and a
// stretched world is a world that was stored so.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "explorer/renderer/renderer.h"
#include "proxy/base/error.h"
#include "proxy/format/layout/field_layout.h"
#include "proxy/gl/device.h"
#include "tests/explorer/synthetic.h"

namespace vestige {
namespace {

constexpr ImageSize kSize{96, 80};
constexpr int kSamples = 40;

std::shared_ptr<gl::Device> device() {
  static const std::shared_ptr<gl::Device> shared = gl::Device::create();
  return shared;
}

/// 1 - |x - (0.2, 0, 0.1)| on points of [-1, 1]^3, of which z is then stored `high` times as long.
ProxyImage fieldProxy(double high) {
  FieldSamples field;
  for (FieldAxis& axis : field.axes) axis = {kSamples, -1.0, 2.0 / (kSamples - 1), {}};
  field.low = -1.5;
  field.high = 1.0;
  for (int z = 0; z < kSamples; ++z) {
    for (int y = 0; y < kSamples; ++y) {
      for (int x = 0; x < kSamples; ++x) {
        const glm::dvec3 at(field.axes[0].at(x), field.axes[1].at(y), field.axes[2].at(z));
        const double value = 1.0 - glm::length(at - glm::dvec3(0.2, 0.0, 0.1));
        field.values.push_back(float((value - field.low) / 2.5));
      }
    }
  }
  field.axes[2].first *= high;
  field.axes[2].spacing *= high;
  ProxyHeader header = synthetic::header(kind::kField, kSize);
  header.domain.low.z *= high;
  header.domain.high.z *= high;
  return fieldImage(header, std::move(field), {1, 1e-4});
}

double meanDifference(const Picture& a, const Picture& b) {
  EXPECT_EQ(a.size, b.size);
  double sum = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i)
    sum += std::abs(double(a.rgba[i]) - double(b.rgba[i]));
  return sum / double(a.rgba.size());
}

/// Width and height of what can be seen, in pixels, by the area that is at least half as opaque as
/// the most opaque.
glm::dvec2 extentOf(const Picture& picture) {
  float most = 0.0f;
  for (std::size_t i = 3; i < picture.rgba.size(); i += 4) most = std::max(most, picture.rgba[i]);
  int low[2] = {1 << 20, 1 << 20}, high[2] = {-1, -1};
  for (int y = 0; y < picture.size.height; ++y) {
    for (int x = 0; x < picture.size.width; ++x) {
      if (picture.pixel(x, y)[3] < 0.5f * most) continue;
      low[0] = std::min(low[0], x), high[0] = std::max(high[0], x);
      low[1] = std::min(low[1], y), high[1] = std::max(high[1], y);
    }
  }
  return {high[0] - low[0] + 1, high[1] - low[1] + 1};
}

class Stretched : public testing::Test {
 protected:
  std::unique_ptr<Renderer> open(const char* name, const std::vector<ProxyImage>& images) {
    ArchiveWriter writer(folder_.path() / name, ExistingArchive::Overwrite);
    std::vector<EncodedProxy> proxies;
    for (const ProxyImage& image : images) proxies.push_back(encodeProxy(image));
    writer.writeStep(proxies);
    return std::make_unique<Renderer>(device(),
                                      std::make_shared<const Archive>(folder_.path() / name));
  }
  /// Everything of the centred ball, from one view.
  std::unique_ptr<Renderer> ball() {
    return open("ball.cdb",
                {synthetic::lengthProxy(kSize), synthetic::depthProxy(kSize, {0.3, 0.6}),
                 synthetic::mipProxy(kSize), synthetic::referenceProxy(kSize)});
  }
  synthetic::TemporaryFolder folder_;
};

Look solid() {
  Look look;
  look.opacity = std::vector<OpacityPoint>{{0.35, 0.0}, {0.4, 0.5}};
  look.background = std::nullopt;
  return look;
}

TEST_F(Stretched, AStretchedWorldIsOneThatWasStoredSo) {
  const auto own = open("own.cdb", {fieldProxy(1.0)}), high = open("high.cdb", {fieldProxy(2.0)});
  Look base = solid();
  base.frame = Frame::Fit;
  base.size = kSize;
  base.rotate = {35.0, 25.0, 10.0};
  base.referenceLength = 0.1;
  Look lit = base, open = base, surface = base, slice = base, clip = base;
  lit.shading = Shading::Phong;
  open.ao.on = true;
  surface.draw = Draw::Isosurface;
  surface.isosurfaces = {{0.5, 0.6}, {0.8, 1.0}};
  slice.draw = Draw::Slice;
  slice.slice = glm::dvec4(0.5, 0.3, 1.0, 0.2);
  clip.clip = Box{{-1.0, -1.0, -0.5}, {0.5, 0.2, 0.4}};
  for (Look look : {base, lit, open, surface, slice, clip}) {
    Look other = look;
    look.scale = {1.0, 1.0, 2.0};
    // The same share of a diagonal that is sqrt(2) times as long.
    *other.referenceLength *= std::sqrt(2.0);
    if (other.slice) other.slice->z /= 2.0;
    if (other.clip) other.clip->low.z *= 2.0, other.clip->high.z *= 2.0;
    const Picture stretched = own->render(look).picture;
    EXPECT_LT(meanDifference(stretched, high->render(other).picture), 2e-3);
    look.scale = {0.5, 0.5, 1.0};
    EXPECT_LT(meanDifference(stretched, own->render(look).picture), 1e-6)
        << "only proportions count";
    look.scale = glm::dvec3(1.0);
    EXPECT_GT(meanDifference(stretched, own->render(look).picture), 5e-3);
    EXPECT_GT(extentOf(stretched).y, 10.0);
  }
}

TEST_F(Stretched, LayersAndFieldsStretchABallAlike) {
  const auto layers = ball();
  Look look = solid();
  look.factors = {0.0, 0.0, 0.0, 1.0, 1.0};  // one surface
  look.opacity = std::vector<OpacityPoint>{{0.55, 0.0}, {0.6, 0.9}, {1.0, 0.9}};
  look.scale = {1.0, 1.0, 2.0};
  look.shading = Shading::Phong;
  look.lights = {{0.0, 60.0, 1.0}};
  look.material = {0.0, 1.0, 0.0, 10.0};
  for (const NormalSource normals : {NormalSource::Stored, NormalSource::Depth}) {
    look.normals = normals;
    const Picture picture = layers->render(look).picture;
    const glm::dvec2 extent = extentOf(picture);
    EXPECT_NEAR(extent.y / extent.x, 2.0, 0.15);
    // Of the ellipsoid the normal at (0, -0.6 z) of its front leans up half as much as the ball's.
    const int x = kSize.width / 2, y = int(0.5 * kSize.height - 0.3 * extent.y);
    const double up = 0.6 / 2.0, ahead = 0.8, length = std::hypot(up, ahead);
    const double wanted = (up * std::sin(1.0472) + ahead * std::cos(1.0472)) / length;
    Look flat = look;
    flat.shading = Shading::None;
    EXPECT_NEAR(picture.pixel(x, y)[1] / layers->render(flat).picture.pixel(x, y)[1], wanted, 0.08);
  }
}

TEST_F(Stretched, PicturesThatHaveNoPlacesRefuseToBeStretched) {
  const auto renderer = ball();
  for (const Source source : {Source::Volume, Source::Mip, Source::Reference}) {
    Look look = solid();
    look.scale = {1.0, 1.0, 2.0};
    look.source = source;
    try {
      renderer->render(look);
      ADD_FAILURE();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::Config);
      EXPECT_NE(std::string(error.what()).find("stretched"), std::string::npos) << error.what();
    }
  }
}

TEST_F(Stretched, ZoomAndPanShowTheSamePlaceWhateverAnswers) {
  const auto flat = ball();
  Look look = solid();
  look.zoom = 1.3;
  look.pan = {0.05, -0.04};
  Look plain = solid();
  const glm::dvec2 before = extentOf(flat->render(plain).picture);
  for (const Source source : {Source::Volume, Source::Layers}) {
    look.source = source;
    const Rendered rendered = flat->render(look);
    const glm::dvec2 extent = extentOf(rendered.picture);
    EXPECT_NEAR(extent.x / before.x, 1.3, 0.06);
    EXPECT_NEAR(extent.y / before.y, 1.3, 0.06);
    EXPECT_EQ(rendered.cast, source == Source::Layers);
    // The ball's middle is where the picture's own camera says.
    const glm::dvec3 middle = rendered.camera.project(glm::dvec3(0.0), kSize);
    double sum = 0.0, x = 0.0, y = 0.0;
    for (int row = 0; row < kSize.height; ++row) {
      for (int column = 0; column < kSize.width; ++column) {
        const double alpha = rendered.picture.pixel(column, row)[3];
        sum += alpha, x += alpha * (column + 0.5), y += alpha * (row + 0.5);
      }
    }
    EXPECT_NEAR(x / sum, middle.x, 0.5);
    EXPECT_NEAR(y / sum, middle.y, 0.5);
    EXPECT_NEAR(middle.x, 0.5 * kSize.width + 0.05 * kSize.height, 1e-6);
    EXPECT_NEAR(middle.y, 0.5 * kSize.height + 0.04 * kSize.height, 1e-6);
  }
  look.source = plain.source = Source::Reference;
  const Rendered reference = flat->render(look);
  EXPECT_FALSE(reference.cast);
  EXPECT_GT(meanDifference(reference.picture, flat->render(plain).picture), 0.01);
}

TEST_F(Stretched, TurnedPicturesAreNotCropped) {
  const auto renderer = open("own.cdb", {fieldProxy(1.0)});
  Look look;
  look.background = std::nullopt;
  look.opacity = std::vector<OpacityPoint>{{-2.0, 0.3}, {2.0, 0.3}};  // all of the box
  look.rotate = {45.0, 35.0, 0.0};
  const Picture whole = renderer->render(look).picture;
  const auto touches = [](const Picture& picture) {
    float most = 0.0f;
    for (int x = 0; x < picture.size.width; ++x) {
      most = std::max({most, picture.pixel(x, 0)[3], picture.pixel(x, picture.size.height - 1)[3]});
    }
    return most > 0.0f;
  };
  EXPECT_FALSE(touches(whole));
  look.frame = Frame::Stored;
  EXPECT_TRUE(touches(renderer->render(look).picture));
}

}  // namespace
}  // namespace vestige
