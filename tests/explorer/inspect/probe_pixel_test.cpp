// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/inspect/probe_pixel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "explorer/export/export_arrays.h"
#include "explorer/inspect/field_sampler.h"
#include "proxy/base/error.h"
#include "proxy/format/image/storage_scale.h"
#include "proxy/format/layout/field_layout.h"
#include "proxy/format/layout/proxy_layout.h"
#include "tests/explorer/synthetic.h"
#include "tests/support/walked_stack.h"

namespace vestige {
namespace {

using nlohmann::json;

constexpr ImageSize kSize{48, 32};
/// 1 - |x|, the field of the synthetic proxies, on samples that are unevenly spaced along z.
FieldSamples shells() {
  FieldSamples field;
  field.axes[0] = field.axes[1] = {33, -1.0, 0.0625, {}};
  field.axes[2] = {33, 0.0, 1.0, {}};
  for (int i = 0; i < 33; ++i) {
    const double u = i / 16.0 - 1.0;
    field.axes[2].nodes.push_back(0.5 * (u + u * u * u));
  }
  field.low = -1.0;
  field.high = 1.0;
  for (int z = 0; z < 33; ++z)
    for (int y = 0; y < 33; ++y)
      for (int x = 0; x < 33; ++x) {
        const glm::dvec3 p(field.axes[0].at(x), field.axes[1].at(y), field.axes[2].at(z));
        field.values.push_back(float(0.5 * (1.0 - glm::length(p) + 1.0)));
      }
  return field;
}

class ProbePixel : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new synthetic::TemporaryFolder;
    ArchiveWriter writer(path(), ExistingArchive::Refuse);
    ProxyHeader stored = synthetic::header(kind::kField, kSize);
    stored.view = kFieldView;
    writer.writeStep({encodeProxy(synthetic::lengthProxy(kSize)),
                      encodeProxy(synthetic::depthProxy(kSize, {0.5})),
                      encodeProxy(synthetic::mipProxy(kSize)),
                      encodeProxy(synthetic::referenceProxy(kSize)),
                      encodeProxy(fieldImage(stored, shells(), {1, 1e-5}))});
  }
  static void TearDownTestSuite() { delete folder_; }
  static std::filesystem::path path() { return folder_->path() / "run.cdb"; }

  static json probed(const Look& look, int x, int y, std::optional<double> depth = {}) {
    static const std::shared_ptr<gl::Device> device = gl::Device::create();
    const auto archive = std::make_shared<const Archive>(path());
    const json found =
        probePixel(*archive, look, Renderer(device, archive).render(look), x, y, depth);
    EXPECT_FALSE(probeText(found).empty());
    return found;
  }
  static const json* proxyOf(const json& probed, const char* name) {
    for (const json& proxy : probed["proxies"])
      if (proxy["proxy"] == name) return &proxy;
    return nullptr;
  }
  static double partOf(const json& probed, const char* proxy, const char* channel,
                       const char* part) {
    const json* found = proxyOf(probed, proxy);
    if (!found) return std::numeric_limits<double>::quiet_NaN();
    for (const json& row : (*found)["channels"])
      if (row["name"] == channel) return row["parts"][part].get<double>();
    return std::numeric_limits<double>::quiet_NaN();
  }
  static void expectTrueValues(const json& found) {
    ASSERT_EQ(found["values"].size(), 1u);
    const json& samples = found["values"][0]["samples"];
    ASSERT_GT(samples.size(), 32u);
    for (const json& sample : samples) {
      const json& at = sample["position"];
      const glm::dvec3 p(at[0].get<double>(), at[1].get<double>(), at[2].get<double>());
      EXPECT_NEAR(sample["value"].get<double>(), 1.0 - glm::length(p), 0.05) << sample;
    }
  }

  static synthetic::TemporaryFolder* folder_;
};
synthetic::TemporaryFolder* ProbePixel::folder_ = nullptr;

TEST_F(ProbePixel, AnswersFromEverySourceOfTheView) {
  const json found = probed({}, 24, 16);
  expectTrueValues(found);
  const ProxyHeader header = synthetic::header(kind::kLength, kSize);
  double length = 0.0;
  for (const Segment& segment : synthetic::trueSegments(header, 24, 16))
    if (segment.channel == 4) length += double(segment.amount);
  EXPECT_NEAR(partOf(found, "length", "i04", "length"), length, 1e-3);
  EXPECT_NEAR(partOf(found, "length", "i04", "depth"), -header.camera.position.y, 0.01);
  EXPECT_EQ(partOf(found, "length", "i04", "runs"), 1.0);
  EXPECT_NEAR(partOf(found, "depth", "Z", "layer00"), -header.camera.position.y - 0.5, 0.01);
  EXPECT_NEAR(partOf(found, "mip", "value", "mip"), 0.95, 0.06);
  EXPECT_GT(partOf(found, "reference", "A", "reference"), 0.5);
  EXPECT_EQ((*proxyOf(found, "length"))["pixel"], (json{24, 16}));
  EXPECT_TRUE(found["otherRays"].empty());
  EXPECT_NE(found["color"], "#000000");
  // The run's base has some opacity everywhere: it is seen soon after the ray enters.
  const json& seen = found["values"][0]["firstVisible"];
  EXPECT_LT(seen["depth"].get<double>(), found["ray"]["enters"].get<double>() + 0.3);
  for (const char* word : {"i04", "layer00", "first visible", "\n  first ", "\n  last "})
    EXPECT_NE(probeText(found).find(word), std::string::npos) << probeText(found);
}

TEST_F(ProbePixel, FollowsTheSizeOfThePicture) {
  Look look;
  look.size = ImageSize{96, 96};  // the stored picture in the middle, twice as large
  const json found = probed(look, 2 * 20, 16 + 2 * 11);
  ASSERT_NE(proxyOf(found, "length"), nullptr);
  EXPECT_EQ((*proxyOf(found, "length"))["pixel"], (json{20, 11}));
  expectTrueValues(found);
  const json rim = probed(look, 40, 3);  // above the stored picture
  EXPECT_TRUE(rim["values"][0]["samples"].empty());
  EXPECT_TRUE(rim["proxies"].empty());
  EXPECT_TRUE(rim["ray"]["enters"].is_null());
}

TEST_F(ProbePixel, FollowsATurnedLookThroughTheFieldAndNamesWhatIsStoredAlongOtherRays) {
  Look look;
  look.rotate = {50.0, 20.0, 10.0};
  const json found = probed(look, 24, 16);
  expectTrueValues(found);
  EXPECT_TRUE(found["proxies"].empty());
  EXPECT_EQ(found["otherRays"], (json{"length", "depth", "mip", "reference"}));
}

TEST_F(ProbePixel, FindsWhereOpacityIsFirstSeen) {
  Look look;
  look.opacity = {{0.499, 0.0}, {0.5, 0.9}};
  look.source = Source::Field;
  const json found = probed(look, 24, 16);
  const json& seen = found["values"][0]["firstVisible"];
  EXPECT_NEAR(seen["value"].get<double>(), 0.5, 0.05);
  EXPECT_NEAR(seen["position"][1].get<double>(), -0.5, 0.05);  // the near side
  look.opacity = {{0.0, 0.0}, {1.0, 0.0}};
  EXPECT_FALSE(probed(look, 24, 16)["values"][0].contains("firstVisible"));
}

TEST_F(ProbePixel, GivesTheValueAtADepth) {
  const double middle = -synthetic::header(kind::kLength, kSize).camera.position.y;
  const json found = probed({}, 24, 16, middle);
  ASSERT_EQ(found["values"][0]["samples"].size(), 1u);
  EXPECT_NEAR(found["values"][0]["samples"][0]["value"].get<double>(), 0.95, 0.06);
  EXPECT_THROW(probed({}, 24, 16, 1e6), Error);
  EXPECT_THROW(probed({}, 48, 0), Error);
  EXPECT_THROW(probed({}, -1, 0), Error);
}

TEST_F(ProbePixel, AsksForValuesWhereTheRayPassesTheFieldsOwnSamples) {
  Look look;
  look.rotate = {0.0, 89.0, 0.0};  // almost down the uneven axis
  const json found = probed(look, 24, 16);
  const json& samples = found["values"][0]["samples"];
  const FieldAxis z = shells().axes[2];
  int at = 0;
  for (int i = 1; i + 1 < z.count; ++i)
    for (const json& sample : samples)
      if (std::abs(sample["position"][2].get<double>() - z.at(i)) < 1e-9) {
        ++at;
        break;
      }
  EXPECT_EQ(at, z.count - 2) << "one at each of the samples between the faces";
}

/// The proxies of the suite's archive with values of another magnitude.
TEST(ProbeScales, MipIsInTheFieldsUnitsAndNamesHowTrueItIs) {
  const synthetic::TemporaryFolder folder;
  ProxyHeader header = synthetic::header(kind::kMip, kSize);
  header.partition = IntervalPartition::uniform(101325.0, 101325.01, 10);
  header.statistics.low = 101325.0;
  header.statistics.high = 101325.01;
  const StorageScale scale = mipScale(*header.partition);
  const std::vector<float> held(kSize.pixels(), float((101325.0067 - scale.zero) / scale.unit));
  ArchiveWriter(folder.path() / "m.cdb", ExistingArchive::Refuse)
      .writeStep({encodeProxy(mipImage(header, held))});
  const auto archive = std::make_shared<const Archive>(folder.path() / "m.cdb");
  Renderer renderer(gl::Device::create(), archive);
  Look look;
  look.source = Source::Mip;
  const json found = probePixel(*archive, look, renderer.render(look), 24, 16);
  const json& proxy = found["proxies"][0];
  EXPECT_NEAR(proxy["channels"][0]["parts"]["mip"].get<double>(), 101325.0067, 1e-6);
  EXPECT_LT(proxy["within"]["mip"].get<double>(), 1e-6);
  EXPECT_NE(probeText(found).find("101325.0067"), std::string::npos) << probeText(found);
  const auto exported = exportArrays(archive->open(archive->rows()[0]));
  EXPECT_NEAR(exported[0].values(0)[0], 101325.0067, 1e-6);
  EXPECT_TRUE(exported[0].isDouble);
}

TEST(ProbeStacks, GivesTheirSlabsAndTheValuesOfTheirGrid) {
  const synthetic::TemporaryFolder folder;
  ProxyHeader header = synthetic::header(kind::kSliced, {12, 12});
  header.camera.viewHeight = 2.0;
  header.slabDepths = test::evenSlabs(header.camera, header.domain, 8);
  header.statistics.low = 0.0;
  const double near = header.slabDepths.front();
  const SlicedStack stack =
      test::walkedStack(header, 32, [near](std::size_t, const test::StretchSink& sink) {
        sink({near, near + 2.0, 0.0, 1.0});
      });
  ArchiveWriter(folder.path() / "s.cdb", ExistingArchive::Refuse).writeStep({encodeProxy(stack)});
  const auto archive = std::make_shared<const Archive>(folder.path() / "s.cdb");
  Renderer renderer(gl::Device::create(), archive);
  const json found = probePixel(*archive, {}, renderer.render({}), 5, 5);
  ASSERT_EQ(found["proxies"].size(), 1u);
  EXPECT_EQ(found["proxies"][0]["cells"].size(), 8u);
  ASSERT_EQ(found["values"].size(), 1u);
  for (const json& sample : found["values"][0]["samples"])
    EXPECT_NEAR(sample["value"].get<double>(), 0.5 * (sample["depth"].get<double>() - near), 0.1);
  EXPECT_NE(probeText(found).find("slab"), std::string::npos);
}

TEST(FieldSampler, IsExactAtTheSamplesAndLosesNoneBesideNoData) {
  FieldSamples field = shells();
  const std::size_t hole = (16 * 33 + 16) * 33 + 16;
  field.values[hole] = std::numeric_limits<float>::quiet_NaN();
  const FieldSampler sampler(field);
  const auto at = [&](int x, int y, int z) {
    return sampler.at({field.axes[0].at(x), field.axes[1].at(y), field.axes[2].at(z)});
  };
  EXPECT_TRUE(std::isnan(at(16, 16, 16)));
  EXPECT_NEAR(at(17, 16, 16), 1.0 - 0.0625, 1e-6);
  EXPECT_NEAR(at(3, 30, 7), 2.0 * double(field.values[(7 * 33 + 30) * 33 + 3]) - 1.0, 1e-6);
  EXPECT_NEAR(sampler.at({5.0, 0.0, 0.0}), 0.0, 1e-6) << "goes on beyond the last sample";
  EXPECT_FALSE(std::isnan(sampler.at({0.04, 0.0, 0.0}))) << "its own sample has data";
  EXPECT_TRUE(std::isnan(sampler.at({0.02, 0.0, 0.0})));
  field.low = 0.5;  // of lerp's ends neither is the answer
  EXPECT_TRUE(std::isnan(FieldSampler(field).at({0.02, 0.0, 0.0})));
}

}  // namespace
}  // namespace vestige
