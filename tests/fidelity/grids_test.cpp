// SPDX-License-Identifier: BSD-3-Clause
//
// Grids with gaps and with uneven axes, in situ and afterwards.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "explorer/features/field_bundle.h"
#include "explorer/inspect/probe_pixel.h"
#include "explorer/renderer/renderer.h"
#include "proxy/gl/device.h"
#include "tests/adaptor/api/simulation.h"

namespace vestige::test {
namespace {

constexpr int kPoints = 24;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::shared_ptr<gl::Device> device() {
  static const std::shared_ptr<gl::Device> shared = gl::Device::create();
  return shared;
}

/// A field on points, and how its samples are masked.
struct Volume {
  std::array<std::vector<double>, 3> axes;
  std::vector<double> values;

  Volume(std::array<std::vector<double>, 3> places,
         const std::function<double(const glm::dvec3&)>& value)
      : axes(std::move(places)) {
    each([&](const glm::dvec3& p, std::size_t) { values.push_back(value(p)); });
  }
  template <typename Visit>
  void each(const Visit& visit) const {
    std::size_t i = 0;
    for (const double z : axes[2])
      for (const double y : axes[1])
        for (const double x : axes[0]) visit(glm::dvec3(x, y, z), i++);
  }
};

std::vector<double> evenAxis(int count = kPoints) {
  std::vector<double> axis(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) axis[std::size_t(i)] = i;
  return axis;
}

double waves(const glm::dvec3& p) {
  return 0.5 + 0.5 * std::sin(0.4 * p.x) * std::cos(0.35 * p.y) * std::sin(0.2 + 0.3 * p.z);
}

/// Half of all samples have no data.
Volume halfMasked() {
  std::mt19937 random(7);
  return {{evenAxis(), evenAxis(), evenAxis()},
          [&](const glm::dvec3& p) { return random() & 1 ? waves(p) : kNone; }};
}

/// A sea floor that rises to a coast.
Volume coast() {
  return {{evenAxis(), evenAxis(), evenAxis()}, [&](const glm::dvec3& p) {
            return p.z > 0.9 * p.x + 3.0 * std::sin(0.5 * p.y) - 2.3 ? waves(p) : kNone;
          }};
}

void store(const std::string& path, const Volume& volume, const std::string& config) {
  Simulation run(path, config);
  vestige_grid grid = VESTIGE_GRID_INIT;
  for (std::size_t a = 0; a < 3; ++a) {
    grid.points[a] = int(volume.axes[a].size());
    grid.axes[a] = volume.axes[a].data();
  }
  vestige_block(run.session, 0, &grid);
  vestige_share_field(run.session, 0, "f", VESTIGE_FLOAT64, VESTIGE_POINT, 1, volume.values.data(),
                      nullptr);
  ASSERT_EQ(vestige_execute(run.session, 0, 0.0), VESTIGE_OK) << run.error();
}

/// What is stored of it: the field, or three stacks.
std::string configOf(const std::string& proxy) {
  return "[image]\nwidth = 48\nheight = 48\nproxies = ['" + proxy +
         "']\n[output]\npreviews = false\n" +
         (proxy == "field" ? "[reduced_field]\ntolerance = 1e-3\n" : "[sliced]\nslabs = 24\n");
}

double rootMeanSquare(const Picture& a, const Picture& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    const double difference = double(a.rgba[i]) - double(b.rgba[i]);
    sum += difference * difference;
  }
  return std::sqrt(sum / double(a.rgba.size()));
}

/// How many of the samples with and without data come out so, and how wrong values are.
struct Kept {
  double data = 0.0, gaps = 0.0, error = 0.0;
};

Kept keptBy(const FieldBundle& bundle, const Volume& volume) {
  Kept kept;
  int data = 0, gaps = 0;
  volume.each([&](const glm::dvec3& p, std::size_t i) {
    const double found = bundle.sample(p).values[0], true_ = volume.values[i];
    if (std::isnan(true_)) {
      ++gaps;
      kept.gaps += std::isnan(found);
      return;
    }
    ++data;
    if (std::isnan(found)) return;
    kept.data += 1.0;
    kept.error += (found - true_) * (found - true_);
  });
  kept.error = std::sqrt(kept.error / std::max(kept.data, 1.0));
  kept.data /= data;
  kept.gaps /= std::max(gaps, 1);
  return kept;
}

/// Of an archive's probes through the picture, which share says "no data" where the nearest of the
/// run's samples has none, and a value where it has one. Places halfway between two are passed
/// over.
double rightlyProbed(const std::string& path, const Look& look, const Volume& volume) {
  const auto archive = std::make_shared<const Archive>(path);
  Renderer renderer(device(), archive);
  const Rendered rendered = renderer.render(look);
  int right = 0, all = 0;
  for (int pixel = 9; pixel < look.size->width; pixel += 11) {
    const auto probed = probePixel(*archive, look, rendered, pixel, 60 - pixel / 2);
    for (const auto& sample : probed["values"][0]["samples"]) {
      std::size_t nearest = 0, stride = 1;
      bool halfway = false;
      for (std::size_t a = 0; a < 3; ++a, stride *= kPoints) {
        const double at = sample["position"][a].get<double>();
        halfway = halfway || std::abs(at - std::floor(at) - 0.5) < 0.2;
        nearest += stride * std::size_t(std::lround(at));
      }
      if (halfway) continue;
      ++all;
      right += sample["value"].is_null() == std::isnan(volume.values[nearest]);
    }
  }
  EXPECT_GT(all, 50);
  return double(right) / all;
}

TEST(Gaps, SamplesWithDataStayDataInTheFieldAndInFusedStacks) {
  const Folder folder;
  for (const auto& [name, volume] : {std::pair("half", halfMasked()), {"coast", coast()}}) {
    SCOPED_TRACE(name);
    const std::string field = folder / (std::string(name) + "-field.cdb");
    const std::string stacks = folder / (std::string(name) + "-stacks.cdb");
    store(field, volume, configOf("field"));
    store(stacks, volume, configOf("sliced"));
    const Kept own = keptBy(FieldBundle(Archive(field), 0, {"f"}), volume);
    EXPECT_EQ(own.data, 1.0);
    EXPECT_EQ(own.gaps, 1.0);
    EXPECT_LT(own.error, 2e-3);
    const Kept fused = keptBy(FieldBundle(Archive(stacks), 0, {"f"}), volume);
    EXPECT_GT(fused.data, 0.999);
    EXPECT_GT(fused.gaps, 0.999);
    EXPECT_LT(fused.error, 0.03) << "half an interval of 16";
    Look look;
    look.size = ImageSize{96, 96};
    look.rotate.azimuth = 35.0;
    look.source = Source::Field;
    EXPECT_EQ(rightlyProbed(field, look, volume), 1.0);
    const Picture truth =
        Renderer(device(), std::make_shared<const Archive>(field)).render(look).picture;
    look.source = Source::Sliced;
    EXPECT_GT(rightlyProbed(stacks, look, volume), 0.93) << "their cells are not the run's";
    const Picture made =
        Renderer(device(), std::make_shared<const Archive>(stacks)).render(look).picture;
    EXPECT_LT(rootMeanSquare(truth, made), 0.025);
    EXPECT_GT(rootMeanSquare(truth, Picture::blank(truth.size)), 0.1) << "it is not black";
  }
}

/// A mixed layer under a surface at 0: spacings of 10 beside 500.
Volume ocean() {
  std::vector<double> depths;
  for (double z = 0.0, step = 10.0; z < 4000.0; z += step, step = std::min(500.0, step * 1.25))
    depths.push_back(z);
  std::vector<double> across{0, 400, 800, 1200, 1600, 2000, 2400, 2800, 3200, 3600};
  return {{across, across, depths}, [](const glm::dvec3& p) {
            return 5.0 + 20.0 / (1.0 + std::exp((p.z - 60.0 - 0.01 * p.x) / 12.0)) + 1e-3 * p.y;
          }};
}

TEST(UnevenAxes, ClassifiersAndProbesSeeTheRunsOwnSamples) {
  const Folder folder;
  const std::string path = folder / "o.cdb";
  const Volume volume = ocean();
  store(path, volume, configOf("field"));
  const auto archive = std::make_shared<const Archive>(path);
  const Kept kept = keptBy(FieldBundle(*archive, 0, {"f"}), volume);
  EXPECT_EQ(kept.data, 1.0);
  EXPECT_LT(kept.error, 0.02) << "K; the range is 20";
  // A classifier that asks for gradients, and one of a function: drawn as the field is.
  Renderer renderer(device(), archive);
  Look look;
  look.rotate = {20.0, 10.0, 0.0};
  look.size = ImageSize{48, 48};
  look.draw = Draw::Mip;
  look.source = Source::Field;
  look.colormap = "grey";
  const Picture field = renderer.render(look).picture;
  const Look maximum = lookFromJson(
      {{"rotate", {20.0, 10.0, 0.0}},
       {"size", {48, 48}},
       {"classifier", {{"kind", "maximum"}, {"fields", {"f"}}, {"colormap", "grey"}}}});
  EXPECT_LT(rootMeanSquare(renderer.render(maximum).picture, field), 0.004);
  const nlohmann::json probed = probePixel(*archive, look, renderer.render(look), 24, 24);
  double squares = 0.0;
  int count = 0;
  for (const auto& sample : probed["values"][0]["samples"]) {
    if (sample["value"].is_null()) continue;
    const auto at = [&](int a) { return sample["position"][std::size_t(a)].get<double>(); };
    const double truth =
        5.0 + 20.0 / (1.0 + std::exp((at(2) - 60.0 - 0.01 * at(0)) / 12.0)) + 1e-3 * at(1);
    squares += std::pow(sample["value"].get<double>() - truth, 2.0);
    ++count;
  }
  ASSERT_GT(count, 20);
  EXPECT_LT(std::sqrt(squares / count), 0.1);
}

}  // namespace
}  // namespace vestige::test
