// SPDX-License-Identifier: BSD-3-Clause
//
// [customization] through a session.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "proxy/archive/archive.h"
#include "simulation.h"

namespace vestige::test {
namespace {

/// Transparent at low x, and other values and colours there; as without it at high x.
constexpr const char* kSeeds = R"(
[customization]
resolution = 32
[[customization.seeds]]
name = "left"
position = [0.1, 0.5, 0.5]
extent = [0, 0.8, 0.8]
opacity = 0.02
gamma = 2
shift = [0.2, 0, -0.1]
[[customization.seeds]]
name = "right"
position = [0.75, 0.5, 0.5]
extent = [0.4, 0.6, 0.6]
)";

constexpr const char* kEveryKind =
    "proxies = ['attenuation', 'length', 'depth', 'mip', 'reference', 'layered', 'training']\n";

std::string config(const std::string& image, const std::string& rest) {
  return kSmallImage + image + rest;
}

/// Runs one step, in two halves along z if asked; the archive's path.
std::string archiveOf(const std::string& path, const std::string& text, bool halves = false) {
  Simulation run(path, text);
  EXPECT_EQ(run.opened, VESTIGE_OK) << run.error();
  const Sample sample;
  for (int b = 0; b < (halves ? 2 : 1); ++b) {
    vestige_grid grid = sample.grid;
    int first = 0;
    if (halves) {
      // 16 layers: 0..8 and 8..15, with a ghost layer each.
      first = b == 0 ? 0 : 7;
      grid.points[2] = b == 0 ? 10 : 9;
      grid.ghosts[b == 0 ? 5 : 4] = 1;
      grid.first[2] = first;
    }
    vestige_block(run.session, b, &grid);
    vestige_share_field(run.session, b, "f", VESTIGE_FLOAT32, VESTIGE_POINT, 1,
                        sample.values.data() + std::size_t(first) * 24 * 20, nullptr);
  }
  EXPECT_EQ(vestige_execute(run.session, 1, 0.1), VESTIGE_OK) << run.error();
  EXPECT_EQ(damageOf(path), "");
  return path;
}

ProxyImage imageOf(const std::string& path, std::string_view kind) {
  const Archive archive(path);
  const ArchiveRow* row = archive.find(1, "front", "f", kind);
  if (!row) throw std::runtime_error("no " + std::string(kind));
  return archive.open(*row).image();
}

/// The mean difference of the lower and the upper half of x, which the front view has left and
/// right.
std::array<double, 2> halfDifferences(const ProxyImage& a, const ProxyImage& b) {
  std::array<double, 2> sums{};
  std::array<double, 2> counts{};
  const ImageSize size = a.header.size;
  for (std::size_t p = 0; p < a.parts.size(); ++p)
    for (std::size_t c = 0; c < a.parts[p].channels.size(); ++c)
      for (std::size_t i = 0; i < size.pixels(); ++i) {
        const double x = a.parts[p].channels[c].values[i], y = b.parts[p].channels[c].values[i];
        if (!std::isfinite(x) || !std::isfinite(y)) continue;
        const std::size_t pixel = i % std::size_t(size.width);
        const auto half = std::size_t(pixel >= std::size_t(size.width) / 2);
        sums[half] += std::abs(x - y);
        counts[half] += 1.0;
      }
  return {sums[0] / counts[0], sums[1] / counts[1]};
}

TEST(CustomSession, PicturesDifferWhereTheSeedsAreAndSayWhy) {
  const Folder folder;
  const std::string plain = archiveOf(folder / "plain.cdb", config(kEveryKind, ""));
  const std::string made = archiveOf(folder / "made.cdb", config(kEveryKind, kSeeds));
  for (const std::string_view kind :
       {kind::kAttenuation, kind::kReference, kind::kLayered, kind::kMip}) {
    const ProxyImage a = imageOf(plain, kind), b = imageOf(made, kind);
    EXPECT_FALSE(a.header.customization) << kind;
    ASSERT_TRUE(b.header.customization) << kind;
    EXPECT_EQ(b.header.customization->resolution, 32);
    ASSERT_EQ(b.header.customization->seeds.size(), 2u);
    EXPECT_EQ(b.header.customization->seeds[0].name, "left");
    EXPECT_EQ(b.header.customization->seeds[0].parameters.gamma, 2.0);
    if (kind == kind::kLayered) continue;  // of which the boundaries move
    const auto [left, right] = halfDifferences(a, b);
    EXPECT_GT(left, 1e-3) << kind;
    EXPECT_GT(left, 2.0 * right) << kind;
  }
}

TEST(CustomSession, LengthsDepthsAndTrainingPicturesStayFreeOfIt) {
  const Folder folder;
  const std::string plain = archiveOf(folder / "plain.cdb", config(kEveryKind, ""));
  const std::string made = archiveOf(folder / "made.cdb", config(kEveryKind, kSeeds));
  for (const std::string_view kind : {kind::kLength, kind::kDepth, kind::kTraining}) {
    const ProxyImage a = imageOf(plain, kind), b = imageOf(made, kind);
    EXPECT_FALSE(b.header.customization) << kind;
    const auto [left, right] = halfDifferences(a, b);
    EXPECT_EQ(left, 0.0) << kind;
    EXPECT_EQ(right, 0.0) << kind;
  }
}

TEST(CustomSession, WithoutGammaTheMaximumIsThatOfThePlainRun) {
  const Folder folder;
  const std::string image = "proxies = ['attenuation', 'mip']\n";
  const std::string plain = archiveOf(folder / "plain.cdb", config(image, ""));
  const std::string made =
      archiveOf(folder / "made.cdb", config(image, "[customization.corners]\nopacity = 3\n"));
  const auto a = filesOf(plain), b = filesOf(made);
  ASSERT_EQ(a.size(), b.size());
  int same = 0;
  for (const auto& [name, bytes] : a)
    if (name.find("mip") != std::string::npos) same += bytes == b.at(name);
  EXPECT_EQ(same, 2) << "picture and preview";
  EXPECT_TRUE(imageOf(made, kind::kAttenuation).header.customization);
}

TEST(CustomSession, BlocksGiveThePicturesOfTheWhole) {
  const Folder folder;
  const std::string text = config(kEveryKind, kSeeds);
  const std::string whole = archiveOf(folder / "whole.cdb", text);
  const std::string halves = archiveOf(folder / "halves.cdb", text, true);
  for (const std::string_view kind : {kind::kAttenuation, kind::kReference, kind::kMip}) {
    const ProxyImage a = imageOf(whole, kind), b = imageOf(halves, kind);
    EXPECT_EQ(a.header.customization, b.header.customization);
    double worst = 0.0;
    for (std::size_t c = 0; c < a.parts[0].channels.size(); ++c)
      for (std::size_t i = 0; i < a.header.size.pixels(); ++i) {
        const float x = a.parts[0].channels[c].values[i], y = b.parts[0].channels[c].values[i];
        ASSERT_EQ(std::isnan(x), std::isnan(y));
        if (!std::isnan(x)) worst = std::max(worst, std::abs(double(x) - double(y)));
      }
    EXPECT_LT(worst, 2e-3) << kind;
  }
}

TEST(CustomSession, ANeutralOneIsNone) {
  const Folder folder;
  const std::string plain = archiveOf(folder / "plain.cdb", config("", ""));
  const std::string neutral = archiveOf(folder / "neutral.cdb", config("", R"(
[customization]
seeds = [{ position = [0.5, 0.5, 0.5] }, { position = [9, 9, 9], opacity = 0, enabled = false }]
)"));
  EXPECT_EQ(filesOf(plain), filesOf(neutral));
}

TEST(CustomSession, StacksStayFreeOfItButNotTheirPictures) {
  const Folder folder;
  const std::string image = "proxies = ['sliced', 'reference']\n[sliced]\nslabs = 3\n";
  const std::string plain = archiveOf(folder / "plain.cdb", config(image, ""));
  const std::string made = archiveOf(folder / "made.cdb", config(image, kSeeds));
  const Archive archive(made), other(plain);
  const auto stack = [](const Archive& of) {
    return readStack(of.open(*of.find(1, "stack-top", "f", kind::kSliced)));
  };
  EXPECT_FALSE(stack(archive).header.customization);
  EXPECT_EQ(stack(archive).faces, stack(other).faces);
  const ProxyHeader reference =
      archive.open(*archive.find(1, "stack-top", "f", kind::kReference)).header();
  EXPECT_TRUE(reference.customization);
}

TEST(CustomSession, SeedsOutsideTheDomainFailTheStepBySaying) {
  const Folder folder;
  Simulation run(folder / "a.cdb", config("", kSeeds));
  ASSERT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
  // The domain moves away from the seed.
  Sample moved;
  moved.grid.origin[0] = 5.0;
  EXPECT_EQ(run.step(moved, 2), VESTIGE_ERROR_CONFIG);
  EXPECT_NE(run.error().find("[customization]: seed 0 'left' stands at 0.1, 0.5, 0.5, outside"),
            std::string::npos)
      << run.error();
}

TEST(CustomSession, TheVolumeFollowsADomainThatGrows) {
  const Folder folder;
  Simulation run(folder / "a.cdb", config("", kSeeds));
  ASSERT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
  Sample grown;
  grown.grid.spacing[0] *= 3.0;
  ASSERT_EQ(run.step(grown, 2), VESTIGE_OK) << run.error();
  const std::string alone = folder / "alone.cdb";
  {
    // The same intervals as if it had come second.
    Simulation second(alone, config("", kSeeds));
    ASSERT_EQ(second.step(grown, 2), VESTIGE_OK) << second.error();
  }
  const Archive both(folder / "a.cdb"), one(alone);
  const auto read = [](const Archive& archive) {
    return archive.open(*archive.find(2, "front", "f", kind::kReference)).image();
  };
  const auto [left, right] = halfDifferences(read(both), read(one));
  EXPECT_EQ(left, 0.0);
  EXPECT_EQ(right, 0.0);
}

TEST(CustomSession, DryRunsAndBudgetsCarryIt) {
  const Folder folder;
  {
    Simulation dry(folder / "dry.cdb", "dry_run = true\n" + config("", kSeeds));
    ASSERT_EQ(dry.step(Sample(), 1), VESTIGE_OK) << dry.error();
    EXPECT_TRUE(dry.logged("dry run"));
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "dry.cdb"));
  const std::string made = archiveOf(
      folder / "made.cdb", config("", std::string(kSeeds) + "[budget]\nbytes_per_step = '2 MB'\n"));
  EXPECT_TRUE(imageOf(made, kind::kReference).header.customization);
}

}  // namespace
}  // namespace vestige::test
