// SPDX-License-Identifier: BSD-3-Clause
//
// What a look asks for in vain is said: once, naming the key, with the data's range or the domain.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "explorer/export/movie.h"
#include "explorer/renderer/look_warnings.h"
#include "explorer/renderer/renderer.h"
#include "proxy/format/layout/field_layout.h"
#include "proxy/gl/device.h"
#include "tests/explorer/synthetic.h"

namespace vestige {
namespace {

constexpr ImageSize kSize{48, 40};

/// Everything that there is, of values 1 - |x| in [-1, 1]^3.
class Warnings : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new synthetic::TemporaryFolder;
    const auto path = folder_->path() / "all.cdb";
    {
      ArchiveWriter writer(path, ExistingArchive::Refuse);
      std::vector<EncodedProxy> proxies;
      for (const ProxyImage& image :
           {synthetic::lengthProxy(kSize), synthetic::attenuationProxy(kSize),
            synthetic::depthProxy(kSize, {0.3, 0.6}), synthetic::mipProxy(kSize),
            synthetic::referenceProxy(kSize), field()}) {
        proxies.push_back(encodeProxy(image));
      }
      writer.writeStep(proxies);
    }
    renderer_ = new Renderer(gl::Device::create(), std::make_shared<const Archive>(path));
  }
  static void TearDownTestSuite() {
    delete renderer_;
    delete folder_;
  }

  static ProxyImage field() {
    FieldSamples field;
    for (FieldAxis& axis : field.axes) axis = {16, -1.0, 2.0 / 15.0, {}};
    field.low = -0.75;
    field.high = 1.0;
    for (int i = 0; i < 16 * 16 * 16; ++i) {
      const glm::dvec3 at(field.axes[0].at(i % 16), field.axes[1].at(i / 16 % 16),
                          field.axes[2].at(i / 256));
      field.values.push_back(float((1.0 - glm::length(at) - field.low) / 1.75));
    }
    return fieldImage(synthetic::header(kind::kField, kSize), std::move(field), {1, 1e-4});
  }

  static std::vector<Warning> warningsOf(const Look& look) {
    return renderer_->render(look).warnings;
  }
  static std::string textOf(const Look& look, const std::string& key) {
    std::string text;
    for (const Warning& each : warningsOf(look)) {
      if (each.key != key) continue;
      EXPECT_TRUE(text.empty()) << "twice: " << each.text;
      text = each.text;
    }
    EXPECT_FALSE(text.empty()) << key;
    return text;
  }
  static void holds(const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }

  static synthetic::TemporaryFolder* folder_;
  static Renderer* renderer_;
};
synthetic::TemporaryFolder* Warnings::folder_ = nullptr;
Renderer* Warnings::renderer_ = nullptr;

TEST_F(Warnings, AreNoneForLooksThatMakeSense) {
  for (const Source source : {Source::Auto, Source::Volume, Source::Layers, Source::Mip,
                              Source::Reference, Source::Field}) {
    Look look;
    look.source = source;
    for (const Warning& each : warningsOf(look)) ADD_FAILURE() << each.text;
    if (source == Source::Mip || source == Source::Reference) continue;
    look.shading = Shading::Phong;
    look.ao.on = true;
    look.opacity = std::vector<OpacityPoint>{{0.2, 0.0}, {0.9, 0.5}};
    look.colormap = "inferno";
    for (const Warning& each : warningsOf(look)) ADD_FAILURE() << each.text;
  }
  Look look;
  look.draw = Draw::Isosurface;
  look.isosurfaces = {{0.5, 1.0}};
  for (const Warning& each : warningsOf(look)) ADD_FAILURE() << each.text;
  look.draw = Draw::Slice;
  look.isosurfaces.clear();
  look.slice = glm::dvec4(0.0, 1.0, 0.0, 0.5);
  for (const Warning& each : warningsOf(look)) ADD_FAILURE() << each.text;
}

TEST_F(Warnings, NameTheValueOfAConstantFieldThatFillsTheDomain) {
  ProxyHeader header = synthetic::lengthProxy(kSize).header;
  header.statistics.low = header.statistics.high = 3.25;
  const auto said = [&](const Look& look, double low, double high) {
    TransferFunction function = TransferFunction::ramp(low, high, 1.0);
    if (look.opacity) function.setOpacity(*look.opacity);
    const auto all = valuesOutside(look, Answer::Lengths, header, &function, header.camera, kSize);
    return all.empty() ? std::string() : all.front().text;
  };
  holds(said({}, 2.0, 4.0), "is 3.25");
  EXPECT_EQ(said({}, 3.5, 4.0), "") << "transparent there";
  Look look;
  look.opacity = std::vector<OpacityPoint>{{3.0, 0.1}, {4.0, 0.2}};
  look.opacity->insert(look.opacity->begin() + 1, {3.25, 0.1});
  EXPECT_EQ(said(look, 2.0, 4.0), "");
}

TEST_F(Warnings, SayWhereOpacityChangesInsideOneInterval) {
  const auto header = synthetic::lengthProxy(kSize).header;
  const double low = header.partition->bounds()[1], high = header.partition->bounds()[2];
  const double width = high - low;
  Look look;
  look.opacity = std::vector<OpacityPoint>{
      {low + 0.4 * width, 0.0}, {low + 0.5 * width, 0.6}, {low + 0.6 * width, 0.0}};
  for (const Source source : {Source::Volume, Source::Layers}) {
    look.source = source;
    const std::string text = textOf(look, "opacity");
    holds(text, "between 0 and 0.6 inside interval 1");
    holds(text, "one mean opacity");
  }
  look.source = Source::Field;
  for (const Warning& each : warningsOf(look)) ADD_FAILURE() << each.text;
}

TEST_F(Warnings, NameEachKeyThatHasNoPartInThePicture) {
  Look reference;
  reference.source = Source::Reference;
  reference.opacity = std::vector<OpacityPoint>{{0.0, 0.1}, {1.0, 0.5}};
  reference.colormap = "grey";
  reference.shading = Shading::Phong;
  reference.ao.on = true;
  for (const char* key : {"opacity", "colormap", "shading", "ao"})
    holds(textOf(reference, key), "the run's own picture");
  Look surface;
  surface.draw = Draw::Isosurface;
  surface.isosurfaces = {{0.5, 1.0}};
  surface.ao.on = true;
  holds(textOf(surface, "ao"), "isosurfaces are drawn");
  surface.colormap = "grey";
  textOf(surface, "colormap");
  surface.isosurfaces[0].color = "map";
  EXPECT_EQ(warningsOf(surface).size(), 1u) << "the colour map is used now";
  Look slice;
  slice.draw = Draw::Slice;
  slice.shading = Shading::Phong;
  slice.isosurfaces = {{0.5, 1.0}};
  holds(textOf(slice, "shading"), "a slice is drawn");
  textOf(slice, "isosurfaces");
  Look mip;
  mip.source = Source::Mip;
  mip.factors = std::vector<double>(synthetic::kIntervals, 1.0);
  mip.enhance.on = true;
  textOf(mip, "factors");
  textOf(mip, "enhance");
  Look field;
  field.source = Source::Field;
  field.order = Order::Mean;
  field.slice = glm::dvec4(0.0, 1.0, 0.0, 0.0);
  textOf(field, "order");
  textOf(field, "slice");
}

TEST_F(Warnings, EveryKeyThatIsSaidToBeInVainChangesNothing) {
  // Each source with each key: the pictures with and without are equal exactly where it warns.
  struct Change {
    const char* key;
    void (*apply)(Look&);
  };
  const Change changes[] = {{"opacity",
                             [](Look& l) {
                               l.opacity = std::vector<OpacityPoint>{{0.1, 0.0}, {0.8, 0.6}};
                             }},
                            {"referenceLength", [](Look& l) { l.referenceLength = 0.3; }},
                            {"factors",
                             [](Look& l) {
                               l.factors = {1.0, 0.2, 3.0, 0.1, 0.4};
                             }},
                            {"colormap", [](Look& l) { l.colormap = "coolwarm_r"; }},
                            {"colorRange",
                             [](Look& l) {
                               l.colorRange = {0.2, 0.6};
                             }},
                            {"shading",
                             [](Look& l) {
                               l.shading = Shading::Phong;
                               l.lights = {{80.0, 10.0, 1.0}};
                             }},
                            {"ao",
                             [](Look& l) {
                               l.ao = {true, 3.0, 0.3};
                             }},
                            {"enhance", [](Look& l) {
                               l.enhance = {true, 5.0, 1.0};
                             }}};
  const std::pair<Source, Draw> sources[] = {
      {Source::Volume, Draw::Volume}, {Source::Layers, Draw::Volume},
      {Source::Mip, Draw::Volume},    {Source::Reference, Draw::Volume},
      {Source::Field, Draw::Volume},  {Source::Field, Draw::Isosurface},
      {Source::Field, Draw::Mip},     {Source::Field, Draw::Slice}};
  for (const auto& [source, draw] : sources) {
    Look plain;
    plain.source = source;
    plain.draw = draw;
    if (draw == Draw::Isosurface) plain.isosurfaces = {{0.5, 0.7}};
    const Picture before = renderer_->render(plain).picture;
    for (const Change& change : changes) {
      Look look = plain;
      change.apply(look);
      const Rendered after = renderer_->render(look);
      const bool warned = std::any_of(after.warnings.begin(), after.warnings.end(),
                                      [&](const Warning& each) { return each.key == change.key; });
      // On a convex body occlusion may find nothing to darken.
      if (!warned && std::string(change.key) == "ao") continue;
      EXPECT_EQ(warned, after.picture.rgba == before.rgba)
          << change.key << " of source " << int(source) << ", draw " << int(draw);
    }
  }
}

TEST_F(Warnings, TellTheDataOfValuesOutsideOfThem) {
  Look surface;
  surface.draw = Draw::Isosurface;
  surface.isosurfaces = {{0.5, 1.0}, {99.0, 1.0}};
  const std::string data = "the data are";
  holds(textOf(surface, "isosurfaces"), "no surface has the value 99");
  holds(textOf(surface, "isosurfaces"), data.c_str());
  Look above;
  above.opacity = std::vector<OpacityPoint>{{50.0, 0.0}, {60.0, 0.9}};
  holds(textOf(above, "opacity"), data.c_str());
  above.opacity = std::vector<OpacityPoint>{{50.0, 0.2}, {60.0, 0.9}};
  holds(textOf(above, "opacity"), "one opacity");
  Look colors;
  colors.colorRange = {50.0, 60.0};
  holds(textOf(colors, "colorRange"), data.c_str());
  Look late;
  late.time = 1e6;
  holds(textOf(late, "time"), "cycle");
}

TEST_F(Warnings, TellTheDomainOfPlacesOutsideOfIt) {
  const char* domain = "(-1, -1, -1) .. (1, 1, 1)";
  Look look;
  look.clip = Box{{5.0, 5.0, 5.0}, {6.0, 6.0, 6.0}};
  holds(textOf(look, "clip"), domain);
  look = Look{};
  look.draw = Draw::Slice;
  look.slice = glm::dvec4(0.0, 0.0, 1.0, 1000.0);
  holds(textOf(look, "slice"), domain);
  look.slice = glm::dvec4(0.0, 0.0, 1.0, 0.0);  // the front view looks along y
  holds(textOf(look, "slice"), "edge-on");
  look.rotate = {0.0, 30.0, 0.0};
  for (const Warning& each : warningsOf(look)) ADD_FAILURE() << each.text;
  look = Look{};
  look.center = glm::dvec3(3.0, 0.0, 0.0);
  holds(textOf(look, "center"), domain);
  look = Look{};
  look.pan = {5.0, 0.0};
  holds(textOf(look, "pan"), domain);
  look = Look{};
  look.ao = {true, 1.0, 1e-4};
  holds(textOf(look, "ao"), "pixels");
  look = Look{};
  look.draw = Draw::Isosurface;
  look.isosurfaces = {{0.5, 0.0}};
  holds(textOf(look, ""), "nothing is to be seen");
}

TEST_F(Warnings, OfAMovieAreSaidOnce) {
  Look look;
  look.source = Source::Field;
  look.ao.on = true;
  look.draw = Draw::Isosurface;
  look.isosurfaces = {{0.5, 1.0}};
  const auto warnings = writeMovie(folder_->path() / "turn.mp4", *renderer_,
                                   looksOfTurn(look, 20.0, 3), 10.0, nullptr);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].key, "ao");
  EXPECT_EQ(warnings[0].text.find("frames"), std::string::npos);
}

}  // namespace
}  // namespace vestige
