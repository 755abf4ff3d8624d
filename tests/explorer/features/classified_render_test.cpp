// SPDX-License-Identifier: BSD-3-Clause
//
// Looks with classifiers: stored fields classified anew, and features that a run integrated,
// against the reference rendering of the raw fields.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "explorer/features/feature_grid.h"
#include "explorer/features/feature_recomposition.h"
#include "explorer/inspect/info.h"
#include "explorer/renderer/renderer.h"
#include "proxy/base/error.h"
#include "proxy/format/layout/feature_layout.h"
#include "proxy/format/layout/field_layout.h"
#include "proxy/gl/device.h"
#include "tests/explorer/synthetic.h"
#include "tests/support/classified_renderer.h"

namespace vestige {
namespace {

using nlohmann::json;
using test::FieldScenes;
using test::RgbPicture;
using test::Scene;

constexpr ImageSize kSize{40, 40};
constexpr int kSamples = 33;
constexpr double kReferenceLength = 0.05;
const Box kBox{glm::dvec3(-1.0), glm::dvec3(1.0)};

const std::shared_ptr<gl::Device>& device() {
  static const std::shared_ptr<gl::Device> device = gl::Device::create();
  return device;
}

/// Shells around the middle, and a slope across them.
const FieldScenes& scenes() {
  static const FieldScenes scenes = [] {
    FieldScenes made({test::makeScene("shells", kSamples, kBox,
                                      [](glm::dvec3 p) { return 1.0 - glm::length(p); }),
                      test::makeScene("slope", kSamples, kBox,
                                      [](glm::dvec3 p) { return 2.0 * p.x + p.y * p.z; })});
    return made;
  }();
  return scenes;
}

const json kClassifier = {{"kind", "gaussian"},
                          {"fields", {"shells", "slope"}},
                          {"primitives",
                           {{{"name", "right"},
                             {"center", {0.4, 1.0}},
                             {"width", {0.15, 0.8}},
                             {"opacity", 0.4},
                             {"color", "#ff4020"}},
                            {{"name", "left"},
                             {"center", {0.3, -1.0}},
                             {"width", {0.1, 1.0}},
                             {"opacity", 0.3},
                             {"color", "#2060ff"}},
                            {{"name", "all"},
                             {"center", {0.7, 0.0}},
                             {"width", {0.08, 5.0}},
                             {"opacity", 0.5},
                             {"color", "#40ff40"}}}}};

std::unique_ptr<Classifier> resolved(const json& source = kClassifier) {
  return classifierFromJson(source, "")->resolved(scenes().domains, kReferenceLength);
}

Camera cameraAlong(const glm::dvec3& forward) {
  const glm::dvec3 up = std::abs(forward.z) > 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1);
  return frameBox(kBox, forward, up, 1.0);
}

ProxyHeader headerOf(std::string_view kind, const std::string& field, const std::string& view,
                     const Camera& camera) {
  ProxyHeader header = synthetic::header(kind, kSize);
  header.field = field;
  header.view = view;
  header.camera = camera;
  header.domain = kBox;
  header.base.reset();
  return header;
}

ProxyImage fieldProxy(std::size_t index, double tolerance = 1e-5) {
  const Scene& scene = scenes().fields[index];
  const FieldDomain& domain = scenes().domains[index];
  FieldSamples field;
  for (FieldAxis& axis : field.axes) axis = {kSamples, -1.0, 2.0 / (kSamples - 1), {}};
  field.low = domain.low;
  field.high = domain.high;
  for (const float value : scene.values)
    field.values.push_back(float((value - domain.low) / domain.range()));
  ProxyHeader header = headerOf(kind::kField, scene.name, "front", cameraAlong({0, 1, 0}));
  header.partition = IntervalPartition::uniform(domain.low, domain.high, 8);
  const auto [least, most] = std::minmax_element(scene.values.begin(), scene.values.end());
  header.statistics = {1000, 0, double(*least), double(*most), 0.0, 1.0, {1, 1}};
  return fieldImage(header, std::move(field), {1, tolerance});
}

/// The features of a view, walked in double with many steps a slab.
FeatureStack walkedFeatures(const Camera& camera, const std::string& view, int slabs,
                            const json& source = kClassifier) {
  constexpr int kSteps = 8;
  const auto classifier = resolved(source);
  const std::size_t channels = classifier->channels().size(), pixels = kSize.pixels();
  FeatureStack stack;
  stack.header = headerOf(kind::kSlicedFeatures, "features", view, camera);
  stack.header.partition.reset();
  const double middle = glm::dot(-camera.position, camera.forward);
  for (int s = 0; s <= slabs; ++s)
    stack.header.slabDepths.push_back(middle - 1.0 + 2.0 * s / slabs);
  stack.header.features =
      FeatureOrigin{std::shared_ptr<const Classifier>(resolved(source).release()), scenes().domains,
                    kReferenceLength};
  stack.slabs.assign(std::size_t(slabs), std::vector<float>(channels * pixels, 0.0f));
  std::vector<double> weights(channels);
  for (std::size_t p = 0; p < pixels; ++p) {
    const int x = int(p % std::size_t(kSize.width)), y = int(p / std::size_t(kSize.width));
    const double dz = 2.0 / slabs / kSteps;
    const auto at = [&](double depth) {
      return camera.unproject({x + 0.5, y + 0.5, depth}, kSize);
    };
    const glm::dvec3 probe = glm::abs(at(middle));
    if (std::max({probe.x, probe.y, probe.z}) > 1.0) continue;
    for (int i = 0; i < slabs * kSteps; ++i) {
      const double z = middle - 1.0 + i * dz;
      classifier->weights(scenes().sample(at(z), false), scenes().sample(at(z + dz), false),
                          weights);
      for (std::size_t c = 0; c < channels; ++c) {
        stack.slabs[std::size_t(i / kSteps)][c * pixels + p] += float(weights[c] * dz);
      }
    }
  }
  roundToStored(stack);
  return stack;
}

RgbPicture reference(const Camera& camera, const Classifier& classifier) {
  const std::vector<std::vector<ChannelOptics>> looks{classifier.optics(kReferenceLength)};
  return renderClassified(scenes(), classifier, looks, {.camera = camera, .size = kSize})[0];
}

double psnr(const Picture& picture, const RgbPicture& truth) {
  double squares = 0.0;
  for (std::size_t p = 0; p < truth.size.pixels(); ++p) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double difference = double(picture.rgba[4 * p + c]) - double(truth.rgb[3 * p + c]);
      squares += difference * difference;
    }
  }
  return -10.0 * std::log10(std::max(squares / double(truth.rgb.size()), 1e-12));
}

class ClassifiedLooks : public testing::Test {
 protected:
  void SetUp() override {
    ArchiveWriter writer(folder_.path() / "a.cdb", ExistingArchive::Refuse);
    std::vector<EncodedProxy> proxies{encodeProxy(fieldProxy(0)), encodeProxy(fieldProxy(1))};
    for (const auto& [view, forward] : views_) {
      proxies.push_back(encodeProxy(walkedFeatures(cameraAlong(forward), view, 16)));
    }
    writer.writeStep(proxies);
    renderer_ =
        std::make_unique<Renderer>(device(), std::make_shared<Archive>(folder_.path() / "a.cdb"));
  }

  Look look(const json& keys) const {
    json all = {{"size", {kSize.width, kSize.height}}, {"referenceLength", kReferenceLength}};
    all.update(keys);
    return lookFromJson(all);
  }

  std::string failureOf(const json& keys) const {
    try {
      renderer_->render(look(keys));
    } catch (const Error& error) {
      return error.what();
    }
    return "nothing failed";
  }

  const std::vector<std::pair<std::string, glm::dvec3>> views_{
      {"front", {0, 1, 0}}, {"left", {1, 0, 0}}, {"top", {0, 0, -1}}};
  synthetic::TemporaryFolder folder_;
  std::unique_ptr<Renderer> renderer_;
};

TEST_F(ClassifiedLooks, ClassifyStoredFieldsAsTheReferenceDoes) {
  const Rendered made = renderer_->render(look({{"classifier", kClassifier}, {"source", "field"}}));
  EXPECT_GT(psnr(made.picture, reference(made.camera, *resolved())), 45.0);
  const Rendered turned = renderer_->render(
      look({{"classifier", kClassifier}, {"source", "field"}, {"rotate", {35, 20, 0}}}));
  EXPECT_GT(psnr(turned.picture, reference(turned.camera, *resolved())), 45.0);
}

TEST_F(ClassifiedLooks, CustomiseByPosition) {
  const json half = {{"resolution", 32}, {"corners", {{"opacity", 0.5}}}};
  const Rendered made = renderer_->render(
      look({{"classifier", kClassifier}, {"source", "field"}, {"customization", half}}));
  const Rendered plain =
      renderer_->render(look({{"classifier", kClassifier}, {"source", "field"}}));
  double worst = 0.0;
  for (std::size_t i = 3; i < made.picture.rgba.size(); i += 4) {
    const double left = std::sqrt(1.0 - double(plain.picture.rgba[i]));
    worst = std::max(worst, std::abs(1.0 - left - double(made.picture.rgba[i])));
  }
  EXPECT_LT(worst, 0.02);
  const json gamma = {{"resolution", 32}, {"corners", {{"gamma", 2}}}};
  EXPECT_THROW(renderer_->render(look(
                   {{"classifier", kClassifier}, {"source", "field"}, {"customization", gamma}})),
               Error);
}

TEST_F(ClassifiedLooks, ClassifyByGradientsOfSeveralFields) {
  json thick = kClassifier;
  for (json& primitive : thick["primitives"]) primitive["thickness"] = 0.5;
  const Rendered made = renderer_->render(look({{"classifier", thick}, {"source", "field"}}));
  EXPECT_GT(psnr(made.picture, reference(made.camera, *resolved(thick))), 38.0);
}

TEST_F(ClassifiedLooks, TakeFeaturesOfTheRunWhereTheClassifierIsItsOwn) {
  const Rendered made = renderer_->render(look({{"classifier", kClassifier}}));
  ASSERT_FALSE(made.notes.empty());
  EXPECT_NE(made.notes.front().find("sliced features answer"), std::string::npos);
  EXPECT_GT(psnr(made.picture, reference(made.camera, *resolved())), 40.0);
  json moved = kClassifier;
  moved["primitives"][0]["center"] = {0.45, 1.0};
  const Rendered other = renderer_->render(look({{"classifier", moved}}));
  EXPECT_NE(other.notes.front().find("as stored"), std::string::npos) << other.notes.front();
  EXPECT_NE(failureOf({{"classifier", moved}, {"source", "features"}}).find("centres and widths"),
            std::string::npos);
}

TEST_F(ClassifiedLooks, EditFeaturesOneByOne) {
  const json edits = {{{"name", "right"}, {"opacity", 0.05}, {"color", "#ffffff"}},
                      {{"name", "all"}, {"enabled", false}}};
  const Rendered made = renderer_->render(look({{"field", "features"}, {"features", edits}}));
  auto classifier = resolved();
  classifier->features()[0].opacity = 0.05;
  classifier->features()[0].color = {1, 1, 1};
  classifier->features()[2].enabled = false;
  const RgbPicture truth = reference(made.camera, *classifier);
  EXPECT_GT(psnr(made.picture, truth), 40.0);
  // The unedited picture is another one, so that an edit which does nothing shows.
  EXPECT_LT(psnr(renderer_->render(look({{"field", "features"}})).picture, truth), 25.0);
}

TEST_F(ClassifiedLooks, ShowFeaturesFromWhereNoStackLooks) {
  const Rendered made =
      renderer_->render(look({{"field", "features"}, {"rotate", {40, 30, 0}}, {"trust", true}}));
  Look plain = look({{"field", "features"}, {"rotate", {40, 30, 0}}});
  EXPECT_GT(psnr(renderer_->render(plain).picture, reference(made.camera, *resolved())), 27.0);
  EXPECT_EQ(made.trust.size(), kSize.pixels());
}

/// Root of the mean square of linear colours in the pixels of each class of trust, and how many.
struct ClassErrors {
  std::array<double, 3> error{}, pixels{};
};

ClassErrors errorsOf(const Rendered& made, const Picture& picture, const RgbPicture& truth) {
  ClassErrors found;
  for (std::size_t p = 0; p < truth.size.pixels(); ++p) {
    const auto c = std::size_t(made.trust[p]);
    found.pixels[c] += 1.0;
    for (std::size_t i = 0; i < 3; ++i)
      found.error[c] +=
          std::pow(double(picture.rgba[4 * p + i]) - double(truth.rgb[3 * p + i]), 2.0) / 3.0;
  }
  for (std::size_t c = 0; c < 3; ++c)
    found.error[c] = std::sqrt(found.error[c] / std::max(found.pixels[c], 1.0));
  return found;
}

void expectGraded(const ClassErrors& found) {
  for (const double pixels : found.pixels) EXPECT_GT(pixels, 15.0);
  EXPECT_LT(found.error[0], found.error[1]);
  EXPECT_LT(found.error[1], found.error[2]);
}

TEST_F(ClassifiedLooks, AreTrustedAsFarAsTheStatedErrorOfTheirFieldsGoes) {
  json keys = {{"classifier", kClassifier}, {"source", "field"}, {"rotate", {35, 20, 0}}};
  const json trusted = [&] {
    json with = keys;
    with["trust"] = true;
    return with;
  }();
  const Rendered exact = renderer_->render(look(trusted));
  EXPECT_TRUE(std::all_of(exact.trust.begin(), exact.trust.end(),
                          [](Trust trust) { return trust == Trust::Data; }));
  const auto path = folder_.path() / "coarse.cdb";
  ArchiveWriter(path, ExistingArchive::Refuse)
      .writeStep({encodeProxy(fieldProxy(0, 0.05)), encodeProxy(fieldProxy(1, 0.05))});
  Renderer coarse(device(), std::make_shared<Archive>(path));
  const Rendered made = coarse.render(look(trusted));
  expectGraded(
      errorsOf(made, coarse.render(look(keys)).picture, reference(made.camera, *resolved())));
}

TEST_F(ClassifiedLooks, TrustOfGradientsFallsWithTheirFields) {
  json keys = {{"classifier", {{"kind", "gaussian"}, {"fields", {"shells", "slope"}}}},
               {"source", "field"},
               {"trust", true}};
  keys["classifier"]["primitives"] = {
      {{"center", {0.5, 0.0}}, {"width", {0.3, 0.6}}, {"thickness", 0.5}, {"opacity", 0.9}}};
  const auto dataShare = [&](Renderer& renderer) {
    const Rendered made = renderer.render(look(keys));
    return double(std::count(made.trust.begin(), made.trust.end(), Trust::Data)) /
           double(made.trust.size());
  };
  const auto path = folder_.path() / "coarse.cdb";
  ArchiveWriter(path, ExistingArchive::Refuse)
      .writeStep({encodeProxy(fieldProxy(0, 0.05)), encodeProxy(fieldProxy(1, 0.05))});
  Renderer coarse(device(), std::make_shared<Archive>(path));
  EXPECT_EQ(dataShare(*renderer_), 1.0);
  EXPECT_LT(dataShare(coarse), 0.9);
}

TEST_F(ClassifiedLooks, TurnedFeaturesAreTrustedAsFarAsTheirSlabsPlaceThem) {
  const json keys = {{"field", "features"}, {"rotate", {40, 30, 0}}};
  json trusted = keys;
  trusted["trust"] = true;
  const Rendered made = renderer_->render(look(trusted));
  expectGraded(
      errorsOf(made, renderer_->render(look(keys)).picture, reference(made.camera, *resolved())));
}

TEST_F(ClassifiedLooks, OfOneValueAreTransferFunctions) {
  const json one = {
      {"kind", "gaussian"},
      {"fields", {"shells"}},
      {"primitives",
       {{{"name", "outer"}, {"center", {0.3}}, {"width", {0.1}}, {"color", "#ff4020"}},
        {{"name", "inner"}, {"center", {0.7}}, {"width", {0.2}}, {"color", "#2060ff"}}}}};
  const Rendered made = renderer_->render(look({{"classifier", one}}));
  const FieldScenes shells({scenes().fields[0]});
  const auto classifier = classifierFromJson(one, "")->resolved(shells.domains, kReferenceLength);
  const std::vector<std::vector<ChannelOptics>> looks{classifier->optics(kReferenceLength)};
  const RgbPicture truth =
      renderClassified(shells, *classifier, looks, {.camera = made.camera, .size = kSize})[0];
  EXPECT_GT(psnr(made.picture, truth), 40.0);
  const Rendered off = renderer_->render(
      look({{"classifier", one}, {"features", {{{"name", "outer"}, {"enabled", false}}}}}));
  EXPECT_LT(psnr(off.picture, truth), 30.0);
}

TEST_F(ClassifiedLooks, ShowTheGreatestValue) {
  const json maximum = {{"kind", "maximum"}, {"fields", {"shells"}}, {"colormap", "grey"}};
  const Rendered made = renderer_->render(look({{"classifier", maximum}}));
  const auto classifier = resolved(maximum);
  const RgbPicture truth = test::renderMaximum(FieldScenes({scenes().fields[0]}), *classifier,
                                               {.camera = made.camera, .size = kSize});
  EXPECT_GT(psnr(made.picture, truth), 35.0);
}

TEST_F(ClassifiedLooks, ShowMaterialsLitByTheGradientOfTheirDensity) {
  const json materials = {
      {"kind", "materials"},
      {"fields", {"shells"}},
      {"materials",
       {{{"name", "air"}, {"mean", -0.5}, {"deviation", 0.2}, {"density", 0.0}, {"opacity", 0.0}},
        {{"name", "flesh"},
         {"mean", 0.3},
         {"deviation", 0.1},
         {"density", 1.0},
         {"opacity", 0.1},
         {"color", "#ff8060"}},
        {{"name", "bone"},
         {"mean", 0.8},
         {"deviation", 0.1},
         {"density", 2.0},
         {"opacity", 0.8},
         {"color", "#ffffff"}}}}};
  const FieldScenes shells({scenes().fields[0]});
  const auto classifier =
      classifierFromJson(materials, "")->resolved(shells.domains, kReferenceLength);
  const std::vector<std::vector<ChannelOptics>> looks{classifier->optics(kReferenceLength)};
  for (const bool lit : {false, true}) {
    json keys = {{"classifier", materials}};
    if (lit) {
      keys["shading"] = "phong";
      keys["lights"] = {{{"azimuth", 0}, {"elevation", 0}}};
      keys["material"] = {{"specular", 0.2}};
    }
    const Rendered made = renderer_->render(look(keys));
    const RgbPicture truth = renderClassified(
        shells, *classifier, looks, {.camera = made.camera, .size = kSize, .lit = lit})[0];
    // The reference lights gradients of any size; here a density that is all but flat is no
    // surface.
    EXPECT_GT(psnr(made.picture, truth), lit ? 21.0 : 40.0) << lit;
  }
}

TEST_F(ClassifiedLooks, ShowBoundariesAndColourVolumesAsTheReferenceDoes) {
  const json boundaries = {
      {"kind", "boundaries"},
      {"fields", {"shells"}},
      {"boundaries",
       {{{"name", "skin"},
         {"value", 0.2},
         {"thickness", 0.1},
         {"opacity", 0.1},
         {"color", "#ffa080"}},
        {{"name", "core"}, {"value", 0.7}, {"thickness", 0.1}, {"opacity", 0.8}}}}};
  const json colors = {{"kind", "color"},
                       {"fields", {"shells", "slope", "shells"}},
                       {"range", {-1, 2}},
                       {"opacity", 0.2}};
  for (const json& source : {boundaries, colors}) {
    const Rendered made = renderer_->render(look({{"classifier", source}}));
    std::vector<Scene> fields;
    for (const std::string name : source["fields"])
      fields.push_back(scenes().fields[name == "slope"]);
    const FieldScenes own(fields);
    const auto classifier = classifierFromJson(source, "")->resolved(own.domains, kReferenceLength);
    const std::vector<std::vector<ChannelOptics>> looks{classifier->optics(kReferenceLength)};
    const RgbPicture truth =
        renderClassified(own, *classifier, looks, {.camera = made.camera, .size = kSize})[0];
    EXPECT_GT(psnr(made.picture, truth), 35.0) << source["kind"];
  }
}

TEST_F(ClassifiedLooks, AreListedWithTheirFeatures) {
  const json info = archiveInfo(Archive(folder_.path() / "a.cdb"));
  ASSERT_EQ(info["features"].size(), 1u);
  EXPECT_EQ(info["features"][0]["name"], "features");
  EXPECT_EQ(info["features"][0]["stacks"], (json{"front", "left", "top"}));
  // What info lists is a classifier that looks take.
  EXPECT_NO_THROW(classifierFromJson(info["features"][0]["classifier"], ""));
  const std::string text = infoText(info);
  EXPECT_NE(text.find("gaussian of shells, slope: right, left, all"), std::string::npos) << text;
  EXPECT_EQ(text.find("field features"), std::string::npos) << text;
}

TEST_F(ClassifiedLooks, NameWhatIsWrong) {
  EXPECT_NE(failureOf({{"field", "features"}, {"features", {{{"name", "no"}, {"opacity", 1}}}}})
                .find("'no'"),
            std::string::npos);
  EXPECT_NE(failureOf({{"field", "shells"}, {"features", {{{"name", "no"}, {"opacity", 1}}}}})
                .find("'features'"),
            std::string::npos);
  EXPECT_NE(failureOf({{"classifier", kClassifier}, {"opacity", {{0, 1}}}}).find("'opacity'"),
            std::string::npos);
  EXPECT_NE(
      failureOf({{"classifier", kClassifier}, {"draw", "mip"}, {"source", "field"}}).find("'draw'"),
      std::string::npos);
  json unknown = kClassifier;
  unknown["fields"] = {"shells", "mist"};
  EXPECT_NE(failureOf({{"classifier", unknown}}).find("'mist'"), std::string::npos);
}

TEST(FeatureRecomposition, KeepsTheOpacityOfEveryRayWhateverTheEdit) {
  const FeatureStack stack = walkedFeatures(cameraAlong({0, 1, 0}), "front", 6);
  auto classifier = resolved();
  classifier->features()[1].opacity = 0.9;
  const auto optics = classifier->optics(kReferenceLength);
  const RecomposedFeatures made = recomposed(stack, optics, true);
  const std::size_t pixels = kSize.pixels();
  ASSERT_EQ(made.doubt.size(), pixels);
  for (std::size_t p = 0; p < pixels; ++p) {
    double depth = 0.0;
    for (const auto& slab : stack.slabs) {
      for (std::size_t i = 0; i < optics.size(); ++i)
        depth += optics[i].extinction * double(slab[i * pixels + p]);
    }
    EXPECT_NEAR(made.picture.rgba[4 * p + 3], 1.0 - std::exp(-depth), 1e-5);
  }
}

TEST(FeatureRecomposition, DoesNotDoubtASingleFeature) {
  json one = kClassifier;
  one["primitives"].erase(1);
  one["primitives"].erase(1);
  const FeatureStack stack = walkedFeatures(cameraAlong({0, 1, 0}), "front", 6, one);
  const RecomposedFeatures made = recomposed(stack, resolved(one)->optics(kReferenceLength), true);
  for (const float doubt : made.doubt) EXPECT_LT(doubt, 1e-5f);
}

TEST(FeatureGrid, AgreesWithEveryStack) {
  std::vector<FeatureStack> stacks;
  for (const glm::dvec3 forward : {glm::dvec3(0, 1, 0), {1, 0, 0}, {0, 0, -1}}) {
    stacks.push_back(walkedFeatures(cameraAlong(forward), "view", 10));
  }
  const FeatureGrid grid = fusedFeatures(stacks);
  const std::size_t pixels = kSize.pixels();
  // Along the first stack's rays the weights add up to what it stores.
  const double cell = 2.0 / grid.size.z;
  double worst = 0.0;
  for (std::size_t p = 0; p < pixels; ++p) {
    for (std::size_t i = 0; i < grid.channels; ++i) {
      double stored = 0.0, made = 0.0;
      for (const auto& slab : stacks[0].slabs) stored += double(slab[i * pixels + p]);
      for (int z = 0; z < grid.size.z; ++z) {
        made += cell * double(grid.weights[(std::size_t(z) * pixels + p) * grid.channels + i]);
      }
      worst = std::max(worst, std::abs(stored - made));
    }
  }
  EXPECT_LT(worst, 1e-3);
  for (const float weight : grid.weights) ASSERT_TRUE(weight >= 0.0f && std::isfinite(weight));
}

TEST(FeatureGrid, IsTruerFromElsewhereWithThreeStacksThanWithOne) {
  const auto classifier = resolved();
  std::vector<FeatureStack> stacks;
  for (const glm::dvec3 forward : {glm::dvec3(0, 1, 0), {1, 0, 0}, {0, 0, -1}}) {
    stacks.push_back(walkedFeatures(cameraAlong(forward), "view", 10));
  }
  // Cell by cell against the fields themselves.
  const auto errorOf = [&](const FeatureGrid& grid) {
    std::vector<double> weights(grid.channels);
    double squares = 0.0;
    for (int z = 0; z < grid.size.z; ++z) {
      for (int y = 0; y < grid.size.y; ++y) {
        for (int x = 0; x < grid.size.x; ++x) {
          const glm::dvec3 at(grid.worldFromGrid *
                              glm::dvec4((glm::dvec3(x, y, z) + 0.5) / glm::dvec3(grid.size), 1.0));
          const glm::dvec3 far = glm::abs(at);
          if (std::max({far.x, far.y, far.z}) > 0.95) continue;
          const FieldSample sample = scenes().sample(at, false);
          classifier->weights(sample, sample, weights);
          const std::size_t first =
              grid.channels * ((std::size_t(z) * std::size_t(grid.size.y) + std::size_t(y)) *
                                   std::size_t(grid.size.x) +
                               std::size_t(x));
          for (std::size_t i = 0; i < grid.channels; ++i) {
            const double difference = double(grid.weights[first + i]) - weights[i];
            squares += difference * difference;
          }
        }
      }
    }
    return std::sqrt(squares);
  };
  EXPECT_LT(errorOf(fusedFeatures(stacks)),
            0.7 * errorOf(fusedFeatures(std::span(stacks).first(1))));
}

}  // namespace
}  // namespace vestige
