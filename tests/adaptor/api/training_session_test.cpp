// SPDX-License-Identifier: BSD-3-Clause
//
// Training pictures through a session.
#include <gtest/gtest.h>

#include "proxy/archive/archive.h"
#include "simulation.h"

namespace vestige::test {
namespace {

ProxyImage imageOf(const Archive& archive, std::string_view kind) {
  return archive.open(*archive.find(1, "front", "f", kind)).image();
}

double sumOf(const ProxyImage& image, const std::string& part, const char* channel) {
  double sum = 0.0;
  for (const float v : image.channel(part, channel).values) sum += v;
  return sum;
}

TEST(TrainingSession, StoresEachPictureWithTheLookItWasMadeWith) {
  const Folder folder;
  const std::string path = folder / "a.cdb";
  {
    Simulation run(path, std::string(kSmallImage) +
                             "proxies = ['attenuation', 'reference', 'training']\n"
                             "[training]\npictures = 3\nscale = 0.2\n");
    ASSERT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
  }
  EXPECT_EQ(damageOf(path), "");
  const Archive archive(path);
  const ProxyImage training = imageOf(archive, kind::kTraining);
  const ProxyImage reference = imageOf(archive, kind::kReference);
  ASSERT_EQ(training.header.looks.size(), 3u);
  ASSERT_EQ(training.parts.size(), 3u);
  EXPECT_EQ(training.header.shading, "unlit");
  EXPECT_EQ(training.header.looks[0].opacityPoints(), training.header.base->opacityPoints());
  for (const char* channel : {"R", "G", "B", "A"}) {
    EXPECT_EQ(training.channel("picture00", channel).values,
              reference.channel("reference", channel).values);
  }
  // Less of any value is less of the whole; the changes differ.
  const double whole = sumOf(training, "picture00", "A"), low = sumOf(training, "picture01", "A"),
               high = sumOf(training, "picture02", "A");
  EXPECT_LT(low, 0.98 * whole);
  EXPECT_LT(high, whole);
  EXPECT_NE(low, high);
  EXPECT_GT(low, 0.0);
}

TEST(TrainingSession, LightIsItsOwnChoiceAndIsNamed) {
  const Folder folder;
  const std::string path = folder / "a.cdb";
  {
    Simulation run(path, std::string(kSmallImage) +
                             "proxies = ['reference', 'training']\n[training]\npictures = 1\n"
                             "light = true\n");
    ASSERT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
  }
  const Archive archive(path);
  const ProxyImage training = imageOf(archive, kind::kTraining);
  const ProxyImage reference = imageOf(archive, kind::kReference);
  EXPECT_EQ(training.header.shading, "headlight");
  EXPECT_EQ(reference.header.shading, "");
  EXPECT_EQ(training.channel("picture00", "A").values, reference.channel("reference", "A").values);
  EXPECT_NE(training.channel("picture00", "G").values, reference.channel("reference", "G").values);
}

TEST(TrainingSession, ARunMayStoreNothingElse) {
  const Folder folder;
  const std::string path = folder / "a.cdb";
  {
    Simulation run(path, std::string(kSmallImage) + "phong = true\nproxies = ['training']\n");
    ASSERT_EQ(run.step(Sample(), 1), VESTIGE_OK) << run.error();
  }
  EXPECT_EQ(damageOf(path), "");
  const ProxyImage training = imageOf(Archive(path), kind::kTraining);
  EXPECT_EQ(training.header.looks.size(), 3u) << "the default";
  EXPECT_EQ(training.header.shading, "headlight") << "as [image] phong";
}

}  // namespace
}  // namespace vestige::test
