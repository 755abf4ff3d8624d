// SPDX-License-Identifier: BSD-3-Clause
//
// Multi-perspective views: what can be seen of them from elsewhere.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "explorer/export/export.h"
#include "explorer/inspect/info.h"
#include "explorer/layers/radiality.h"
#include "explorer/layers/virtual_pass.h"
#include "explorer/renderer/renderer.h"
#include "proxy/base/error.h"
#include "proxy/format/layout/proxy_layout.h"
#include "proxy/gl/device.h"
#include "tests/explorer/synthetic.h"

namespace vestige {
namespace {

constexpr ImageSize kSize{160, 160};
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr double kRadius = 0.5;

ProxyHeader headerOf(bool distorted) {
  ProxyHeader header = synthetic::header(kind::kDepth, kSize);
  header.isovalues = {1.0 - kRadius};
  if (!distorted) return header;
  header.view = "front_distorted";
  header.camera = frameBoxDistorted(header.domain, {0, 1, 0}, {0, 0, 1}, 1.0);
  return header;
}

/// The length to a ray's first point of a ball around `centre`; infinite where it misses.
double reach(const Ray& ray, glm::dvec3 centre, double radius) {
  const glm::dvec3 offset = ray.origin - centre;
  const double b = -glm::dot(offset, ray.direction);
  const double rest = b * b - glm::dot(offset, offset) + radius * radius;
  if (rest <= 0.0) return HUGE_VAL;
  const double s = b - std::sqrt(rest);
  return s >= 0.0 && s * ray.depthPerLength <= ray.lastDepth ? s : HUGE_VAL;
}

Ray rayOf(const Camera& camera, std::size_t pixel, ImageSize size = kSize) {
  const auto width = std::size_t(size.width);
  return camera.rayThrough({double(pixel % width) + 0.5, double(pixel / width) + 0.5}, size);
}

/// A depth layer of the ball with its normals.
ProxyImage ball(bool distorted) {
  const ProxyHeader header = headerOf(distorted);
  const std::size_t pixels = kSize.pixels();
  std::vector<float> depth(pixels, kInfinity), normal(3 * pixels, 0.0f);
  for (std::size_t i = 0; i < pixels; ++i) {
    const Ray ray = rayOf(header.camera, i);
    const double s = reach(ray, glm::dvec3(0.0), kRadius);
    if (!(s < HUGE_VAL)) continue;
    depth[i] = float(s * ray.depthPerLength);
    const glm::dvec3 n =
        glm::dmat3(header.camera.eyeFromWorld()) * ((ray.origin + s * ray.direction) / kRadius);
    for (std::size_t c = 0; c < 3; ++c) normal[c * pixels + i] = float(n[int(c)]);
  }
  return depthImage(header, depth, normal);
}

std::shared_ptr<gl::Device> device() {
  static const std::shared_ptr<gl::Device> shared = gl::Device::create();
  return shared;
}

class Distorted : public testing::Test {
 protected:
  void write(const std::vector<ProxyImage>& images) {
    ArchiveWriter writer(path(), ExistingArchive::Overwrite);
    std::vector<EncodedProxy> proxies;
    for (const ProxyImage& image : images) proxies.push_back(encodeProxy(image));
    writer.writeStep(proxies);
  }
  std::filesystem::path path() const { return folder_.path() / "ball.cdb"; }
  Rendered render(const Look& look) const {
    return Renderer(device(), std::make_shared<const Archive>(path())).render(look);
  }

  synthetic::TemporaryFolder folder_;
};

/// The ball from there: the share of its pixels that have the right depth, to two pixels of the
/// distorted picture, and of those that have another.
struct Seen {
  double covered, wrong;
};
Seen compare(const Rendered& rendered, std::size_t pixels) {
  constexpr double kTwoPixels = 2.0 * 2.0 * 1.02 * 2.4143 / kSize.height;
  std::size_t all = 0, right = 0, wrong = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const Ray ray = rayOf(rendered.camera, i);
    const double s = reach(ray, glm::dvec3(0.0), 0.98 * kRadius);  // its rim aside
    if (!(s < HUGE_VAL)) continue;
    ++all;
    if (!std::isfinite(rendered.depth[i])) continue;
    const double truth = reach(ray, glm::dvec3(0.0), kRadius) * ray.depthPerLength;
    ++(std::abs(double(rendered.depth[i]) - truth) < kTwoPixels ? right : wrong);
  }
  return {double(right) / double(all), double(wrong) / double(all)};
}

TEST_F(Distorted, ABallIsSeenWhereItIsAndFromFartherRoundThanAFlatPictureShows) {
  write({ball(true), ball(false)});
  for (const double azimuth : {0.0, 30.0, 60.0, 90.0}) {
    Look look;
    look.view = "front_distorted";
    look.rotate.azimuth = azimuth;
    look.source = Source::Layers;
    const Rendered rendered = render(look);
    EXPECT_EQ(rendered.camera.projection, Projection::Orthographic);
    const Seen distorted = compare(rendered, kSize.pixels());
    // The rays reach 45 degrees behind the widest place. From the side the far side's inside shows
    // through what they did not reach.
    EXPECT_GT(distorted.covered, azimuth <= 30.0 ? 0.999 : azimuth <= 60.0 ? 0.97 : 0.8) << azimuth;
    EXPECT_LE(distorted.wrong, azimuth <= 60.0 ? 0.0 : 0.2) << azimuth;
    look.view = "front";
    const Seen flat = compare(render(look), kSize.pixels());
    EXPECT_GE(distorted.covered, flat.covered) << azimuth;
    if (azimuth >= 60.0) {
      EXPECT_GT(distorted.covered, flat.covered + 0.15) << azimuth;
    }
  }
}

TEST_F(Distorted, NormalsOfUndistortedDepthAreThoseOfTheBall) {
  write({ball(true)});
  Look look;
  look.rotate.azimuth = 40.0;
  look.source = Source::Layers;
  look.shading = Shading::Phong;
  look.material = {0.0, 1.0, 0.0, 32.0};
  look.lights = {{0.0, 0.0, 1.0}};
  look.opacity = {{0.0, 1.0}, {1.0, 1.0}};
  look.colormap = "grey";
  look.colorRange = {-1.0, 1.0 - kRadius};  // the surface is white
  for (const NormalSource normals : {NormalSource::Stored, NormalSource::Depth}) {
    look.normals = normals;
    const Rendered rendered = render(look);
    const glm::dmat3 eye(rendered.camera.eyeFromWorld());
    int compared = 0;
    double worst = 0.0;
    for (std::size_t i = 0; i < kSize.pixels(); ++i) {
      const Ray ray = rayOf(rendered.camera, i);
      const double s = reach(ray, glm::dvec3(0.0), kRadius);
      if (!(s < HUGE_VAL) || !std::isfinite(rendered.depth[i])) continue;
      const double facing = (eye * ((ray.origin + s * ray.direction) / kRadius)).z;
      if (facing < 0.3) continue;
      ++compared;
      worst = std::max(worst, std::abs(facing - double(rendered.picture.rgba[4 * i + 1])));
    }
    EXPECT_GT(compared, 500);
    EXPECT_LT(worst, normals == NormalSource::Stored ? 0.03 : 0.12);
  }
}

TEST_F(Distorted, WhatNoRayMetIsAGuess) {
  write({ball(true)});
  Look look;
  look.source = Source::Layers;
  look.trust = true;
  EXPECT_LT(render(look).shares.guess, 0.02);
  look.rotate.azimuth = 120.0;
  EXPECT_GT(render(look).shares.guess, 0.2);
}

TEST_F(Distorted, RadialityIsTheAngleBetweenNormalAndRay) {
  // A parallel view of a ball: within the angle a from the middle stands the share sin² a of its
  // pixels. Rays that close in meet it more steeply.
  const DepthLayers flat = depthLayers(ball(false));
  const Radiality parallel = radialityOf(flat);
  ASSERT_GT(parallel.hits(), 1000u);
  double within = 0.0;
  for (std::size_t i = 0; i < 6; ++i) within += double(parallel.counts[i]);
  EXPECT_NEAR(within / double(parallel.hits()), 0.75, 0.02);
  EXPECT_NEAR(parallel.shareBeyond60(), 0.25, 0.02);
  const Radiality distorted = radialityOf(depthLayers(ball(true)));
  EXPECT_GT(distorted.hits(), 1000u);
  EXPECT_LT(distorted.counts[0], distorted.hits());
  DepthLayers bare = flat;
  bare.normal[0].clear();
  EXPECT_EQ(radialityOf(bare).hits(), 0u);
  EXPECT_EQ(radialityOf(bare).shareBeyond60(), 0.0);

  write({ball(true)});
  const nlohmann::json info = archiveInfo(Archive(path()));
  ASSERT_EQ(info["radiality"].size(), 1u);
  EXPECT_EQ(info["radiality"][0]["view"], "front_distorted");
  EXPECT_NE(infoText(info).find("multi-perspective"), std::string::npos);
  EXPECT_NE(infoText(info).find("beyond 60 degrees"), std::string::npos) << infoText(info);
}

TEST_F(Distorted, ExportGivesTheDistortionBesideTheDepth) {
  write({ball(true), ball(false)});
  const Archive archive(path());
  exportChannels(archive, archive.rows(), ExportFolder(folder_.path() / "out"), ChannelFormat::Csv,
                 {});
  const auto firstLine = [&](const char* view) {
    std::ifstream file(folder_.path() / "out" /
                       (std::string("0_") + view + "_density_depth_layer00.csv"));
    std::string line;
    std::getline(file, line);
    return line;
  };
  EXPECT_EQ(firstLine("front_distorted"), "x,y,Z,nx,ny,nz,distortion_Z");
  EXPECT_EQ(firstLine("front"), "x,y,Z,nx,ny,nz");
}

/// Lengths of the ball, all of it one interval, in space below all of them.
ProxyImage ballOfOneInterval(bool distorted) {
  ProxyHeader header = headerOf(distorted);
  header.isovalues.clear();
  const std::size_t pixels = kSize.pixels();
  const auto channels = std::size_t(header.partition->channels());
  std::vector<float> length(channels * pixels, 0.0f), moment(length), runs(length);
  std::vector<std::uint8_t> ends(pixels, 255);
  for (std::size_t i = 0; i < pixels; ++i) {
    const Ray ray = rayOf(header.camera, i);
    const double s = reach(ray, glm::dvec3(0.0), kRadius);
    if (!(s < HUGE_VAL)) continue;
    const double middle = -glm::dot(ray.origin, ray.direction);
    const double leave = std::min(2.0 * middle - s, ray.lastDepth / ray.depthPerLength);
    const std::size_t at = 2 * pixels + i;
    length[at] = float(leave - s);
    moment[at] = float((leave - s) * 0.5 * (leave + s) * ray.depthPerLength);
    runs[at] = 1.0f;
    ends[i] = 2;
  }
  return lengthImage(header, length, moment, runs, ends, ends);
}

constexpr std::size_t kMiddle = std::size_t(kSize.width * (kSize.height + 1) / 2);

bool says(const Rendered& rendered, const char* words) {
  return std::any_of(rendered.notes.begin(), rendered.notes.end(), [=](const std::string& note) {
    return note.find(words) != std::string::npos;
  });
}

Look opaqueLook() {
  Look look;
  look.opacity = {{0.0, 0.999}, {1.0, 0.999}};
  look.referenceLength = 0.01;
  look.background = std::nullopt;
  return look;
}

/// How much of the union of two discs is in both: what is drawn, and the ball there.
double overlap(const Picture& picture, const Camera& camera) {
  std::size_t both = 0, either = 0;
  for (std::size_t i = 0; i < kSize.pixels(); ++i) {
    const bool drawn = picture.rgba[4 * i + 3] > 0.5f;
    const bool there = reach(rayOf(camera, i), glm::dvec3(0.0), kRadius) < HUGE_VAL;
    both += drawn && there;
    either += drawn || there;
  }
  return double(both) / double(either);
}

TEST_F(Distorted, VirtualRaysMeetTheBallWhereItIs) {
  write({ballOfOneInterval(true)});
  for (const double azimuth : {0.0, 30.0, 60.0}) {
    Look look = opaqueLook();
    look.rotate.azimuth = azimuth;
    look.trust = true;
    const Rendered rendered = render(look);
    EXPECT_TRUE(says(rendered, "uses virtual"));
    EXPECT_GT(overlap(rendered.picture, rendered.camera), 0.93) << azimuth;
    const Seen seen = compare(rendered, kSize.pixels());
    EXPECT_GT(seen.covered, azimuth < 45.0 ? 0.95 : 0.85) << azimuth;
    EXPECT_EQ(rendered.trust[kMiddle], Trust::Interpolation);
  }
}

TEST_F(Distorted, LayersAnswerWhereDepthIsStoredAndVirtualRaysWhenAskedFor) {
  write({ballOfOneInterval(true), ball(true)});
  for (const double azimuth : {0.0, 20.0, 60.0}) {
    Look look = opaqueLook();
    look.rotate.azimuth = azimuth;
    look.frame = Frame::Stored;  // as many pixels of the ball at each angle
    const Rendered rendered = render(look);
    EXPECT_TRUE(says(rendered, "layers are warped"));
    EXPECT_FALSE(says(rendered, "uses virtual"));
    EXPECT_GT(overlap(rendered.picture, rendered.camera), 0.97) << azimuth;
    look.source = Source::Virtual;
    EXPECT_TRUE(says(render(look), "uses virtual"));
  }
}

TEST_F(Distorted, VirtualRaysLookUpWhereTheStoredRaysSaw) {
  const LengthPlanes lengths = lengthPlanes(ballOfOneInterval(true));
  const Camera straight = undistorted(lengths.header.camera, lengths.header.domain, 1.0);
  const Camera target = straight.orbited(glm::dvec3(0.0), 0.6, 0.2);
  const ChannelTable table{std::vector<double>(8, 1e3), std::vector<glm::dvec3>(8, glm::dvec3(1))};
  double distorted = 0.0, undistortedPlace = 0.0;
  device()->run([&] {
    VirtualPass pass;
    const SheetTextures sheets(lengths);
    distorted = overlap(pass.render(sheets, table, target, kSize).picture, target);
    undistortedPlace =
        overlap(pass.render(sheets, table, target, kSize, VirtualPass::Lookup::Undistorted).picture,
                target);
  });
  RecordProperty("distorted", std::to_string(distorted));
  RecordProperty("undistorted", std::to_string(undistortedPlace));
  EXPECT_GT(distorted, 0.93);
  EXPECT_LT(undistortedPlace, 0.8 * distorted);
}

TEST_F(Distorted, VirtualRaysHaveTheOpacityOfTheStoredRayThroughTheMiddle) {
  write({ballOfOneInterval(true)});
  Look look = opaqueLook();
  look.opacity = {{0.0, 0.3}, {1.0, 0.3}};
  look.referenceLength = 1.0;
  const Rendered rendered = render(look);
  // Straight on and beside the pole, new rays meet the front of the ball at 45 degrees to the old,
  // of which each adds its whole chord.
  const ProxyHeader header = headerOf(true);
  const double x = 0.5 * kSize.width + 25.0, y = 0.5 * kSize.height;
  const Ray ray = rendered.camera.rayThrough({x + 0.5, y + 0.5}, kSize);
  const glm::dvec3 front = ray.origin + reach(ray, glm::dvec3(0.0), kRadius) * ray.direction;
  const glm::dvec3 pixel = header.camera.project(front, kSize);
  const Ray old = header.camera.rayThrough({pixel.x, pixel.y}, kSize);
  const double enter = reach(old, glm::dvec3(0.0), 0.999 * kRadius);
  const double leave = std::min(-2.0 * glm::dot(old.origin, old.direction) - enter,
                                old.lastDepth / old.depthPerLength);
  const double length = leave - enter;
  const double alpha = 1.0 - std::pow(0.7, length);
  EXPECT_NEAR(rendered.picture.pixel(int(x), int(y))[3], alpha, 0.05);
}

TEST_F(Distorted, VirtualRaysSayWhatTheyDoNotKnow) {
  write({ballOfOneInterval(true)});
  Look look = opaqueLook();
  look.trust = true;
  const Rendered rendered = render(look);
  EXPECT_EQ(rendered.trust[kMiddle], Trust::Interpolation);
  EXPECT_EQ(rendered.trust[std::size_t(kSize.height / 2 * kSize.width + 10)], Trust::Guess)
      << "the far edges of the box are beyond the stored picture";
  EXPECT_EQ(rendered.trust[0], Trust::Data) << "beside the box";
}

TEST_F(Distorted, VirtualRaysAreRefusedWhereTheyCannotBe) {
  const auto refusal = [&](const Look& look) {
    try {
      render(look);
    } catch (const Error& error) {
      return std::pair(error.code(), std::string(error.what()));
    }
    return std::pair(ErrorCode::Internal, std::string("nothing was thrown"));
  };
  Look look;
  look.source = Source::Virtual;
  write({ballOfOneInterval(false)});
  EXPECT_EQ(refusal(look).first, ErrorCode::Config) << refusal(look).second;
  look.rotate.azimuth = 20.0;
  EXPECT_EQ(refusal(look).first, ErrorCode::Config) << refusal(look).second;
  write({ball(true)});
  EXPECT_EQ(refusal(look).first, ErrorCode::NotFound) << refusal(look).second;
  write({ballOfOneInterval(true)});
  EXPECT_NO_THROW(render(look));
  look.shading = Shading::Phong;
  EXPECT_NE(refusal(look).second.find("'shading'"), std::string::npos) << refusal(look).second;
  look.source = Source::Auto;
  EXPECT_TRUE(says(render(look), "layers are warped")) << "which can be lit";
  const LengthPlanes lengths = lengthPlanes(ballOfOneInterval(true));
  device()->run([&] {
    const SheetTextures sheets(lengths);
    EXPECT_THROW(VirtualPass().render(sheets, {}, lengths.header.camera, kSize), Error);
    EXPECT_THROW(VirtualPass().render(sheets, {std::vector<double>(68), {}}, Camera{}, kSize),
                 Error);
  });
}

TEST_F(Distorted, AnEdgeOfTheBoxIsDrawnAsTheCurveThatItIs) {
  write({ball(true)});
  Look look;
  look.annotations.box = true;
  EXPECT_NO_THROW(render(look));
}

}  // namespace
}  // namespace vestige
