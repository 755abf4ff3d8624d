// SPDX-License-Identifier: BSD-3-Clause
//
// Stored fields as the source of pictures: which source answers, and that the pictures are right.
#include "explorer/volume/field_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "explorer/renderer/renderer.h"
#include "proxy/base/error.h"
#include "proxy/gl/device.h"
#include "tests/explorer/synthetic.h"

namespace vestige {
namespace {

constexpr ImageSize kSize{64, 64};

const std::shared_ptr<gl::Device>& device() {
  static const std::shared_ptr<gl::Device> device = gl::Device::create();
  return device;
}

/// f = 1 - |x| on points of [-1, 1]^3, as the other synthetic proxies.
ProxyImage fieldProxy(int n, double tolerance = 1e-4) {
  FieldSamples field;
  for (FieldAxis& axis : field.axes) axis = {n, -1.0, 2.0 / (n - 1), {}};
  field.low = -0.75;
  field.high = 1.0;
  for (int z = 0; z < n; ++z) {
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        const glm::dvec3 at(field.axes[0].at(x), field.axes[1].at(y), field.axes[2].at(z));
        field.values.push_back(float((1.0 - glm::length(at) - field.low) / 1.75));
      }
    }
  }
  ProxyHeader header = synthetic::header(kind::kField, kSize);
  return fieldImage(header, std::move(field), {1, tolerance});
}

void writeField(const std::filesystem::path& directory, bool others) {
  ArchiveWriter writer(directory, ExistingArchive::Refuse);
  std::vector<EncodedProxy> proxies;
  if (others) {
    proxies.push_back(encodeProxy(synthetic::lengthProxy(kSize)));
    proxies.push_back(encodeProxy(synthetic::depthProxy(kSize, {0.3, 0.6})));
  }
  proxies.push_back(encodeProxy(fieldProxy(48)));
  writer.writeStep(proxies);
}

bool noted(const Rendered& rendered, const std::string& part) {
  return std::any_of(rendered.notes.begin(), rendered.notes.end(),
                     [&](const std::string& note) { return note.find(part) != std::string::npos; });
}

double difference(const Picture& a, const Picture& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    most = std::max(most, double(std::abs(a.rgba[i] - b.rgba[i])));
  }
  return most;
}

Look someLook() {
  Look look;
  look.opacity = std::vector<OpacityPoint>{{0.2, 0.0}, {0.5, 0.05}, {0.7, 0.0}, {0.9, 0.5}};
  look.background = std::nullopt;
  look.size = kSize;
  return look;
}

TEST(FieldSource, AnswersEverythingWhereNothingElseIsStored) {
  const synthetic::TemporaryFolder folder;
  writeField(folder.path() / "a.cdb", false);
  Renderer renderer(device(), std::make_shared<Archive>(folder.path() / "a.cdb"));
  Look look = someLook();
  look.trust = true;
  const Rendered front = renderer.render(look);
  EXPECT_TRUE(noted(front, "uses field: 48 x 48 x 48 samples"));
  EXPECT_GT(front.shares.data, 0.9);
  // A ball looks the same from everywhere.
  look.trust = false;
  look.clip = Box{{-0.7, -0.7, -0.7}, {0.7, 0.7, 0.7}};
  look.clip.reset();
  look.opacity = std::vector<OpacityPoint>{{0.3, 0.0}, {0.6, 0.3}};
  const Rendered straight = renderer.render(look);
  look.rotate = {90.0, 0.0, 0.0};
  const Rendered turned = renderer.render(look);
  EXPECT_LT(difference(straight.picture, turned.picture), 5e-3);
  EXPECT_GT(*std::max_element(turned.picture.rgba.begin(), turned.picture.rgba.end()), 0.5f);
}

TEST(FieldSource, IsTrustedAsFarAsItsToleranceGoes) {
  const synthetic::TemporaryFolder folder;
  double data = 1.2;  // more than all
  for (const double tolerance : {1e-5, 1e-2, 0.1}) {
    const auto path = folder.path() / std::to_string(tolerance);
    ArchiveWriter(path, ExistingArchive::Refuse)
        .writeStep(std::vector<EncodedProxy>{encodeProxy(fieldProxy(24, tolerance))});
    Look look = someLook();
    look.rotate = {30.0, 10.0, 0.0};
    look.trust = true;
    const double share =
        Renderer(device(), std::make_shared<Archive>(path)).render(look).shares.data;
    EXPECT_LT(share, data - 0.1) << tolerance;
    data = share;
  }
}

TEST(FieldSource, AutoTakesItWhereItStatesLessError) {
  const synthetic::TemporaryFolder folder;
  writeField(folder.path() / "a.cdb", true);
  Renderer renderer(device(), std::make_shared<Archive>(folder.path() / "a.cdb"));
  Look look = someLook();
  const Rendered first = renderer.render(look);
  EXPECT_TRUE(noted(first, "uses field"));
  EXPECT_TRUE(noted(first, "field states: values within"));
  EXPECT_TRUE(noted(first, "length states: values within"));
  EXPECT_TRUE(noted(first, "their order along a ray is not stored"));
  // What only lengths can do they do, and say what is truer.
  look.order = Order::Mean;
  const Rendered ordered = renderer.render(look);
  EXPECT_TRUE(noted(ordered, "uses length"));
  EXPECT_TRUE(noted(ordered, "look key 'order' is not for the field, which is truer"));
  look.order = Order::Auto;
  look.source = Source::Volume;
  EXPECT_TRUE(noted(renderer.render(look), "uses length"));
  look.source = Source::Auto;
  look.clip = Box{{-1.0, -1.0, -1.0}, {1.0, 0.0, 1.0}};
  EXPECT_TRUE(noted(renderer.render(look), "uses field"));
  look.source = Source::Volume;
  EXPECT_THROW(renderer.render(look), Error);
}

TEST(FieldSource, IsosurfacesMaximaSlicesAndClipsAreWhereTheyShouldBe) {
  const synthetic::TemporaryFolder folder;
  writeField(folder.path() / "a.cdb", false);
  Renderer renderer(device(), std::make_shared<Archive>(folder.path() / "a.cdb"));
  Look look = someLook();
  look.size = kSize;
  look.draw = Draw::Isosurface;
  look.isosurfaces = {{0.5, 1.0}};
  const Rendered surface = renderer.render(look);
  const std::size_t middle = 32 * 64 + 32;
  const double centre = glm::dot(-surface.camera.position, surface.camera.forward);
  EXPECT_NEAR(surface.depth[middle], centre - 0.5, 0.01);
  EXPECT_EQ(surface.picture.rgba[4 * middle + 3], 1.0f);
  look.clip = Box{{-1.0, 0.0, -1.0}, {1.0, 1.0, 1.0}};  // the far half alone
  EXPECT_NEAR(renderer.render(look).depth[middle], centre + 0.5, 0.01);
  look.clip.reset();
  look.draw = Draw::Slice;
  look.slice = glm::dvec4(0.0, 1.0, 0.0, 0.25);
  EXPECT_NEAR(renderer.render(look).depth[middle], centre + 0.25, 1e-4);
  look.draw = Draw::Mip;
  const Rendered most = renderer.render(look);
  EXPECT_NEAR(most.depth[middle], centre, 0.1);
  EXPECT_EQ(most.picture.rgba[4 * middle + 3], 1.0f);
}

TEST(FieldSource, LightAndOcclusionChangeThePicture) {
  const synthetic::TemporaryFolder folder;
  writeField(folder.path() / "a.cdb", false);
  Renderer renderer(device(), std::make_shared<Archive>(folder.path() / "a.cdb"));
  Look look = someLook();
  const Picture plain = renderer.render(look).picture;
  look.ao.on = true;
  EXPECT_GT(difference(plain, renderer.render(look).picture), 0.005);
  look.ao.on = false;
  look.shading = Shading::Phong;
  EXPECT_GT(difference(plain, renderer.render(look).picture), 0.05);
  look.draw = Draw::Isosurface;
  renderer.render(look);
  look.draw = Draw::Volume;
  look.shading = Shading::None;
  EXPECT_EQ(plain.rgba, renderer.render(look).picture.rgba);  // nothing is left behind
}

TEST(FieldSource, UnevenAxesKeepTheirSamples) {
  // Depths close together near the surface: T is warm in the first 40 m of 1000.
  FieldSamples field;
  const std::vector<double> depths{0, 10, 20, 30, 40, 60, 120, 300, 600, 1000};
  field.axes = {FieldAxis{3, 0.0, 500.0, {}}, FieldAxis{3, 0.0, 500.0, {}},
                FieldAxis{10, 0.0, 1.0, depths}};
  for (const double depth : depths)
    field.values.insert(field.values.end(), 9,
                        float(depth <= 30 ? 1.0 : std::exp(-(depth - 30) / 50)));
  ProxyHeader header = synthetic::header(kind::kField, kSize);
  header.domain = {{0.0, 0.0, 0.0}, {1000.0, 1000.0, 1000.0}};
  const ProxyImage image = fieldImage(header, field, {1, 1e-6});
  const PlacedField placed = placedField(image);
  EXPECT_EQ(placed.size, glm::ivec3(3, 3, 10));
  ASSERT_EQ(placed.nodes[2].size(), depths.size());
  EXPECT_TRUE(placed.nodes[0].empty());
  for (std::size_t i = 0; i < depths.size(); ++i) {
    const glm::dvec4 grid(0.5, 0.5, placed.nodes[2][i] / 10.0, 1.0);
    EXPECT_NEAR((placed.worldFromGrid * grid).z, depths[i], 1e-9);
    EXPECT_NEAR(placed.values[9 * i], field.values[9 * i], 1e-5);
  }
}

TEST(FieldSource, LooksKeepWhatGridsNeed) {
  Look look;
  look.draw = Draw::Slice;
  look.slice = glm::dvec4(0.0, 1.0, 0.5, 2.0);
  look.clip = Box{{-1.0, 0.0, 1.0}, {2.0, 3.0, 4.0}};
  look.isosurfaces = {{0.5, 0.25}, {0.75, 1.0}};
  look.source = Source::Field;
  EXPECT_EQ(lookFromJson(toJson(look)), look);
  const auto refused = [](const char* key, nlohmann::json value) {
    nlohmann::json json;
    json[key] = std::move(value);
    try {
      lookFromJson(json);
      ADD_FAILURE() << json.dump();
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(key), std::string::npos) << error.what();
    }
  };
  refused("clip", {0.0, 0.0, 0.0, 1.0, 1.0});
  refused("clip", {0.0, 0.0, 0.0, 1.0, 0.0, 1.0});
  refused("slice", {0.0, 0.0, 0.0, 1.0});
  refused("isosurfaces", {{0.5, 2.0}});
  refused("draw", "solid");
}

}  // namespace
}  // namespace vestige
