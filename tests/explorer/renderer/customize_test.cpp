// SPDX-License-Identifier: BSD-3-Clause
//
// Position-dependent classification afterwards: pictures against rays in double precision.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "explorer/annotation/draw_seeds.h"
#include "explorer/layers/analytic_layer_pass.h"
#include "explorer/renderer/renderer.h"
#include "proxy/archive/archive.h"
#include "proxy/base/error.h"
#include "proxy/format/layout/field_layout.h"
#include "proxy/gl/device.h"
#include "tests/explorer/synthetic.h"

namespace vestige {
namespace {

constexpr ImageSize kSize{64, 64};

const std::shared_ptr<gl::Device>& device() {
  static const std::shared_ptr<gl::Device> shared = gl::Device::create();
  return shared;
}

/// f = 1 - |x| on points of [-1, 1]^3, as the other synthetic proxies.
ProxyImage fieldProxy(int n) {
  FieldSamples field;
  for (FieldAxis& axis : field.axes) axis = {n, -1.0, 2.0 / (n - 1), {}};
  field.low = -0.75;
  field.high = 1.0;
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const glm::dvec3 at(field.axes[0].at(x), field.axes[1].at(y), field.axes[2].at(z));
        field.values.push_back(float((1.0 - glm::length(at) - field.low) / 1.75));
      }
  ProxyHeader header = synthetic::header(kind::kField, kSize);
  return fieldImage(header, std::move(field), {1, 1e-4});
}

/// An archive of the field, and one of depth layers, lengths and pictures.
class Customizing : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new synthetic::TemporaryFolder;
    ArchiveWriter writer(folder_->path() / "field.cdb", ExistingArchive::Refuse);
    writer.writeStep({encodeProxy(fieldProxy(48))});
    synthetic::writeArchive(folder_->path() / "flat.cdb", kSize, 1);
  }
  static void TearDownTestSuite() { delete folder_; }

  static Rendered rendered(const Look& look, const char* archive = "field.cdb") {
    return Renderer(device(), std::make_shared<const Archive>(folder_->path() / archive))
        .render(look);
  }
  static synthetic::TemporaryFolder* folder_;
};
synthetic::TemporaryFolder* Customizing::folder_ = nullptr;

Look someLook() {
  Look look;
  look.opacity = std::vector<OpacityPoint>{{0.2, 0.0}, {0.5, 0.05}, {0.7, 0.0}, {0.9, 0.3}};
  look.referenceLength = 0.1;
  look.background = std::nullopt;
  look.size = kSize;
  return look;
}

Customization fromText(const std::string& text) {
  return customizationFromJson(nlohmann::json::parse(text));
}

/// Everything at once.
Customization someCustomization() {
  return fromText(R"({"resolution": 32, "corners": {"shift": [0.2, 0, -0.1]}, "seeds": [
    {"position": [-0.5, 0, 0.3], "opacity": 3, "gamma": 0.6},
    {"position": [0.5, 0.1, -0.2], "extent": [0, 0.5, 0], "opacity": 0.2, "gamma": 1.8},
    {"position": [0.1, -0.4, 0.5], "shift": [-0.5, 0.5, 0],
     "function": {"opacity": [[0.1, 0.3], [0.6, 0]], "colormap": "magma"}}]})");
}

double largestDifference(const Picture& a, const Picture& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i)
    most = std::max(most, double(std::abs(a.rgba[i] - b.rgba[i])));
  return most;
}

/// The look of a place, in double precision.
struct Truth {
  TransferFunction base;
  Box box;
  CustomVolume volume;
  std::vector<TransferFunction> functions;
  double low, high;

  Truth(const Look& look, const Customization& customization)
      : base(*synthetic::header(kind::kField, kSize).base),
        box(synthetic::header(kind::kField, kSize).domain),
        volume(customVolume(customization, box)) {
    const ProxyHeader header = synthetic::header(kind::kField, kSize);
    base = TransferFunction(*look.opacity, *look.referenceLength, base.colormap(), base.colorLow(),
                            base.colorHigh());
    low = header.partition->low();
    high = header.partition->high();
    for (const BlendFunction& function : customization.functions())
      functions.push_back(function.over(base));
  }
  double value(glm::dvec3 at) const {
    const double f = (1.0 - glm::length(at) - low) / (high - low);
    return low + (high - low) * (f > 0.0 && f < 1.0 ? std::pow(f, volume.at(at).gamma) : f);
  }
  /// (σ c, σ); with opacity 1 instead of σ where `colors`.
  glm::dvec4 optics(glm::dvec3 at, bool colors = false) const {
    const LocalParameters p = volume.at(at);
    const double v = value(at);
    const auto of = [&](const TransferFunction& function) {
      const double extinction = colors ? 1.0 : function.extinction(v);
      return glm::dvec4(function.color(v) * extinction, extinction);
    };
    glm::dvec4 sum = of(base);
    glm::dvec4 blended(0.0);
    double share = 0.0;
    for (std::size_t i = 0; i < functions.size(); ++i) {
      blended += double(p.shares[int(i)]) * of(functions[i]);
      share += p.shares[int(i)];
    }
    sum = (1.0 - share) * sum + blended;
    if (!(sum.a > 0.0)) return glm::dvec4(0.0);
    const glm::dvec3 color =
        glm::clamp(glm::dvec3(sum) / sum.a + glm::dvec3(p.shift), glm::dvec3(0.0), glm::dvec3(1.0));
    return glm::dvec4(color * sum.a, sum.a) * double(colors ? 1.0f : p.opacity);
  }
  /// Calls with the middle and the length of short steps through the box.
  void walk(const Camera& camera, std::size_t pixel,
            const std::function<void(glm::dvec3, double)>& step) const {
    const Ray ray = camera.rayThrough({double(pixel % std::size_t(kSize.width)) + 0.5,
                                       double(pixel / std::size_t(kSize.width)) + 0.5},
                                      kSize);
    constexpr double kStep = 1.0 / 400.0;
    for (double s = 0.0; s < 20.0; s += kStep) {
      const glm::dvec3 at = ray.origin + (s + 0.5 * kStep) * ray.direction;
      if (glm::clamp(at, box.low, box.high) == at) step(at, kStep);
    }
  }
};

TEST_F(Customizing, ANeutralOneChangesNoPixel) {
  const Customization neutral = fromText(
      R"({"resolution": 32, "seeds": [{"position": [0, 0, 0]}, {"position": [0.5, 0, 0], "opacity": 0,
                     "enabled": false}], "corners": {}})");
  for (const Draw draw : {Draw::Volume, Draw::Mip, Draw::Slice, Draw::Isosurface}) {
    Look look = someLook();
    look.draw = draw;
    const Picture plain = rendered(look).picture;
    look.customization = neutral;
    EXPECT_EQ(rendered(look).picture.rgba, plain.rgba);
  }
}

TEST_F(Customizing, ASeedHidesItsNeighbourhoodAndLeavesTheRest) {
  Look look = someLook();
  const Picture plain = rendered(look).picture;
  // Neutral seeds across the middle keep what is done to the right on the right.
  Customization customization = fromText(R"({"resolution": 32, "seeds": [
    {"position": [0.6, 0, 0.1], "extent": [0.3, 1.8, 0.3], "opacity": 0},
    {"position": [0.6, 0, 0.1], "extent": [0.1, 0.6, 0.1], "opacity": 0}]})");
  for (int y = -2; y <= 2; ++y)
    for (int z = -2; z <= 2; ++z)
      customization.seeds.emplace_back().position = glm::dvec3(0.0, 0.5 * y, 0.5 * z);
  look.customization = customization;
  const Rendered custom = rendered(look);
  const Truth truth(look, *look.customization);
  std::size_t hidden = 0, untouched = 0;
  for (std::size_t i = 0; i < kSize.pixels(); ++i) {
    float least = 1.0f, most = 0.0f;
    truth.walk(custom.camera, i, [&](glm::dvec3 at, double) {
      if (truth.base.extinction(1.0 - glm::length(at)) == 0.0) return;
      const float factor = truth.volume.at(at).opacity;
      least = std::min(least, factor);
      most = std::max(most, factor);
    });
    const float alpha = custom.picture.rgba[4 * i + 3], before = plain.rgba[4 * i + 3];
    if (before < 0.02f) continue;
    if (most < 0.02f) {
      ++hidden;
      EXPECT_LT(alpha, 0.05f * before) << i;
    }
    if (least == 1.0f) {
      ++untouched;
      EXPECT_NEAR(alpha, before, 1e-6f) << i;
    }
  }
  EXPECT_GT(hidden, 10u);
  EXPECT_GT(untouched, 500u);
}

TEST_F(Customizing, AFieldIsDrawnAsRaysInDoublePrecisionSeeIt) {
  Look look = someLook();
  look.rotate = {20.0, 10.0, 0.0};
  look.customization = someCustomization();
  const Rendered custom = rendered(look);
  const Truth truth(look, *look.customization);
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < kSize.pixels(); i += 7) {
    glm::dvec4 light(0.0);
    truth.walk(custom.camera, i, [&](glm::dvec3 at, double length) {
      const glm::dvec4 optics = truth.optics(at);
      if (optics.a == 0.0) return;
      const double alpha = -std::expm1(-optics.a * length);
      light += (1.0 - light.a) * alpha * (optics / optics.a);
    });
    for (int c = 0; c < 4; ++c) {
      const double off = std::abs(light[c] - double(custom.picture.rgba[4 * i + std::size_t(c)]));
      EXPECT_LT(off, 0.05) << i;
      sum += off;
      ++count;
    }
  }
  EXPECT_LT(sum / count, 0.004);
  look.customization.reset();
  EXPECT_GT(largestDifference(rendered(look).picture, custom.picture), 0.2);
}

TEST_F(Customizing, TheGreatestValueIsThatAfterGammaWithTheColourOfItsPlace) {
  Look look = someLook();
  look.draw = Draw::Mip;
  look.customization = someCustomization();
  const Rendered custom = rendered(look);
  const Truth truth(look, *look.customization);
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 5; i < kSize.pixels(); i += 11) {
    double greatest = -1e30;
    glm::dvec3 place(0.0);
    truth.walk(custom.camera, i, [&](glm::dvec3 at, double) {
      const double v = truth.value(at);
      if (v > greatest) greatest = v, place = at;
    });
    if (greatest < -1e29) continue;
    const glm::dvec4 color = truth.optics(place, true);
    for (int c = 0; c < 3; ++c) {
      sum += std::abs(color[c] - double(custom.picture.rgba[4 * i + std::size_t(c)]));
      ++count;
    }
  }
  EXPECT_LT(sum / count, 0.02);
  EXPECT_GT(count, 300);
}

TEST_F(Customizing, SlicesShowTheColoursOfTheirPlaces) {
  Look look = someLook();
  look.draw = Draw::Slice;
  look.slice = glm::dvec4(0.0, 1.0, 0.0, 0.1);
  look.customization = someCustomization();
  const Rendered custom = rendered(look);
  const Truth truth(look, *look.customization);
  for (std::size_t i = 3; i < kSize.pixels(); i += 17) {
    const Ray ray = custom.camera.rayThrough({double(i % 64) + 0.5, double(i / 64) + 0.5}, kSize);
    const glm::dvec3 at = ray.origin + (0.1 - ray.origin.y) / ray.direction.y * ray.direction;
    if (glm::clamp(at, 0.98 * truth.box.low, 0.98 * truth.box.high) != at) continue;
    const glm::dvec4 color = truth.optics(at, true);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(custom.picture.rgba[4 * i + std::size_t(c)], color[c], 0.02) << i;
  }
}

TEST_F(Customizing, DepthLayersTakeFactorAndShiftOfTheirSurfaces) {
  Look look;
  look.background = std::nullopt;
  look.source = Source::Layers;
  look.rotate = {15.0, 0.0, 0.0};
  const Picture plain = rendered(look, "flat.cdb").picture;
  look.customization =
      fromText(R"({"resolution": 32, "corners": {}, "seeds": [{"position": [0, 0, 0]}]})");
  EXPECT_EQ(rendered(look, "flat.cdb").picture.rgba, plain.rgba);
  look.customization = fromText(R"({"resolution": 32, "corners": {"opacity": 0},
                                    "seeds": [{"position": [0, 0, 0], "opacity": 0}]})");
  const Picture nothing = rendered(look, "flat.cdb").picture;
  EXPECT_EQ(*std::max_element(nothing.rgba.begin(), nothing.rgba.end()), 0.0f);
  look.customization = fromText(R"({"resolution": 32, "corners": {"shift": [1, -1, 0]}})");
  const Picture shifted = rendered(look, "flat.cdb").picture;
  for (std::size_t i = 0; i < shifted.rgba.size(); i += 4) {
    EXPECT_NEAR(shifted.rgba[i + 3], plain.rgba[i + 3], 1e-5f);
    EXPECT_NEAR(shifted.rgba[i], shifted.rgba[i + 3], 1e-3f);
    EXPECT_NEAR(shifted.rgba[i + 1], 0.0f, 1e-5f);
    EXPECT_NEAR(shifted.rgba[i + 2], plain.rgba[i + 2], 1e-3f);
  }
  // One side alone.
  look.rotate = {0.0, 0.0, 0.0};
  look.customization.reset();
  const Picture front = rendered(look, "flat.cdb").picture;
  look.customization =
      fromText(R"({"resolution": 32, "corners": [{"opacity": 0}, {}, {"opacity": 0}, {},
                                                {"opacity": 0}, {}, {"opacity": 0}, {}]})");
  const Picture half = rendered(look, "flat.cdb").picture;
  const auto lost = [&](int x) {
    const std::size_t i = 4 * (32 * 64 + std::size_t(x)) + 3;
    return half.rgba[i] / front.rgba[i];
  };
  EXPECT_LT(lost(16), 0.8f * lost(48));
}

/// A medium of one colour in two layers.
TEST(CustomizedLayers, AreHomogeneousMediaOfTheirPlaces) {
  ProxyHeader header = synthetic::header(kind::kLayered, kSize);
  const std::size_t pixels = kSize.pixels();
  AnalyticLayerPlanes planes{2, std::vector<float>(3 * pixels), std::vector<float>(6 * pixels),
                             std::vector<float>(2 * pixels),
                             std::vector<AnalyticLayerState>(pixels, AnalyticLayerState::Whole)};
  const double near = header.camera.project(header.domain.center(), kSize).z - 0.5;
  for (std::size_t p = 0; p < pixels; ++p) {
    for (std::size_t i = 0; i < 3; ++i)
      planes.boundary[i * pixels + p] = float(near + 0.5 * double(i));
    for (std::size_t i = 0; i < 2; ++i) {
      planes.tau[i * pixels + p] = 0.4f;
      planes.color[(3 * i + 1) * pixels + p] = float(-0.5 * std::expm1(-0.4));
    }
  }
  device()->run([&] {
    AnalyticLayerPass pass;
    const AnalyticLayerTextures layers(header, planes);
    const CustomTextures twice(
        fromText(R"({"resolution": 32, "corners": {"opacity": 2, "shift": [0.25, 0, 0]}})"),
        header.domain);
    const CustomTextures behind(
        fromText(R"({"resolution": 32, "corners": [{}, {}, {"opacity": 0}, {"opacity": 0},
                                                         {}, {}, {"opacity": 0}, {"opacity": 0}]})"),
        header.domain);
    const CustomTextures before(
        fromText(R"({"resolution": 32, "corners": [{"opacity": 0}, {"opacity": 0}, {}, {},
                                                         {"opacity": 0}, {"opacity": 0}, {}, {}]})"),
        header.domain);
    const auto middle = [&](const CustomTextures* custom, const Camera& camera) {
      const Picture picture = pass.render(layers, camera, kSize, true, custom).picture;
      const float* pixel = picture.rgba.data() + 4 * (32 * 64 + 32);
      return glm::vec4(pixel[0], pixel[1], pixel[2], pixel[3]);
    };
    const Camera turned = header.camera.orbited(header.domain.center(), 0.4, 0.2, 0.0);
    for (const Camera& camera : {header.camera, turned}) {
      const glm::vec4 plain = middle(nullptr, camera), custom = middle(&twice, camera);
      EXPECT_NEAR(1.0f - custom.a, (1.0f - plain.a) * (1.0f - plain.a), 1e-4f);
      EXPECT_NEAR(custom.r, 0.25f * custom.a, 1e-4f);
      EXPECT_NEAR(custom.g, 0.5f * custom.a, 1e-4f);
      // More is left of the layer on the side whose corners keep their opacity.
      EXPECT_NEAR(middle(&behind, camera).a, middle(&before, camera).a, 0.02f);
      EXPECT_LT(middle(&behind, camera).a, 0.75f * plain.a);
    }
  });
}

TEST_F(Customizing, SourcesWithoutPlacesAndSeedsOutsideAreRefused) {
  const auto sentenceOf = [&](const Look& look, const char* archive) -> std::string {
    try {
      rendered(look, archive);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::Config);
      return error.what();
    }
    return "";
  };
  Look look;
  look.customization = fromText(R"({"resolution": 32, "corners": {"opacity": 0.5}})");
  for (const Source source : {Source::Volume, Source::Mip, Source::Reference}) {
    look.source = source;
    EXPECT_NE(sentenceOf(look, "flat.cdb").find("look key 'customization' needs a source"),
              std::string::npos);
  }
  look.source = Source::Auto;
  EXPECT_EQ(sentenceOf(look, "flat.cdb"), "");  // its depth layers answer
  look.customization =
      fromText(R"({"resolution": 32, "seeds": [{"position": [0, 0, 3], "opacity": 0}]})");
  EXPECT_EQ(sentenceOf(look, "field.cdb"),
            "look key 'customization': seed 0 stands at 0, 0, 3, outside the domain from -1, -1, "
            "-1 to 1, 1, 1");
  look.color = Coloring::Learned;
  EXPECT_THROW(look.validate(), Error);
}

TEST_F(Customizing, LooksKeepIt) {
  Look look = someLook();
  look.customization = someCustomization();
  look.annotations.seeds = Seeds::Identity;
  EXPECT_EQ(lookFromJson(toJson(look)), look);
  EXPECT_EQ(toJson(someLook()).count("customization"), 0u);
  EXPECT_THROW(lookFromText(R"({"annotations": {"seeds": "all"}})"), Error);
}

TEST_F(Customizing, SeedsAreDrawnWhereTheyStandAndFadeWithTheirDistanceFromASlice) {
  Look look = someLook();
  look.opacity = std::vector<OpacityPoint>{{0.0, 0.0}};
  look.customization = fromText(R"({"resolution": 32, "seeds": [
    {"position": [0.5, 0, 0.5], "opacity": 0}, {"position": [-0.5, 0, -0.5], "opacity": 9},
    {"position": [0, 0, -0.8], "opacity": 9, "enabled": false}]})");
  const auto at = [](const Rendered& from, glm::dvec3 world) {
    const glm::ivec3 pixel(from.camera.project(world, kSize));
    const float* p = from.picture.rgba.data() + 4 * (pixel.y * kSize.width + pixel.x);
    return glm::vec4(p[0], p[1], p[2], p[3]);
  };
  const Rendered without = rendered(look);
  EXPECT_EQ(*std::max_element(without.picture.rgba.begin(), without.picture.rgba.end()), 0.0f);
  look.annotations.seeds = Seeds::Value;
  const Rendered value = rendered(look);
  EXPECT_GT(at(value, {0.5, 0, 0.5}).b, 3.0f * at(value, {0.5, 0, 0.5}).r);
  EXPECT_GT(at(value, {-0.5, 0, -0.5}).r, 3.0f * at(value, {-0.5, 0, -0.5}).b);
  EXPECT_EQ(at(value, {0, 0, -0.8}).a, 0.0f);
  look.annotations.seeds = Seeds::Identity;
  const Rendered identity = rendered(look);
  EXPECT_NE(at(identity, {0.5, 0, 0.5}), at(identity, {-0.5, 0, -0.5}));
  look.opacity.reset();
  look.draw = Draw::Slice;
  look.slice = glm::dvec4(0.0, 1.0, 0.0, 0.0);
  const glm::vec4 near = at(rendered(look), {0.5, 0, 0.5});
  look.slice->w = 0.6;
  const glm::vec4 far = at(rendered(look), {0.5, 0, 0.5});
  look.annotations.seeds = Seeds::None;
  const glm::vec4 none = at(rendered(look), {0.5, 0, 0.5});
  EXPECT_LT(glm::length(far - none), 0.5f * glm::length(near - none));
}

}  // namespace
}  // namespace vestige
