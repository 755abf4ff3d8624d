// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/volume/surface_palette.h"

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

TransferFunction greys() {
  TransferFunction function({{0.2, 0.0}, {0.3, 0.5}, {0.4, 0.0}, {0.7, 0.9}, {0.8, 0.0}}, 1.0,
                            Colormap::named("grey"), 0.0, 1.0);
  return function;
}

TEST(Surfaces, HaveOneColourEachUnlessTheyAskForAnother) {
  Look look;
  look.draw = Draw::Isosurface;
  for (int i = 0; i < int(kMaxIsosurfaces); ++i) look.isosurfaces.push_back({0.1 * i, 1.0});
  const auto own = surfacesOf(look, greys());
  ASSERT_EQ(own.size(), kMaxIsosurfaces);
  for (std::size_t i = 0; i < own.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_GT(glm::length(srgbFromLinear(own[i].color) - srgbFromLinear(own[j].color)), 0.15);
    EXPECT_GT(srgbFromLinear(own[i].color).x + srgbFromLinear(own[i].color).y, 0.5) << "not dark";
  }
  look.isosurfaces = {{0.5, 1.0, "map"}, {0.5, 0.5, "#ff0000"}};
  const auto asked = surfacesOf(look, greys());
  EXPECT_LT(glm::length(asked[0].color - greys().color(0.5)), 1e-12);
  EXPECT_LT(glm::length(asked[1].color - glm::dvec3(1.0, 0.0, 0.0)), 1e-12);
  EXPECT_EQ(asked[1].opacity, 0.5);
  look.isosurfaces.clear();
  const auto peaks = surfacesOf(look, greys());
  ASSERT_EQ(peaks.size(), 2u);
  EXPECT_EQ(peaks[0].color, own[0].color);
}

/// A ball of values 1 - |x|.
class DrawnSurfaces : public testing::Test {
 protected:
  void SetUp() override {
    FieldSamples field;
    for (FieldAxis& axis : field.axes) axis = {32, -1.0, 2.0 / 31.0, {}};
    field.low = -0.75;
    field.high = 1.0;
    for (int i = 0; i < 32 * 32 * 32; ++i) {
      const glm::dvec3 at(field.axes[0].at(i % 32), field.axes[1].at(i / 32 % 32),
                          field.axes[2].at(i / 1024));
      field.values.push_back(float((1.0 - glm::length(at) - field.low) / 1.75));
    }
    const auto path = folder_.path() / "ball.cdb";
    {
      ArchiveWriter writer(path, ExistingArchive::Refuse);
      writer.writeStep(std::vector<EncodedProxy>{encodeProxy(
          fieldImage(synthetic::header(kind::kField, {64, 64}), std::move(field), {1, 1e-4}))});
    }
    renderer_ =
        std::make_unique<Renderer>(gl::Device::create(), std::make_shared<const Archive>(path));
    look_.draw = Draw::Isosurface;
    look_.isosurfaces = {{0.5, 1.0, "#808080"}};
    look_.background = std::nullopt;
    look_.size = ImageSize{64, 64};
  }
  synthetic::TemporaryFolder folder_;
  std::unique_ptr<Renderer> renderer_;
  Look look_;
};

TEST_F(DrawnSurfaces, AreLitByAHeadlightAlittleOffTheAxisUnlessTheyShallNot) {
  const Picture lit = renderer_->render(look_).picture;
  look_.shading = Shading::None;
  const Picture flat = renderer_->render(look_).picture;
  const double own = linearFromSrgb(glm::dvec3(128.0 / 255.0)).x;
  EXPECT_NEAR(flat.pixel(32, 32)[0], own, 1e-3);
  EXPECT_NEAR(flat.pixel(32, 20)[0], own, 1e-3);
  // Brightest up and right of the middle, dim at the lower left rim, nowhere black.
  EXPECT_GT(lit.pixel(35, 28)[0], lit.pixel(24, 40)[0]);
  EXPECT_GT(lit.pixel(32, 32)[0], 0.9 * own);
  EXPECT_LT(lit.pixel(22, 42)[0], 0.8 * own);
  EXPECT_GT(lit.pixel(22, 42)[0], 0.3 * own);
}

TEST_F(DrawnSurfaces, StandInALegendWithTheirValues) {
  look_.annotations.colorbar = true;
  look_.size = ImageSize{256, 256};
  look_.background = glm::dvec3(0.0);
  const Picture one = renderer_->render(look_).picture;
  look_.isosurfaces[0].color = "map";  // the colour bar says it all
  const Picture mapped = renderer_->render(look_).picture;
  look_.isosurfaces = {{0.5, 1.0, "#808080"}, {0.9, 1.0, "#00ff00"}};
  const Picture two = renderer_->render(look_).picture;
  const auto greens = [](const Picture& picture) {
    int count = 0;
    for (std::size_t i = 0; i < picture.rgba.size(); i += 4)
      count += picture.rgba[i + 1] > 0.95f && picture.rgba[i] < 0.05f;
    return count;
  };
  EXPECT_EQ(greens(one), 0);
  EXPECT_GT(greens(two), 80) << "the sample of the inner surface, which is hidden itself";
  EXPECT_NE(one.rgba, mapped.rgba);
}

}  // namespace
}  // namespace vestige
