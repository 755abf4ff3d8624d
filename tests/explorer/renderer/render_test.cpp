// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "explorer/export/movie.h"
#include "explorer/recomposition/edit_pass.h"
#include "explorer/renderer/renderer.h"
#include "proxy/base/error.h"
#include "proxy/gl/device.h"
#include "tests/explorer/synthetic.h"

namespace vestige {
namespace {

constexpr ImageSize kSize{96, 80};

std::shared_ptr<gl::Device> device() {
  static const std::shared_ptr<gl::Device> shared = gl::Device::create();
  return shared;
}

double largestDifference(const Picture& a, const Picture& b) {
  EXPECT_EQ(a.size, b.size);
  double worst = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    worst = std::max(worst, std::abs(double(a.rgba[i]) - double(b.rgba[i])));
  }
  return worst;
}

double meanDifference(const Picture& a, const Picture& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    sum += std::abs(double(a.rgba[i]) - double(b.rgba[i]));
  }
  return sum / double(a.rgba.size());
}

/// One archive for all tests of this file.
class Rendering : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new synthetic::TemporaryFolder;
    synthetic::writeArchive(folder_->path() / "spheres.cdb", kSize, 3);
  }
  static void TearDownTestSuite() { delete folder_; }

  std::shared_ptr<const Archive> archive() const {
    return std::make_shared<const Archive>(folder_->path() / "spheres.cdb");
  }
  Picture picture(const Look& look) const {
    return Renderer(device(), archive()).render(look).picture;
  }

  /// The true picture of the scene under a look's function, over black.
  Picture truth(const ChannelTable& table) const {
    const ProxyHeader header = synthetic::header(kind::kLength, kSize);
    Picture result = Picture::blank(kSize);
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < kSize.width; ++x) {
        const auto color = synthetic::composite(synthetic::trueSegments(header, x, y), table);
        for (std::size_t c = 0; c < 4; ++c) result.pixel(x, y)[c] = float(color[c]);
      }
    }
    return result;
  }

  static synthetic::TemporaryFolder* folder_;
};
synthetic::TemporaryFolder* Rendering::folder_ = nullptr;

Look transparentLook() {
  Look look;
  look.background = std::nullopt;
  return look;
}

TEST(Edit, EqualsTheFormulaForEverySegmentList) {
  const ProxyImage proxy = synthetic::lengthProxy(kSize);
  const SegmentLists lists = segmentsFromLength(lengthPlanes(proxy), Order::Runs);
  const ChannelTable table = tableForLength(synthetic::someLook(*proxy.header.partition));
  Picture picture;
  device()->run([&] {
    EditPass pass;
    picture = pass.render(SegmentTextures(lists), table);
  });
  for (std::size_t i = 0; i < kSize.pixels(); ++i) {
    const auto expected = synthetic::composite(lists.at(i), table);
    for (std::size_t c = 0; c < 4; ++c) {
      ASSERT_NEAR(picture.rgba[4 * i + c], expected[c], 1e-3) << "pixel " << i;
    }
  }
}

TEST(Edit, RefusesATableThatIsTooLong) {
  const SegmentLists lists{{1, 1}, 1.0, {SegmentLists::kNone}, {}};
  constexpr std::size_t kTooMany = SegmentLists::kMostChannel + 1;
  const ChannelTable table{std::vector<double>(kTooMany, 0.0), std::vector<glm::dvec3>(kTooMany)};
  try {
    device()->run([&] { EditPass().render(SegmentTextures(lists), table); });
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::InvalidArgument);
  }
}

TEST(Edit, TakesMoreChannelsThanUniformsHold) {
  constexpr int kChannels = 259;
  SegmentLists lists{{1, 1}, 1.0, {0}, {}};
  ChannelTable table;
  std::vector<Segment> segments;
  for (int k = 0; k < kChannels; ++k) {
    lists.entries.push_back(amountBits(0.01f) | std::uint32_t(k) << 16 |
                            (k + 1 == kChannels ? SegmentLists::kLast : 0u));
    segments.push_back({k, float(amountValue(amountBits(0.01f)))});
    table.strength.push_back(0.3 + 0.01 * (k % 37));
    table.color.emplace_back(k % 5 / 4.0, k % 7 / 6.0, k % 11 / 10.0);
  }
  const auto wanted = synthetic::composite(segments, table);
  device()->run([&] {
    EditPass pass;
    const SegmentTextures textures(lists);
    const Picture picture = pass.render(textures, table);
    for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(picture.rgba[c], wanted[c], 1e-3);
    EXPECT_EQ(pass.doubt(textures, table)[0], 0.0f);
  });
}

TEST_F(Rendering, ALookThatEditsNothingIsTheRunsOwnPicture) {
  const auto says = [&](const Look& look) {
    return Renderer(device(), archive()).render(look).notes.front();
  };
  Look look = transparentLook();
  look.source = Source::Reference;
  const Picture own = picture(look);
  look.source = Source::Auto;
  look.trust = true;
  const Rendered rendered = Renderer(device(), archive()).render(look);
  EXPECT_EQ(rendered.picture.rgba, own.rgba);
  EXPECT_EQ(rendered.shares.data, 1.0);
  EXPECT_NE(rendered.notes.front().find("uses reference"), std::string::npos);
  EXPECT_NE(rendered.notes.back().find("it is exact"), std::string::npos);

  // The run's own numbers, given once more, are no edit.
  const Look resolved = Renderer(device(), archive()).resolved(look);
  ASSERT_TRUE(resolved.opacity && resolved.colorRange && resolved.referenceLength);
  EXPECT_EQ(resolved.colormap, "viridis");
  EXPECT_EQ(picture(resolved).rgba, own.rgba);
  look.factors = std::vector<double>(synthetic::kIntervals, 1.0);
  EXPECT_EQ(picture(look).rgba, own.rgba);

  std::vector<Look> edits(9, transparentLook());
  edits[0].opacity = {{0.0, 0.1}, {1.0, 0.2}};
  edits[1].colormap = "hot";
  edits[2].colorRange = {0.0, 0.5};
  edits[3].referenceLength = 0.2;
  edits[4].factors = {1, 1, 0.5, 1, 1};
  edits[5].enhance.on = true;
  edits[6].shading = Shading::Phong;
  edits[7].via = Via::Length;
  edits[8].ao.on = true;
  for (const Look& edit : edits) EXPECT_NE(says(edit).find("uses length"), std::string::npos);
  // What is forced holds.
  look = transparentLook();
  look.source = Source::Volume;
  EXPECT_NE(says(look).find("uses length"), std::string::npos);
  // All frames of a turn are drawn alike.
  for (const Look& frame : looksOfTurn(transparentLook(), 40.0, 4))
    EXPECT_EQ(says(frame).find("uses reference"), std::string::npos);
  for (const Look& frame : looksOverTime(transparentLook(), *archive()))
    EXPECT_NE(says(frame).find("uses reference"), std::string::npos);
}

TEST_F(Rendering, RecomposesNestedShellsExactly) {
  const ProxyHeader header = synthetic::header(kind::kLength, kSize);
  const Picture expected = truth(tableForLength(header.base->onIntervals(*header.partition)));
  EXPECT_LT(largestDifference(picture(transparentLook()), expected), 1.0 / 255.0);
}

TEST_F(Rendering, FollowsAnEditOfOpacityAndColour) {
  Look look = transparentLook();
  look.opacity = std::vector<OpacityPoint>{{0.0, 0.0}, {0.3, 0.2}, {0.5, 0.0}, {0.9, 0.8}};
  look.colormap = "coolwarm";
  TransferFunction function = *synthetic::header(kind::kLength, kSize).base;
  function.setOpacity(*look.opacity);
  function.setColormap(Colormap::named("coolwarm"));
  const auto partition = *synthetic::header(kind::kLength, kSize).partition;
  const Picture expected = truth(tableForLength(function.onIntervals(partition)));
  EXPECT_LT(largestDifference(picture(look), expected), 1.0 / 255.0);
}

TEST_F(Rendering, HidesWhatHasFactorZero) {
  Look look = transparentLook();
  look.factors = std::vector<double>(synthetic::kIntervals, 0.0);
  look.opacity = std::vector<OpacityPoint>{{-0.5, 0.0}, {0.0, 0.0}, {0.2, 0.5}, {1.0, 0.5}};
  const Picture hidden = picture(look);
  for (float value : hidden.rgba) ASSERT_EQ(value, 0.0f);
  look.factors[4] = 1.0;
  const Picture core = picture(look);
  EXPECT_GT(core.pixel(kSize.width / 2, kSize.height / 2)[3], 0.1f);
  EXPECT_EQ(core.pixel(kSize.width / 2, kSize.height / 4)[3], 0.0f);
}

TEST_F(Rendering, RecoversTheBasePictureFromAttenuationWhereOneIntervalIsSeen) {
  // One visible interval: no order to assume, so both proxies give the same picture.
  Look look = transparentLook();
  look.factors = {0.0, 0.0, 0.0, 0.0, 1.0};
  look.opacity = std::vector<OpacityPoint>{{-0.1, 0.0}, {0.0, 0.05}, {0.5, 0.1}, {1.0, 0.3}};
  const Picture byLength = picture(look);
  look.via = Via::Attenuation;
  const Picture byAttenuation = picture(look);
  EXPECT_GT(byLength.pixel(kSize.width / 2, kSize.height / 2)[3], 0.1f);
  // The core is behind what the base shows of the other shells, once in front and once behind.
  EXPECT_LT(meanDifference(byLength, byAttenuation), 0.05);
}

TEST_F(Rendering, ReproducesTheReferenceFromAttenuationUnderTheBaseFunction) {
  Look look = transparentLook();
  look.via = Via::Attenuation;
  const Picture attenuation = picture(look);
  look.via = Via::Auto;
  look.source = Source::Reference;
  const Picture reference = picture(look);
  // Σ a_k c_k is the picture itself, whatever the order, for unchanged opacities.
  EXPECT_LT(largestDifference(attenuation, reference), 2.0 / 255.0);
}

TEST_F(Rendering, TurnedByNothingIsTheStoredView) {
  Look look = transparentLook();
  look.factors = {0.0, 1.0, 0.0, 1.0, 1.0};
  look.source = Source::Layers;
  const Picture warped = picture(look);
  look.source = Source::Volume;
  const Picture volume = picture(look);
  // A layer draws the segments of its intervals together, so shells seen twice blend a little.
  EXPECT_LT(meanDifference(warped, volume), 0.02);
  for (int y = 1; y + 1 < kSize.height; ++y) {
    for (int x = 1; x + 1 < kSize.width; ++x) {
      ASSERT_NEAR(warped.pixel(x, y)[3], volume.pixel(x, y)[3], 0.02) << x << ", " << y;
    }
  }
}

TEST_F(Rendering, SeesASphereFromElsewhereWhereItIs) {
  Look look = transparentLook();
  look.opacity = std::vector<OpacityPoint>{{0.45, 0.0}, {0.5, 0.99}, {1.0, 0.99}};
  look.rotate = {20.0, 10.0, 0.0};
  look.source = Source::Layers;
  Renderer renderer(device(), archive());
  const Rendered rendered = renderer.render(look);
  ASSERT_EQ(rendered.depth.size(), kSize.pixels());
  // What is opaque begins at radius 0.55; the layer that draws it is the sphere of radius 0.5.
  double squared = 0.0;
  int count = 0;
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      const Ray ray = rendered.camera.rayThrough({x + 0.5, y + 0.5}, kSize);
      const double along = -glm::dot(ray.origin, ray.direction);
      const double off = glm::length(ray.origin + along * ray.direction);
      const float z = rendered.depth[std::size_t(y * kSize.width + x)];
      if (off > 0.85) {
        EXPECT_FALSE(std::isfinite(z)) << x << ", " << y;
      }
      if (off > 0.4 || !std::isfinite(z)) continue;
      const double error = double(z) - (along - std::sqrt(0.25 - off * off));
      squared += error * error;
      ++count;
    }
  }
  ASSERT_GT(count, 300);
  EXPECT_LT(std::sqrt(squared / count), 0.02) << "a pixel is 0.036 wide";
}

TEST_F(Rendering, LightsASphereByTheCosineRule) {
  Look look = transparentLook();
  look.factors = {0.0, 0.0, 0.0, 1.0, 1.0};
  look.opacity = std::vector<OpacityPoint>{{0.55, 0.0}, {0.6, 0.9}, {1.0, 0.9}};
  look.shading = Shading::Phong;
  look.material = {0.0, 1.0, 0.0, 10.0};
  for (NormalSource normals : {NormalSource::Stored, NormalSource::Depth}) {
    look.normals = normals;
    look.lights = {{0.0, 0.0, 1.0}};
    const Picture front = picture(look);
    look.lights = {{60.0, 0.0, 1.0}};
    const Picture side = picture(look);
    look.shading = Shading::None;
    const Picture plain = picture(look);
    look.shading = Shading::Phong;
    const int x = kSize.width / 2, y = kSize.height / 2;
    EXPECT_NEAR(front.pixel(x, y)[1] / plain.pixel(x, y)[1], 1.0, 0.02);
    EXPECT_NEAR(side.pixel(x, y)[1] / plain.pixel(x, y)[1], 0.5, 0.05);
    // Light from the right: the right side is brighter than the left.
    EXPECT_GT(side.pixel(x + 7, y)[1], 1.5f * side.pixel(x - 7, y)[1]);
  }
}

TEST_F(Rendering, LightFromAboveShinesOnTheUpperHalf) {
  Look look = transparentLook();
  look.factors = {0.0, 0.0, 0.0, 1.0, 1.0};
  look.shading = Shading::Phong;
  look.lights = {{0.0, 60.0, 1.0}};
  for (NormalSource normals : {NormalSource::Stored, NormalSource::Depth}) {
    look.normals = normals;
    const Picture lit = picture(look);
    const int x = kSize.width / 2, y = kSize.height / 2;
    EXPECT_GT(lit.pixel(x, y - 7)[1], lit.pixel(x, y + 7)[1]);
  }
}

TEST_F(Rendering, AmbientOcclusionDarkensNothingOnAConvexBody) {
  Look look = transparentLook();
  look.factors = {0.0, 0.0, 0.0, 0.0, 1.0};
  const Picture plain = picture(look);
  look.ao.on = true;
  EXPECT_LT(meanDifference(picture(look), plain), 0.01);
}

TEST_F(Rendering, EnhancementDarkensEdgesAndNothingElse) {
  Look look = transparentLook();
  look.factors = {0.0, 0.0, 0.0, 0.0, 1.0};
  look.opacity = std::vector<OpacityPoint>{{0.75, 0.0}, {0.8, 0.99}, {1.0, 0.99}};
  const Picture plain = picture(look);
  look.enhance = {true, 5.0, 1.0};
  const Picture enhanced = picture(look);
  double before = 0.0, after = 0.0;
  for (std::size_t i = 0; i < plain.rgba.size(); i += 4) {
    ASSERT_LE(enhanced.rgba[i], plain.rgba[i] + 1e-6f);
    ASSERT_EQ(enhanced.rgba[i + 3], plain.rgba[i + 3]);
    before += double(plain.rgba[i + 1]);
    after += double(enhanced.rgba[i + 1]);
  }
  EXPECT_LT(after, 0.97 * before);
  const int x = kSize.width / 2, y = kSize.height / 2;
  EXPECT_NEAR(enhanced.pixel(x, y)[1], plain.pixel(x, y)[1], 0.02);
}

TEST_F(Rendering, TrustIsDataWhereOneIntervalIsSeenAndDoubtWhereOrdersMatter) {
  Look look = transparentLook();
  look.trust = true;
  look.factors = {0.0, 0.0, 0.0, 0.0, 1.0};
  look.opacity = std::vector<OpacityPoint>{{0.0, 0.0}, {0.01, 0.5}, {1.0, 0.5}};
  Renderer renderer(device(), archive());
  EXPECT_GT(renderer.render(look).shares.data, 0.99);
  // Rotated views are interpolated at best, and the farther the more they guess.
  double guessed = -1.0;
  for (double azimuth : {5.0, 40.0}) {
    look.rotate = {azimuth, 0.0, 0.0};
    const TrustShares turned = renderer.render(look).shares;
    EXPECT_EQ(turned.data, 0.0);
    EXPECT_NEAR(turned.interpolation + turned.guess, 1.0, 1e-9);
    EXPECT_GT(turned.guess, guessed);
    guessed = turned.guess;
  }
  EXPECT_GT(guessed, 0.02);
}

TEST_F(Rendering, ShowsTheLargestValueByMip) {
  Look look = transparentLook();
  look.source = Source::Mip;
  const Picture mip = picture(look);
  const TransferFunction& base = *synthetic::header(kind::kMip, kSize).base;
  const glm::dvec3 center = base.color(1.0);
  EXPECT_NEAR(mip.pixel(kSize.width / 2, kSize.height / 2)[1], center.y, 0.05);
}

TEST_F(Rendering, GivesTheSamePictureAgainAfterOtherLooks) {
  Renderer renderer(device(), archive());
  const Look look = transparentLook();
  const Picture first = renderer.render(look).picture;
  Look other = look;
  other.rotate = {15.0, 5.0, 0.0};
  other.shading = Shading::Phong;
  renderer.render(other);
  other.cycle = 10;
  renderer.render(other);
  EXPECT_EQ(largestDifference(renderer.render(look).picture, first), 0.0);
}

TEST_F(Rendering, AgreesOnBothBackends) {
  Look look = transparentLook();
  look.shading = Shading::Phong;
  look.ao.on = true;
  std::vector<Picture> pictures;
  for (const char* backend : {"osmesa", "egl"}) {
    Renderer renderer(gl::Device::create(backend), archive());
    pictures.push_back(renderer.render(look).picture);
    look.rotate = {0.0, 0.0, 0.0};
  }
  EXPECT_LT(largestDifference(pictures[0], pictures[1]), 1.0 / 255.0);
}

TEST_F(Rendering, NamesWhatTheArchiveHasInstead) {
  Renderer renderer(device(), archive());
  const auto refused = [&](const Look& look, const char* word, ErrorCode code) {
    try {
      renderer.render(look);
      ADD_FAILURE() << word;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), code);
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  Look look;
  look.cycle = 5;
  refused(look, "0, 10, 20", ErrorCode::NotFound);
  look = Look{};
  look.field = "pressure";
  refused(look, "density", ErrorCode::NotFound);
  look = Look{};
  look.view = "top";
  refused(look, "front", ErrorCode::NotFound);
  look = Look{};
  look.factors = {1.0, 2.0};
  refused(look, "5 intervals", ErrorCode::Config);
  look = Look{};
  look.rotate.azimuth = 10.0;
  look.source = Source::Mip;
  refused(look, "source", ErrorCode::Config);
}

TEST_F(Rendering, TakesTheStepNearestToATime) {
  Look look;
  look.time = 0.6;
  EXPECT_EQ(cycleOf(look, *archive()), 10);
  EXPECT_EQ(cycleOf(Look{}, *archive()), 20);
}

TEST_F(Rendering, FitsAnySizeAndAnnotates) {
  Look look;
  look.size = ImageSize{200, 90};
  look.annotations = {true, true, true, true};
  look.background = glm::dvec3(1.0);
  const Picture result = picture(look);
  EXPECT_EQ(result.size, (ImageSize{200, 90}));
  for (std::size_t i = 3; i < result.rgba.size(); i += 4) ASSERT_NEAR(result.rgba[i], 1.0f, 1e-5);
}

}  // namespace
}  // namespace vestige
