// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <glm/trigonometric.hpp>
#include <nlohmann/json.hpp>
#include <numeric>

#include "explorer/inspect/info.h"
#include "explorer/renderer/renderer.h"
#include "explorer/stacks/stack_grid.h"
#include "proxy/archive/archive.h"
#include "proxy/base/error.h"
#include "proxy/format/layout/field_layout.h"
#include "proxy/format/layout/proxy_layout.h"
#include "proxy/gl/device.h"
#include "tests/explorer/synthetic.h"
#include "tests/support/cpu_renderer.h"
#include "tests/support/walked_stack.h"

namespace vestige {
namespace {

std::shared_ptr<gl::Device> device() {
  static const std::shared_ptr<gl::Device> shared = gl::Device::create();
  return shared;
}

/// A field with folds, so that rays turn within slabs.
const test::Scene& scene() {
  static const test::Scene made =
      test::makeScene("folds", 40, {glm::dvec3(-1.0), glm::dvec3(1.0)}, [](glm::dvec3 p) {
        return 0.5 + 0.3 * std::sin(4.0 * p.x * p.y + p.z) + 0.2 * std::cos(5.0 * p.z - p.y);
      });
  return made;
}

IntervalPartition partition() { return IntervalPartition::uniform(0.0, 1.0, 8); }

TransferFunction baseFunction() {
  return {{{0.0, 0.0}, {0.3, 0.02}, {0.6, 0.0}, {0.8, 0.4}, {1.0, 0.1}},
          0.2,
          Colormap::named("viridis"),
          0.0,
          1.0};
}

SlicedStack stackAlong(const std::string& view, glm::dvec3 forward, glm::dvec3 up) {
  const test::VoxelView at = test::voxelView(scene(), forward, up);
  SlicedStack stack = test::walkedStack(scene(), at.camera, at.size, partition(), 8, 32);
  stack.header.view = view;
  stack.header.base = baseFunction();
  stack.header.statistics.high = 1.0;
  return stack;
}

test::Medium medium() {
  return [](double value) {
    const TransferFunction function = baseFunction();
    return test::Optics{function.extinction(value), function.color(value)};
  };
}

test::RgbPicture truth(const Camera& camera, ImageSize size) {
  const test::Medium table = test::tabulated(medium(), 0.0, 1.0);
  return test::renderContinuous(scene(), camera, size, std::span(&table, 1), 4)[0];
}

double meanDifference(const Picture& picture, const test::RgbPicture& wanted) {
  EXPECT_EQ(picture.size, wanted.size);
  double sum = 0.0;
  for (std::size_t i = 0; i < wanted.size.pixels(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      sum += std::abs(double(picture.rgba[4 * i + c]) - double(wanted.rgb[3 * i + c]));
    }
  }
  return sum / double(wanted.rgb.size());
}

double meanDifference(const Picture& a, const Picture& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i)
    sum += std::abs(double(a.rgba[i]) - double(b.rgba[i]));
  return sum / double(a.rgba.size());
}

/// An archive with three stacks and the run's picture of the first.
class StackRendering : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new synthetic::TemporaryFolder;
    ArchiveWriter writer(folder_->path() / "stacks.cdb", ExistingArchive::Refuse);
    std::vector<EncodedProxy> proxies;
    const auto add = [&](const SlicedStack& stack) { proxies.push_back(encodeProxy(stack)); };
    const SlicedStack front = stackAlong("stack-front", {0, 1, 0}, {0, 0, 1});
    add(front);
    add(stackAlong("stack-left", {1, 0, 0}, {0, 0, 1}));
    add(stackAlong("stack-top", {0, 0, -1}, {0, 1, 0}));
    const test::RgbPicture own = truth(front.header.camera, front.header.size);
    const std::size_t pixels = front.header.size.pixels();
    std::vector<float> rgb(3 * pixels), transmittance(pixels, 0.0f);
    for (std::size_t i = 0; i < pixels; ++i) {
      for (std::size_t c = 0; c < 3; ++c) rgb[c * pixels + i] = own.rgb[3 * i + c];
    }
    proxies.push_back(encodeProxy(referenceImage(front.header, rgb, transmittance)));
    writer.writeStep(proxies);
  }
  static void TearDownTestSuite() { delete folder_; }

  Renderer renderer() const {
    return {device(), std::make_shared<const Archive>(folder_->path() / "stacks.cdb")};
  }
  static Look plainLook() {
    Look look;
    look.background.reset();
    return look;
  }
  static bool says(const Rendered& rendered, const std::string& text) {
    for (const std::string& note : rendered.notes) {
      if (note.find(text) != note.npos) return true;
    }
    return false;
  }

  static synthetic::TemporaryFolder* folder_;
};
synthetic::TemporaryFolder* StackRendering::folder_ = nullptr;

TEST_F(StackRendering, AStackAnswersItsOwnView) {
  Look look = plainLook();
  look.trust = true;
  look.source = Source::Sliced;
  Renderer made = renderer();
  const Rendered rendered = made.render(look);
  EXPECT_TRUE(says(rendered, "uses sliced: 8 slabs of"));
  EXPECT_GT(rendered.shares.data, 0.1);
  EXPECT_GT(rendered.shares.data + rendered.shares.interpolation, 0.9);
  look.trust = false;
  EXPECT_LT(
      meanDifference(made.render(look).picture, truth(rendered.camera, rendered.picture.size)),
      0.01);
  look.source = Source::Auto;
  look.colormap = "hot";
  EXPECT_TRUE(says(made.render(look), "uses sliced"));
}

TEST_F(StackRendering, LongPixelsAreShownInSquareOnes) {
  const synthetic::TemporaryFolder folder;
  test::VoxelView at = test::voxelView(scene(), {0, 1, 0}, {0, 0, 1});
  at.size.height = 20;
  at.camera.pixelAspect = 0.5;
  SlicedStack stack = test::walkedStack(scene(), at.camera, at.size, partition(), 8, 32);
  stack.header.view = "stack-front";
  stack.header.base = baseFunction();
  stack.header.statistics.high = 1.0;
  ArchiveWriter(folder.path() / "a.cdb", ExistingArchive::Refuse).writeStep({encodeProxy(stack)});
  Renderer made(device(), std::make_shared<const Archive>(folder.path() / "a.cdb"));
  Look look = plainLook();
  for (const double azimuth : {0.0, 20.0}) {
    look.rotate.azimuth = azimuth;
    const Rendered rendered = made.render(look);
    EXPECT_EQ(rendered.picture.size, (ImageSize{40, 40}));
    EXPECT_EQ(rendered.camera.pixelAspect, 1.0);
    EXPECT_LT(meanDifference(rendered.picture, truth(rendered.camera, rendered.picture.size)), 0.02)
        << azimuth;
  }
  look = plainLook();
  look.size = ImageSize{100, 80};
  const Rendered wide = made.render(look);
  EXPECT_EQ(wide.picture.size, look.size);
  EXPECT_LT(meanDifference(wide.picture, truth(wide.camera, wide.picture.size)), 0.02);
}

TEST_F(StackRendering, ManyIntervalsAreShownAsFewAre) {
  // Their quarters are more channels than uniforms hold.
  const synthetic::TemporaryFolder folder;
  const test::VoxelView at = test::voxelView(scene(), {0, 1, 0}, {0, 0, 1});
  SlicedStack stack = test::walkedStack(scene(), at.camera, at.size,
                                        IntervalPartition::uniform(0.0, 1.0, 32), 8, 32);
  stack.header.view = "stack-front";
  stack.header.base = baseFunction();
  stack.header.statistics.high = 1.0;
  ArchiveWriter(folder.path() / "a.cdb", ExistingArchive::Refuse).writeStep({encodeProxy(stack)});
  Renderer made(device(), std::make_shared<const Archive>(folder.path() / "a.cdb"));
  for (const bool trust : {false, true}) {
    Look look = plainLook();
    look.trust = trust;
    const Rendered rendered = made.render(look);
    if (trust) {
      EXPECT_GT(rendered.shares.data, 0.1);
    } else {
      EXPECT_LT(meanDifference(rendered.picture, truth(rendered.camera, rendered.picture.size)),
                0.01);
    }
  }
}

TEST_F(StackRendering, MeasuresItsErrorAgainstTheRunsOwnPicture) {
  const auto own = renderer().ownLook(plainLook());
  ASSERT_TRUE(own.has_value());
  EXPECT_EQ(own->view, "stack-front");
  double sum = 0.0;
  for (std::size_t i = 0; i < own->made.rgba.size(); ++i) {
    if (i % 4 != 3) sum += std::abs(double(own->made.rgba[i]) - double(own->stored.rgba[i]));
  }
  EXPECT_LT(sum / double(own->made.rgba.size()), 0.01);
  Look left = plainLook();
  left.view = "stack-left";
  EXPECT_FALSE(renderer().ownLook(left).has_value());
}

TEST_F(StackRendering, ACustomisedPictureIsNotWhatTheStackMakes) {
  const synthetic::TemporaryFolder folder;
  const auto path = folder.path() / "a.cdb";
  const SlicedStack front = stackAlong("stack-front", {0, 1, 0}, {0, 0, 1});
  const std::size_t pixels = front.header.size.pixels();
  ProxyImage picture = referenceImage(front.header, std::vector<float>(3 * pixels, 0.5f),
                                      std::vector<float>(pixels, 0.0f));
  for (const bool customized : {false, true}) {
    if (customized) picture.header.customization.emplace().corners[0].opacity = 2.0;
    ArchiveWriter(path, ExistingArchive::Overwrite)
        .writeStep({encodeProxy(front), encodeProxy(picture)});
    Renderer made(device(), std::make_shared<const Archive>(path));
    EXPECT_EQ(made.ownLook(plainLook()).has_value(), !customized);
  }
}

TEST_F(StackRendering, TurnedViewsAreDrawnFromAllStacks) {
  Renderer made = renderer();
  for (const auto& [azimuth, elevation] : {std::pair{10.0, 0.0}, {40.0, 30.0}, {120.0, -70.0}}) {
    Look look = plainLook();
    look.rotate = {azimuth, elevation, 0.0};
    const Rendered rendered = made.render(look);
    EXPECT_TRUE(says(rendered, "stacks 'stack-front', 'stack-left', 'stack-top'"));
    EXPECT_LT(meanDifference(rendered.picture, truth(rendered.camera, rendered.picture.size)), 0.02)
        << azimuth;
  }
}

/// Spearman's coefficient: how far two lists are in the same order, 1 = wholly.
double rankCorrelation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto ranks = [](const std::vector<double>& values) {
    std::vector<std::size_t> order(values.size());
    std::iota(order.begin(), order.end(), std::size_t(0));
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t i, std::size_t j) { return values[i] < values[j]; });
    std::vector<double> rank(values.size());
    for (std::size_t i = 0; i < order.size(); ++i) rank[order[i]] = double(i);
    return rank;
  };
  const std::vector<double> x = ranks(a), y = ranks(b);
  const double middle = 0.5 * double(a.size() - 1);
  double both = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    both += (x[i] - middle) * (y[i] - middle);
    squares += (x[i] - middle) * (x[i] - middle);
  }
  return both / squares;
}

TEST_F(StackRendering, PixelsOfTurnedStacksAreTrustedAsFarAsTheyAreTrue) {
  const synthetic::TemporaryFolder folder;
  const auto one = folder.path() / "one.cdb";
  ArchiveWriter(one, ExistingArchive::Refuse)
      .writeStep({encodeProxy(stackAlong("stack-front", {0, 1, 0}, {0, 0, 1}))});
  for (const auto& path : {folder_->path() / "stacks.cdb", one}) {
    Renderer made(device(), std::make_shared<const Archive>(path));
    std::array<double, 3> sum{}, count{};
    std::vector<double> trust, error;
    for (const auto& [azimuth, elevation] :
         {std::pair{10.0, 0.0}, {40.0, 30.0}, {90.0, 0.0}, {120.0, -70.0}}) {
      Look look = plainLook();
      look.rotate = {azimuth, elevation, 0.0};
      const Rendered rendered = made.render(look);
      look.trust = true;
      const Rendered trusted = made.render(look);
      const test::RgbPicture wanted = truth(rendered.camera, rendered.picture.size);
      for (std::size_t i = 0; i < wanted.size.pixels(); ++i) {
        if (rendered.picture.rgba[4 * i + 3] <= 1.0f / 255.0f) continue;
        double worst = 0.0;
        for (std::size_t c = 0; c < 3; ++c)
          worst = std::max(worst, std::abs(double(rendered.picture.rgba[4 * i + c]) -
                                           double(wanted.rgb[3 * i + c])));
        const auto grade = std::size_t(trusted.trust[i]);
        sum[grade] += worst;
        count[grade] += 1.0;
        trust.push_back(double(grade));
        error.push_back(worst);
      }
    }
    const double all = count[0] + count[1] + count[2];
    const double data = sum[0] / count[0], between = sum[1] / count[1], guess = sum[2] / count[2];
    EXPECT_GT(count[0], 0.1 * all);
    EXPECT_GT(count[1], 0.1 * all);
    EXPECT_GT(count[2], 0.0);
    EXPECT_LT(data, 0.25 * double(kDoubtData));
    EXPECT_LT(3.0 * data, between);
    // What no stack saw is a guess however well it turns out; one stack's come out like the rest.
    EXPECT_LT(path == one ? 3.0 * data : between, guess);
    EXPECT_GT(rankCorrelation(trust, error), 0.3) << path;
  }
}

TEST_F(StackRendering, GridsShowSurfacesMaximaLightAndClips) {
  Renderer made = renderer();
  Look look = plainLook();
  look.rotate = {30.0, 20.0, 0.0};
  const auto light = [&](const Look& l) {
    const Rendered rendered = made.render(l);
    double sum = 0.0;
    for (const float v : rendered.picture.rgba) sum += double(v);
    EXPECT_TRUE(std::isfinite(sum));
    return sum;
  };
  const double plain = light(look);
  Look lit = look, clipped = look, surface = look, mip = look;
  lit.shading = Shading::Phong;
  clipped.clip = Box{glm::dvec3(-1.0), {1.0, 0.0, 1.0}};
  surface.draw = Draw::Isosurface;
  surface.isosurfaces = {{0.7, 1.0}};
  mip.draw = Draw::Mip;
  EXPECT_NE(light(lit), plain);
  EXPECT_LT(light(clipped), plain);
  EXPECT_GT(light(surface), 0.0);
  EXPECT_GT(light(mip), plain);
}

TEST_F(StackRendering, CustomisedLooksAreDrawnFromTheGrid) {
  Look look = plainLook();
  const Rendered plain = renderer().render(look);
  look.customization.emplace().resolution = 32;
  EXPECT_EQ(renderer().render(look).picture.rgba, plain.picture.rgba);  // nothing is changed
  for (SeedParameters& corner : look.customization->corners) corner.opacity = 2.0;
  const Rendered twice = renderer().render(look);
  EXPECT_TRUE(says(twice, "as a grid"));
  look.customization.reset();
  look.referenceLength = 0.1;  // of opacities that were given for 0.2: twice the extinction
  EXPECT_LT(meanDifference(twice.picture, renderer().render(look).picture), 0.01);
}

TEST_F(StackRendering, EnhancementIsForTheStoredView) {
  Look look = plainLook();
  look.enhance.on = true;
  Renderer made = renderer();
  EXPECT_TRUE(says(made.render(look), "uses sliced"));
  look.rotate.azimuth = 20.0;
  try {
    made.render(look);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::Config);
  }
}

TEST_F(StackRendering, SaysWhenThereIsNoStack) {
  synthetic::writeArchive(folder_->path() / "flat.cdb", {32, 32}, 1);
  Look look = plainLook();
  look.source = Source::Sliced;
  try {
    Renderer(device(), std::make_shared<const Archive>(folder_->path() / "flat.cdb")).render(look);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::NotFound);
    EXPECT_NE(std::string(error.what()).find("no sliced proxy"), std::string::npos);
  }
}

TEST_F(StackRendering, InfoStatesTheErrorOfEachStack) {
  const nlohmann::json info = archiveInfo(Archive(folder_->path() / "stacks.cdb"));
  ASSERT_EQ(info["stacks"].size(), 3u);
  EXPECT_EQ(info["stacks"][0]["levels"], 32);
  EXPECT_EQ(info["stacks"][0]["slabs"], 8);
  EXPECT_NE(infoText(info).find("stack of field in view stack-front: 8 slabs of 0.25"),
            std::string::npos);
  EXPECT_NE(infoText(info).find("truest for field from elsewhere: sliced (values within 12.5 % of "
                                "the range, places within 12.5 % of the depth)\n"),
            std::string::npos)
      << infoText(info);
}

TEST_F(StackRendering, TheRunsOwnPictureIsTakenOrNamedWhereItIsExact) {
  Renderer made = renderer();
  Look look = plainLook();
  EXPECT_TRUE(says(made.render(look), "uses reference"));
  EXPECT_TRUE(says(made.render(look), "it is exact"));
  look.clip = Box{glm::dvec3(-1.0), {1.0, 0.0, 1.0}};
  EXPECT_TRUE(says(made.render(look), "uses sliced")) << "the reference cannot be cut";
  look = plainLook();
  look.colormap = "hot";
  EXPECT_TRUE(says(made.render(look), "uses sliced"));
  EXPECT_FALSE(says(made.render(look), "it is exact"));
  look = plainLook();
  look.rotate.azimuth = 10.0;
  EXPECT_FALSE(says(made.render(look), "(source reference) is exact"));
}

TEST_F(StackRendering, AutoTakesStacksOrTheFieldByWhatTheyState) {
  const auto noteOf = [&](const FieldReduction& reduction, const char* name, const Look& look) {
    const auto path = folder_->path() / name;
    ArchiveWriter writer(path, ExistingArchive::Refuse);
    FieldSamples samples;
    for (std::size_t a = 0; a < 3; ++a) {
      samples.axes[a] = {scene().size[a], scene().origin[int(a)], scene().spacing[int(a)], {}};
    }
    samples.values = scene().values;
    SlicedStack stack = stackAlong("stack-front", {0, 1, 0}, {0, 0, 1});
    writer.writeStep(
        {encodeProxy(stack), encodeProxy(fieldImage(stack.header, std::move(samples), reduction))});
    std::string notes;
    for (const std::string& note :
         Renderer(device(), std::make_shared<const Archive>(path)).render(look).notes) {
      notes += note + "\n";
    }
    return notes;
  };
  Look turned = plainLook(), clipped = plainLook();
  turned.rotate = {30.0, 0.0, 0.0};
  clipped.clip = Box{glm::dvec3(-1.0), {1.0, 0.0, 1.0}};
  const auto has = [](const std::string& notes, const char* words) {
    return notes.find(words) != std::string::npos;
  };
  const std::string tight = noteOf({1, 1e-3}, "tight.cdb", turned);
  EXPECT_TRUE(has(tight, "uses field")) << tight;
  EXPECT_TRUE(has(tight, "field states: values within 0.1 % of the range")) << tight;
  EXPECT_TRUE(has(tight, "sliced states: values within 12.5 % of the range")) << tight;
  const std::string loose = noteOf({1, 0.3}, "loose.cdb", turned);
  EXPECT_TRUE(has(loose, "uses sliced")) << loose;
  EXPECT_TRUE(has(loose, "field states: values within 30 % of the range")) << loose;
  const std::string half = noteOf({2, 1e-3}, "half.cdb", clipped);
  EXPECT_TRUE(has(half, "uses sliced")) << half;
  EXPECT_TRUE(has(half, "field states: nothing bounds what is missing")) << half;
  EXPECT_TRUE(has(noteOf({1, 1e-3}, "plain.cdb", plainLook()), "uses field"));
}

TEST(StackGrid, SeveralStacksAreTruerThanOne) {
  std::vector<StackSamples> samples;
  for (const SlicedStack& stack :
       {stackAlong("a", {0, 1, 0}, {0, 0, 1}), stackAlong("b", {1, 0, 0}, {0, 0, 1}),
        stackAlong("c", {0, 0, -1}, {0, 1, 0})}) {
    samples.push_back(sampledStack(stack.header, runsOfStack(stack)));
  }
  const auto error = [](const StackSamples& grid) {
    double sum = 0.0;
    std::size_t i = 0;
    for (int z = 0; z < grid.size.z; ++z) {
      for (int y = 0; y < grid.size.y; ++y) {
        for (int x = 0; x < grid.size.x; ++x, ++i) {
          const glm::dvec3 at = (glm::dvec3(x, y, z) + 0.5) / glm::dvec3(grid.size);
          const glm::dvec3 world(grid.worldFromGrid * glm::dvec4(at, 1.0));
          sum += std::abs(double(grid.values[i]) * grid.unit + grid.zero - scene().sample(world));
        }
      }
    }
    return sum / double(grid.values.size());
  };
  double one = 0.0;
  for (const StackSamples& grid : samples) one += error(grid) / 3.0;
  EXPECT_LT(one, 0.5 / 8.0 / 2.0) << "far less than an interval";
  EXPECT_LT(error(fusedStacks(samples)), 0.95 * one) << "than one on average";
}

TEST(StackGrid, NoDataStaysNoData) {
  test::Scene holed = scene();
  holed.values[holed.values.size() / 2 + 20] = NAN;
  const test::VoxelView at = test::voxelView(holed, {0, 1, 0}, {0, 0, 1});
  const SlicedStack stack = test::walkedStack(holed, at.camera, at.size, partition(), 8, 32);
  const StackSamples samples = sampledStack(stack.header, runsOfStack(stack));
  std::size_t holes = 0;
  for (const float value : samples.values) holes += !std::isfinite(value);
  EXPECT_GT(holes, 0u);
  EXPECT_LT(holes, 64u);
}

}  // namespace
}  // namespace vestige
