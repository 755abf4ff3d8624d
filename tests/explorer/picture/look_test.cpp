// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/picture/look.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "proxy/base/error.h"

namespace vestige {
namespace {

std::string messageOf(const std::string& text) {
  try {
    lookFromText(text);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::Config) << error.what();
    return error.what();
  }
  ADD_FAILURE() << text << " was accepted";
  return {};
}

TEST(Rotation, WholeTurnsAreNone) {
  EXPECT_TRUE((Rotation{360.0, -720.0, 0.0}).isZero());
  EXPECT_FALSE((Rotation{180.0, 0.0, 0.0}).isZero());
  EXPECT_FALSE((Rotation{0.0, 0.0, 1e-9}).isZero());
}

TEST(Look, SurvivesJsonWithEveryKeySet) {
  Look look;
  look.cycle = 40;
  look.field = "temperature";
  look.view = "front";
  look.source = Source::Layers;
  look.size = ImageSize{640, 480};
  look.rotate = {30.0, -12.5, 5.0};
  look.opacity = std::vector<OpacityPoint>{{0.1, 0.0}, {0.7, 0.9}};
  look.referenceLength = 0.01;
  look.colormap = "inferno_r";
  look.colorRange = {-1.0, 2.5};
  look.factors = {1.0, 0.0, 2.5};
  look.via = Via::Attenuation;
  look.order = Order::Mean;
  look.shading = Shading::Phong;
  look.normals = NormalSource::Depth;
  look.lights = {{10.0, 20.0, 0.5}, {-80.0, 5.0, 1.0}};
  look.material = {0.1, 0.8, 0.3, 12.0};
  look.ao = {true, 0.7, 0.1};
  look.enhance = {true, 2.0, 0.5};
  look.trust = true;
  look.annotations = {true, false, true, true};
  look.background = std::nullopt;
  look.frame = Frame::Orbit;
  look.frameFor = {{1.0, 2.0, 3.0}, {-4.0, 5.0, 0.0}};
  look.zoom = 2.5;
  look.pan = {0.25, -0.5};
  look.center = glm::dvec3(1.0, -2.0, 3.5);
  look.scale = {1.0, 1.0, 50.0};
  look.isosurfaces = {{0.5, 0.25}, {0.75, 1.0, "#f4ecdc"}, {0.8, 1.0, "map"}};
  EXPECT_EQ(lookFromJson(toJson(look)), look);
  EXPECT_EQ(lookFromText(toJson(look).dump()), look);
}

TEST(Look, ReadsLooksThatWereSavedBeforeSurfacesHadColours) {
  const Look look = lookFromText(
      R"({"draw": "isosurface", "isosurfaces": [[0.5, 0.25], {"value": 0.75}], "shading": "none"})");
  EXPECT_EQ(look.isosurfaces, (std::vector<SurfaceLook>{{0.5, 0.25}, {0.75, 1.0}}));
  EXPECT_FALSE(look.isLit()) << "as it was saved";
  EXPECT_TRUE(lookFromText(R"({"draw": "isosurface"})").isLit());
  EXPECT_FALSE(Look{}.isLit());
}

TEST(Look, SurvivesJsonWithLearnedColours) {
  Look look;
  look.color = Coloring::Learned;
  look.factors = {0.5, 1.0};
  look.enhance.on = true;
  EXPECT_EQ(lookFromJson(toJson(look)), look);
}

TEST(Look, SurvivesJsonWithAClassifierAndChangesOfFeatures) {
  const Look look = lookFromText(R"({
    "classifier": {"kind": "gaussian", "fields": ["t", "w"],
                   "primitives": [{"name": "hot", "center": [1, 2], "width": [0.5, 3]}]},
    "features": [{"name": "hot", "opacity": 0.25, "color": "#ff0000", "enabled": false}]})");
  ASSERT_EQ(look.features.size(), 1u);
  EXPECT_EQ(look.features[0].opacity, 0.25);
  EXPECT_EQ(look.features[0].enabled, false);
  EXPECT_EQ(lookFromJson(toJson(look)).classifier, look.classifier);
  EXPECT_EQ(lookFromJson(toJson(look)).features.size(), 1u);
}

TEST(Look, IsTheDefaultWhenEmpty) { EXPECT_EQ(lookFromText("{}"), Look{}); }

TEST(Look, NamesUnknownKeysByTheirPath) {
  EXPECT_NE(messageOf(R"({"colormop": "grey"})").find("'colormop'"), std::string::npos);
  EXPECT_NE(messageOf(R"({"ao": {"radios": 1}})").find("'ao.radios'"), std::string::npos);
  EXPECT_NE(
      messageOf(R"({"lights": [{"azimuth": 0}, {"elevatoin": 1}]})").find("'lights[1].elevatoin'"),
      std::string::npos);
}

TEST(Look, NamesTheKeyOfEveryBadValue) {
  const std::pair<const char*, const char*> cases[] = {
      {R"({"size": [0, 10]})", "size"},
      {R"({"size": [10]})", "size"},
      {R"({"size": [1e9, 10]})", "size"},
      {R"({"rotate": [1, 2]})", "rotate"},
      {R"({"rotate": [1, 2, 4000]})", "rotate"},
      {R"({"opacity": [[0.1, 1.5]]})", "opacity"},
      {R"({"opacity": [[0.1]]})", "opacity"},
      {R"({"opacity": 1})", "opacity"},
      {R"({"referenceLength": 0})", "referenceLength"},
      {R"({"colormap": 3})", "colormap"},
      {R"({"colorRange": [2, 1]})", "colorRange"},
      {R"({"factors": [-1]})", "factors"},
      {R"({"factors": ["a"]})", "factors"},
      {R"({"via": "magic"})", "via"},
      {R"({"order": 1})", "order"},
      {R"({"shading": "toon"})", "shading"},
      {R"({"frame": "wide"})", "frame"},
      {R"({"frameFor": [[1, 2]]})", "frameFor"},
      {R"({"zoom": 0})", "zoom"},
      {R"({"pan": [1]})", "pan"},
      {R"({"center": [1, 2]})", "center"},
      {R"({"scale": [1, 1, 0]})", "scale"},
      {R"({"scale": [1, 1, -2]})", "scale"},
      {R"({"isosurfaces": [{"opacity": 0.5}]})", "isosurfaces[0].value"},
      {R"({"isosurfaces": [{"value": 1, "hue": 2}]})", "hue"},
      {R"({"isosurfaces": [{"value": 1, "color": "mauve"}]})", "mauve"},
      {R"({"color": "learned", "scale": [1, 1, 2]})", "scale"},
      {R"({"normals": true})", "normals"},
      {R"({"source": "voxels"})", "source"},
      {R"({"lights": {}})", "lights"},
      {R"({"lights": [{"intensity": -1}]})", "intensity"},
      {R"({"material": {"shininess": 0}})", "material.shininess"},
      {R"({"ao": {"radius": 0}})", "ao.radius"},
      {R"({"enhance": {"gamma": 0}})", "enhance.gamma"},
      {R"({"trust": "yes"})", "trust"},
      {R"({"background": "mauve"})", "background"},
      {R"({"background": "#12345"})", "background"},
      {R"({"cycle": 1.5})", "cycle"},
      {R"({"cycle": 1, "time": 2})", "cycle"},
      {R"({"classifier": 3})", "classifier"},
      {R"({"classifier": {"kind": "magic"}})", "classifier.kind"},
      {R"({"classifier": {"kind": "gaussian", "fields": []}})", "classifier.fields"},
      {R"({"classifier": {"kind": "gaussian", "fields": ["a"], "primitives": [{"width": [0]}]}})",
       "classifier.primitives[0].width"},
      {R"({"features": [{"opacity": 1}]})", "features[0].name"},
      {R"({"features": [{"name": "a", "opacity": 2}]})", "features[0].opacity"},
      {R"({"features": [{"name": "a", "centre": 2}]})", "features[0].centre"},
      {R"({"color": "guessed"})", "color"},
      {R"({"color": "learned", "colormap": "grey"})", "colormap"},
      {R"({"color": "learned", "colorRange": [0, 1]})", "colorRange"},
      {R"({"color": "learned", "rotate": [1, 0, 0]})", "rotate"},
      {R"({"color": "learned", "source": "sliced"})", "source"},
      {R"({"color": "learned", "draw": "mip"})", "draw"},
      {R"({"color": "learned", "clip": [0, 0, 0, 1, 1, 1]})", "clip"},
      {R"({"color": "learned", "via": "length"})", "via"},
      {R"({"color": "learned", "order": "mean"})", "order"},
      {R"({"color": "learned", "shading": "phong"})", "shading"},
      {R"({"color": "learned", "ao": {"on": true}})", "ao"},
  };
  for (const auto& [text, key] : cases) {
    EXPECT_NE(messageOf(text).find(key), std::string::npos) << text;
  }
}

TEST(Look, TellsWhereJsonIsBroken) {
  EXPECT_NE(messageOf("{\"field\": ").find("JSON"), std::string::npos);
  EXPECT_NE(messageOf("[1]").find("object"), std::string::npos);
}

TEST(Background, ReadsNamesAndHexAndComesBack) {
  EXPECT_EQ(backgroundFromText("white"), glm::dvec3(1.0));
  EXPECT_EQ(backgroundFromText("transparent"), std::nullopt);
  EXPECT_EQ(textFromBackground(backgroundFromText("#20a0ff")), "#20a0ff");
}

std::string complaintOf(const std::string& text) {
  try {
    lookFromText(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Look, GuessWhatAMisspeltValueMeant) {
  for (const auto& [text, meant] :
       {std::pair{R"({"source": "volum"})", "volume"},
        {R"({"frame": "orbti"})", "orbit"},
        {R"({"colormap": "viridsi"})", "viridis"},
        {R"({"background": "wihte"})", "white"},
        {R"({"classifier": {"kind": "gausian", "fields": ["f"]}})", "gaussian"}}) {
    const std::string complaint = complaintOf(text);
    EXPECT_NE(complaint.find("(did you mean '" + std::string(meant) + "'?)"), std::string::npos)
        << complaint;
  }
  EXPECT_EQ(complaintOf(R"({"source": 3})").find("did you mean"), std::string::npos);
}

TEST(Look, NameAKeyThatStandsTwice) {
  EXPECT_NE(complaintOf(R"({"view": "a", "ao": {"on": true}, "view": "b"})").find("\"view\" twice"),
            std::string::npos);
  EXPECT_NE(complaintOf(R"({"ao": {"on": true, "on": false}})").find("\"on\" twice"),
            std::string::npos);
  EXPECT_EQ(complaintOf(R"({"lights": [{"azimuth": 1}, {"azimuth": 2}], "ao": {"on": true}})"), "");
}

}  // namespace
}  // namespace vestige
