// SPDX-License-Identifier: BSD-3-Clause
// Archives of more views and steps than the renderer keeps, written by the adaptor. Also run under
// AddressSanitizer: whoever holds a decoded view must keep it.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "explorer/export/movie.h"
#include "explorer/inspect/info.h"
#include "explorer/renderer/renderer.h"
#include "explorer/renderer/view_data.h"
#include "explorer/renderer/view_effects.h"
#include "proxy/gl/device.h"
#include "tests/adaptor/api/simulation.h"
#include "tests/explorer/synthetic.h"

namespace vestige {
namespace {

std::shared_ptr<gl::Device> device() {
  static const std::shared_ptr<gl::Device> shared = gl::Device::create();
  return shared;
}

const std::string kTiny = "[image]\nwidth = 20\nheight = 16\n";

std::string ofSets(std::initializer_list<const char*> sets, const std::string& more = {}) {
  std::string text;
  for (const char* set : sets) text += std::string("[[view]]\nset = \"") + set + "\"\n" + more;
  return text;
}

class ManyViews : public testing::Test {
 protected:
  std::shared_ptr<const Archive> archive(const std::string& config, int steps = 1) {
    const std::string path = folder_ / ("run" + std::to_string(runs_++) + ".cdb");
    const test::Sample sample({12, 10, 8});
    test::Simulation run(path, config);
    for (int step = 0; step < steps; ++step)
      EXPECT_EQ(run.step(sample, step), VESTIGE_OK) << run.error();
    return std::make_shared<const Archive>(path);
  }
  static std::string notesOf(const Rendered& rendered) {
    std::string text;
    for (const std::string& note : rendered.notes) text += note + "\n";
    return text;
  }
  static double lightOf(const Picture& picture) {
    double sum = 0.0;
    for (std::size_t i = 0; i < picture.rgba.size(); ++i) {
      EXPECT_TRUE(std::isfinite(picture.rgba[i]));
      if (i % 4 != 3) sum += double(picture.rgba[i]);
    }
    return sum;
  }

  test::Folder folder_;
  int runs_ = 0;
};

/// The views whose direction is nearest to a camera's.
std::vector<std::string> nearestViews(const Archive& archive, glm::dvec3 forward) {
  std::map<std::string, double> dots;
  double most = -2.0;
  for (const ArchiveRow& row : archive.rows()) {
    if (row.proxy != kind::kDepth && row.proxy != kind::kLength && row.proxy != kind::kLayered)
      continue;
    const double dot = glm::dot(archive.open(row).header().camera.forward, forward);
    dots[row.view] = dot;
    most = std::max(most, dot);
  }
  std::vector<std::string> nearest;
  for (const auto& [name, dot] : dots)
    if (dot > most - 1e-6) nearest.push_back(name);
  return nearest;
}

TEST_F(ManyViews, TheNearestViewAnswersHoweverManyThereAre) {
  for (const auto& sets : {ofSets({"front"}), ofSets({"front", "left", "back", "right", "bottom"}),
                           ofSets({"axes"}), ofSets({"sphere:14"}), ofSets({"sphere:40"})}) {
    const auto run = archive(kTiny + "proxies = [\"length\", \"depth\"]\n" + sets);
    Renderer renderer(device(), run);
    for (const auto& [azimuth, elevation] :
         {std::pair{10.0, 0.0}, {180.0, 0.0}, {-80.0, 5.0}, {130.0, -60.0}, {45.0, 70.0}}) {
      Look look;
      look.rotate = {azimuth, elevation, 0.0};
      const Rendered rendered = renderer.render(look);
      EXPECT_GT(lightOf(rendered.picture), 0.0);
      const std::string notes = notesOf(rendered);
      const auto nearest = nearestViews(*run, rendered.camera.forward);
      const bool named = std::any_of(nearest.begin(), nearest.end(), [&](const auto& name) {
        return notes.find("uses view '" + name + "'") != std::string::npos;
      });
      EXPECT_TRUE(named) << azimuth << ", " << elevation << ": " << notes;
      const double dot = glm::dot(
          run->open(*run->find(0, nearest.front(), "f", kind::kLength)).header().camera.forward,
          rendered.camera.forward);
      const double degrees = std::acos(std::min(dot, 1.0)) * 180.0 / std::numbers::pi;
      const auto said = notes.find("within ");
      ASSERT_NE(said, std::string::npos);
      EXPECT_NEAR(std::stod(notes.substr(said + 7)), degrees, 0.1);
    }
  }
}

TEST_F(ManyViews, TenDegreesFromTheFrontTheFrontAnswers) {
  Renderer renderer(device(), archive(kTiny + ofSets({"axes"})));
  Look look;
  look.rotate.azimuth = 10.0;
  EXPECT_NE(notesOf(renderer.render(look)).find("uses view 'front': it looks within 10 degrees"),
            std::string::npos);
}

double worstDifference(const Picture& a, const Picture& b) {
  EXPECT_EQ(a.size, b.size);
  double most = 0.0;
  for (std::size_t i = 0; i < a.rgba.size() && i < b.rgba.size(); ++i)
    most = std::max(most, std::abs(double(a.rgba[i]) - double(b.rgba[i])));
  return most;
}

TEST_F(ManyViews, ATurnThatMovesNothingByHalfAPixelIsAnsweredAsTheStoredViewItself) {
  for (const char* proxies : {"proxies = [\"length\", \"depth\"]\n",
                              "proxies = [\"length\", \"depth\", \"reference\"]\n"}) {
    Renderer renderer(device(), archive(kTiny + proxies + ofSets({"axes"})));
    Look look;
    const Rendered front = renderer.render(look);
    look.rotate.azimuth = 0.001;
    const Rendered nearly = renderer.render(look);
    EXPECT_EQ(nearly.answer, front.answer) << notesOf(nearly);
    EXPECT_LT(worstDifference(nearly.picture, front.picture), 1e-6) << proxies;
    look.rotate.azimuth = 6.0;  // more than half a pixel
    EXPECT_NE(renderer.render(look).answer, front.answer) << proxies;
  }
}

TEST_F(ManyViews, HalfATurnIsTheOppositeViewsOwnPicture) {
  Renderer renderer(device(),
                    archive(kTiny + "proxies = [\"length\", \"depth\"]\n" + ofSets({"axes"})));
  for (const auto& [from, to, azimuth] :
       {std::tuple{"front", "back", 180.0}, {"right", "left", -180.0}, {"front", "front", 360.0}}) {
    Look look;
    look.view = to;
    const Rendered own = renderer.render(look);
    look.view = from;
    look.rotate.azimuth = azimuth;
    const Rendered turned = renderer.render(look);
    EXPECT_EQ(turned.answer, own.answer) << from << notesOf(turned);
    EXPECT_LT(worstDifference(turned.picture, own.picture), 1e-6) << from;
  }
}

TEST_F(ManyViews, FramesOfATurnAreAllDrawnByTheSameProxiesAlsoWhereTheyPassAView) {
  Renderer renderer(device(),
                    archive(kTiny + "proxies = [\"length\", \"depth\"]\n" + ofSets({"axes"})));
  for (const Look& look : looksOfTurn({}, 360.0, 8))  // 0, 45, 90, ... degrees
    EXPECT_EQ(renderer.render(look).answer, Answer::Layers) << look.rotate.azimuth;
}

TEST_F(ManyViews, AMovieHasOneLookWhereStepsHaveTheirOwnDefaults) {
  const std::string path = folder_ / "growing.cdb";
  test::Simulation run(path, kTiny + "[[field]]\nsource = \"f\"\nrange = \"each-step\"\n");
  for (int step = 0; step < 3; ++step) {
    test::Sample sample({12, 10, 8});
    for (float& value : sample.values) value *= float(1 + step);
    ASSERT_EQ(run.step(sample, step), VESTIGE_OK) << run.error();
  }
  const auto stored = std::make_shared<const Archive>(path);
  Renderer renderer(device(), stored);
  const auto ends = [&](const Look& look, long cycle) {
    Look at = look;
    at.cycle = cycle;
    return *renderer.resolved(at).colorRange;
  };
  ASSERT_NE(ends({}, 0), ends({}, 2));
  const Look one = lookForAllSteps(renderer, {}, *stored);
  EXPECT_EQ(ends(one, 0), ends(one, 2));
  for (long cycle = 0; cycle < 3; ++cycle) {
    EXPECT_LE(ends(one, 0).first, ends({}, cycle).first);
    EXPECT_GE(ends(one, 0).second, ends({}, cycle).second);
  }
  // What the look says stays.
  Look given;
  given.colorRange = {0.1, 0.2};
  EXPECT_EQ(lookForAllSteps(renderer, given, *stored).colorRange, given.colorRange);
}

TEST_F(ManyViews, EveryKindOfProxyIsDrawnFromAllSides) {
  const std::string proxies[] = {
      "proxies = [\"length\", \"attenuation\", \"mip\", \"reference\"]\n",
      "proxies = [\"depth\", \"attenuation\"]\n",
      "proxies = [\"layered\", \"reference\"]\n",
      "proxies = [\"sliced\", \"reference\"]\n[sliced]\nstacks = \"views\"\nslabs = 4\n",
      "proxies = [\"field\", \"length\"]\n",
      "proxies = [\"attenuation\", \"length\", \"depth\", \"mip\", \"reference\", \"layered\", "
      "\"sliced\", \"field\"]\n[sliced]\nslabs = 4\n"};
  for (const std::string& kinds : proxies) {
    const auto run = archive(kTiny + kinds + ofSets({"axes"}));
    Renderer renderer(device(), run);
    for (const std::string& view : run->views()) {
      Look look;
      look.view = view;
      for (const double azimuth : {0.0, 100.0}) {
        look.rotate.azimuth = azimuth;
        EXPECT_GT(lightOf(renderer.render(look).picture), 0.0) << kinds << view << azimuth;
      }
    }
  }
}

TEST_F(ManyViews, AViewThatCannotBeTurnedLeavesItToOneThatCan) {
  ProxyImage layers = synthetic::depthProxy({24, 20}, {0.3, 0.7});
  layers.header.view = "layers";
  layers.header.camera = layers.header.camera.orbited(glm::dvec3(0.0), 0.5, 0.0, 0.0);
  ArchiveWriter(folder_ / "two.cdb", ExistingArchive::Refuse)
      .writeStep({encodeProxy(synthetic::referenceProxy({24, 20})), encodeProxy(layers)});
  Renderer renderer(device(), std::make_shared<const Archive>(folder_ / "two.cdb"));
  Look look;
  look.view = "front";
  look.rotate.azimuth = 5.0;
  EXPECT_NE(notesOf(renderer.render(look)).find("uses view 'layers'"), std::string::npos);
}

TEST_F(ManyViews, MultiPerspectiveViewsAreTurnedAmongMany) {
  const auto run = archive(kTiny + ofSets({"axes"}, "projection = \"multi-perspective\"\n"));
  Renderer renderer(device(), run);
  for (const Source source : {Source::Auto, Source::Virtual, Source::Layers}) {
    Look look;
    look.source = source;
    for (const double azimuth : {0.0, 20.0, 95.0, 185.0}) {
      look.rotate.azimuth = azimuth;
      EXPECT_GT(lightOf(renderer.render(look).picture), 0.0) << azimuth;
    }
  }
}

TEST_F(ManyViews, ATurnGoesRoundAndAMovieOverAllSteps) {
  const auto run = archive(kTiny + ofSets({"axes"}), 6);
  Renderer renderer(device(), run);
  Look look;
  look.lights = {{30.0, 30.0, 1.0}};
  look.shading = Shading::Phong;
  std::vector<Look> looks = looksOfTurn(look, 360.0, 12);
  for (const Look& each : looksOverTime(look, *run)) looks.push_back(each);
  writeMovie(folder_ / "all.mp4", renderer, looks, 10.0, {});
  EXPECT_GT(std::filesystem::file_size(folder_ / "all.mp4"), 200u);
}

TEST_F(ManyViews, ALensSpansViewsOnBothSides) {
  Renderer renderer(device(), archive(kTiny + ofSets({"axes"})));
  Look look;
  look.rotate.azimuth = 45.0;
  ViewEffects effects;
  effects.aperture = 60.0;
  effects.samples = 12;
  EXPECT_GT(lightOf(renderWithEffects(renderer, look, effects).picture), 0.0);
}

TEST_F(ManyViews, FeaturesAreDrawnInEveryView) {
  const auto run = archive(
      kTiny + "proxies = [\"features\", \"sliced-features\"]\n[sliced]\nslabs = 4\n" +
      ofSets({"axes"}) +
      "[[classifier]]\nname = \"parts\"\nkind = \"gaussian\"\nfields = [\"f\"]\n"
      "primitives = [{ name = \"a\", center = [0.3], width = [0.2], opacity = 0.5, color = "
      "\"#ff8000\" }, { name = \"b\", center = [0.8], width = [0.2], opacity = 0.5, color = "
      "\"#0080ff\" }]\n");
  Renderer renderer(device(), run);
  for (const std::string& view : run->views()) {
    Look look;
    look.field = "parts";
    look.view = view;
    for (const double azimuth : {0.0, 70.0}) {
      look.rotate.azimuth = azimuth;
      EXPECT_GT(lightOf(renderer.render(look).picture), 0.0) << view;
    }
  }
}

TEST_F(ManyViews, WhoHoldsAViewKeepsItWhateverIsAskedForMeanwhile) {
  const auto run = archive(kTiny + ofSets({"sphere:14"}));
  device()->run([&] {
    ViewCache cache(*run);
    const std::shared_ptr<ViewData> first = cache.get(0, "sphere000", "f");
    const SegmentTextures& segments = first->segments(Via::Length, Order::Auto);
    std::vector<std::weak_ptr<ViewData>> others;
    for (const std::string& view : run->views()) others.push_back(cache.get(0, view, "f"));
    EXPECT_EQ(first->header().view, "sphere000");
    EXPECT_EQ(segments.size, (ImageSize{20, 16}));
    // The cache itself keeps a few.
    EXPECT_LE(std::size_t(std::count_if(others.begin(), others.end(),
                                        [](const auto& each) { return !each.expired(); })),
              ViewCache::kKept + 1);
  });
}

}  // namespace
}  // namespace vestige
