// SPDX-License-Identifier: BSD-3-Clause
//
// Blocks that do not fit in a texture are marched in parts: proxies are those of the whole.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/glm.hpp>

#include "adaptor/ingest/ingest_statistics.h"
#include "adaptor/plan/feature_fit.h"
#include "adaptor/plan/views.h"
#include "adaptor/step/feature_step.h"
#include "adaptor/step/step.h"
#include "simulation.h"

namespace vestige::test {
namespace {

constexpr const char* kEverything = R"(
[image]
width = 30
height = 20
phong = true
proxies = ["attenuation", "length", "depth", "mip", "reference", "layered", "sliced", "features", "sliced-features"]
[layered]
light = [1, 2, -1]
[sliced]
slabs = 3
stacks = "top"
[[view]]
set = "orbit:30,20"
[[view]]
set = "front"
projection = "perspective"
[[field]]
source = "f"
[[classifier]]
kind = "gaussian"
fields = ["f"]
[[classifier.primitives]]
center = [0.5]
width = [0.3]
)";

/// All proxies of a step, marched under these limits.
std::vector<EncodedProxy> proxiesOf(const BlockSet& blocks, const TextureLimits& limits) {
  // One of each, which keeps its programs.
  static const Config config = configFromText(kEverything, "test");
  static const auto device = gl::Device::create("auto", 2);
  static StepMarcher marcher(config, device);
  static FeatureStep featureStep(config, device);
  StepTimes times;
  const auto plans = planFields(config, blocks, {});
  const double referenceLength = blocks.domain().diagonal() / 100.0;
  const auto statistics = measureField(partsOf(plans[0], blocks), 2);
  const StepField field{plans[0], statistics,
                        classify(plans[0].config, statistics, referenceLength)};
  const StepFrame frame{0, 0.0, &blocks, resolveViews(config, blocks.domain()), "", limits};
  auto proxies = marcher.march(frame, field, 2, times);
  const auto classifiers = planClassifiers(config, plans, blocks, {});
  const StepClassifier classifier{
      classifiers[0],
      originOf(classifiers[0], {fieldDomain(field.classification.partition, statistics)},
               referenceLength, blocks)};
  auto features = featureStep.march(frame, classifier, 2, times);
  std::move(features.begin(), features.end(), std::back_inserter(proxies));
  return proxies;
}

void expectAlike(const std::string& a, const std::string& b) {
  const Archive whole(a), split(b);
  ASSERT_GE(whole.rows().size(), 15u);
  ASSERT_EQ(whole.rows().size(), split.rows().size());
  for (const auto& row : whole.rows()) {
    const auto* other = split.find(row.cycle, row.view, row.field, row.proxy);
    ASSERT_NE(other, nullptr);
    if (row.proxy == kind::kSliced) {
      const auto one = readStack(whole.open(row)), two = readStack(split.open(*other));
      EXPECT_EQ(one.faces, two.faces);
      for (std::size_t s = 0; s < one.slabs.size(); ++s) {
        ASSERT_EQ(one.slabs[s].levels.size(), two.slabs[s].levels.size());
        for (std::size_t i = 0; i < one.slabs[s].levels.size(); ++i)
          ASSERT_LE(std::abs(one.slabs[s].levels[i] - two.slabs[s].levels[i]), 1);
      }
      continue;
    }
    if (row.proxy == kind::kSlicedFeatures) {
      const auto one = readFeatureStack(whole.open(row)),
                 two = readFeatureStack(split.open(*other));
      for (std::size_t s = 0; s < one.slabs.size(); ++s)
        for (std::size_t i = 0; i < one.slabs[s].size(); ++i)
          ASSERT_NEAR(one.slabs[s][i], two.slabs[s][i], 2e-4) << "a step of storage";
      continue;
    }
    const auto one = whole.open(row).image(), two = split.open(*other).image();
    for (const auto& part : one.parts) {
      for (const auto& channel : part.channels) {
        const auto& theirs = two.channel(part.name, channel.name).values;
        int far = 0;
        const double step = 2.0 * part.error + 1e-5 * std::max(1.0, one.header.domain.diagonal());
        for (std::size_t i = 0; i < channel.values.size(); ++i) {
          const float x = channel.values[i], y = theirs[i];
          if (!(std::abs(x - y) <= step || x == y || (std::isnan(x) && std::isnan(y)))) ++far;
        }
        // A mean depth is a quotient, of next to nothing at the rims of features; layers begin
        // where shares pass a threshold.
        const bool sharp = row.proxy == kind::kLayered || part.name == "depth";
        EXPECT_LE(far, row.proxy != kind::kDepth && sharp ? 5 : 0)
            << row.view << " " << row.proxy << " " << part.name << " " << channel.name;
      }
    }
  }
}

void expectPartsAreTheWhole(Location location, bool stretched) {
  const Folder folder;
  const Sample sample({33, 14, 10});
  GridDescription grid;
  for (std::size_t a = 0; a < 3; ++a) {
    grid.points[a] = sample.size[a] + (location == Location::Cell ? 1 : 0);
    grid.spacing[a] = 1.0 / 32;
  }
  if (stretched) {
    auto& axis = grid.axes[0].emplace();
    for (int i = 0; i < grid.points[0]; ++i) axis.push_back(std::pow(i / 32.0, 1.5));
  }
  BlockSet blocks;
  blocks.describe(0, grid);
  FieldView view;
  view.name = "f";
  view.location = location;
  view.components = {reinterpret_cast<const std::byte*>(sample.values.data())};
  view.strides = {4, 4 * sample.size[0], 4 * sample.size[0] * sample.size[1]};
  blocks.share(0, view);
  ArchiveWriter(folder / "whole.cdb", ExistingArchive::Refuse).writeStep(proxiesOf(blocks, {}));
  ArchiveWriter(folder / "split.cdb", ExistingArchive::Refuse)
      .writeStep(proxiesOf(blocks, {17, 1700}));
  expectAlike(folder / "whole.cdb", folder / "split.cdb");
}

TEST(StepParts, PartsOfCellsAreTheWhole) { expectPartsAreTheWhole(Location::Cell, false); }
TEST(StepParts, PartsOfStretchedAxesAreTheWhole) { expectPartsAreTheWhole(Location::Point, true); }

TEST(StepParts, AChannelLongerThanATextureJustWorks) {
  const Folder folder;
  Sample sample({3000, 16, 16});
  for (double& spacing : sample.grid.spacing) spacing = 1.0 / 15;
  {
    Simulation run(folder / "a.cdb",
                   "[image]\nwidth = 300\nheight = 20\nproxies = ['attenuation', 'length', "
                   "'depth', 'mip', 'reference', 'layered', 'sliced', 'field']\n[sliced]\nslabs = "
                   "2\nstacks = 'front'\n[[field]]\nsource = 'f'\n");
    ASSERT_EQ(run.step(sample, 0), VESTIGE_OK) << run.error();
  }
  EXPECT_EQ(damageOf(folder / "a.cdb"), "");
  // Rays through the channel meet values along their whole way, from its one end to the other.
  const Archive archive(folder / "a.cdb");
  const auto* row = archive.find(0, "front", "f", kind::kLength);
  ASSERT_NE(row, nullptr);
  const ProxyImage image = archive.open(*row).image();
  std::vector<double> total(image.header.size.pixels(), 0.0);
  for (const auto& channel : image.part("length").channels)
    for (std::size_t i = 0; i < total.size(); ++i) total[i] += double(channel.values[i]);
  int columns = 0;
  for (std::size_t x = 0; x < 300; ++x) {
    bool whole = false;
    for (std::size_t y = 0; y < 20; ++y) whole = whole || std::abs(total[300 * y + x] - 1.0) < 0.05;
    columns += whole ? 1 : 0;
  }
  EXPECT_GT(columns, 285);
}

}  // namespace
}  // namespace vestige::test
