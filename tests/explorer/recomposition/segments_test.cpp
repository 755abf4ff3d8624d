// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/recomposition/segments.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>

#include "explorer/renderer/view_data.h"
#include "proxy/archive/archive.h"
#include "proxy/base/durable_file.h"
#include "proxy/base/error.h"
#include "tests/explorer/synthetic.h"

namespace vestige {
namespace {

constexpr ImageSize kSize{33, 29};

double lengthOf(const std::vector<Segment>& segments, int channel) {
  double sum = 0.0;
  for (const Segment& segment : segments)
    sum += segment.channel == channel ? double(segment.amount) : 0.0;
  return sum;
}

TEST(PackedAmounts, AreTheNearestToEveryValue) {
  for (float value = 1e-7f; value < 127.0f; value *= 1.0037f) {
    const float back = amountValue(amountBits(value));
    EXPECT_LE(std::abs(back - value), value * 0x1p-12f) << value;
  }
  for (unsigned bits = 0; bits < 0x10000u; ++bits) ASSERT_EQ(amountBits(amountValue(bits)), bits);
}

TEST(PackedAmounts, KeepNothingNegativeAndNothingInfinite) {
  EXPECT_EQ(amountBits(-1.0f), 0u);
  EXPECT_EQ(amountBits(std::nanf("")), 0u);
  EXPECT_EQ(amountBits(1e30f), 0xffffu);
}

TEST(SegmentsFromLength, KeepTheLengthOfEveryChannelInEveryOrder) {
  const ProxyImage proxy = synthetic::lengthProxy(kSize);
  for (Order order : {Order::Mean, Order::Runs}) {
    const SegmentLists lists = segmentsFromLength(lengthPlanes(proxy), order);
    for (std::size_t i = 0; i < kSize.pixels(); ++i) {
      const std::vector<Segment> segments = lists.at(i);
      for (int k = 0; k < proxy.header.partition->noData(); ++k) {
        const float stored = proxy.part("length").channels[std::size_t(k)].values[i];
        ASSERT_NEAR(lengthOf(segments, k), stored, 2e-3 * stored + 1e-6) << "pixel " << i;
      }
    }
  }
}

TEST(SegmentsFromLength, FollowTheRunsOfNestedShells) {
  const ProxyImage proxy = synthetic::lengthProxy(kSize);
  const SegmentLists lists = segmentsFromLength(lengthPlanes(proxy), Order::Runs);
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      const auto truth = synthetic::trueSegments(proxy.header, x, y);
      const auto segments = lists.at(std::size_t(y * kSize.width + x));
      ASSERT_EQ(segments.size(), truth.size()) << x << ", " << y;
      for (std::size_t i = 0; i < truth.size(); ++i) {
        EXPECT_EQ(segments[i].channel, truth[i].channel);
        EXPECT_NEAR(segments[i].amount, truth[i].amount, 5e-3);
      }
    }
  }
}

TEST(SegmentsFromLength, SortByMeanDepthWhereEveryChannelHasOneRun) {
  ProxyImage proxy = synthetic::lengthProxy({2, 1});
  for (ProxyPart& part : proxy.parts) {
    for (Channel& channel : part.channels) channel.values = {0.0f, 0.0f};
  }
  const std::array<double, 4> depth{3.0, 1.0, 4.0, 2.0};
  for (std::size_t k = 0; k < 4; ++k) {
    proxy.parts[0].channels[k].values[1] = 0.25f;
    proxy.parts[1].channels[k].values[1] = float(depth[k]);
    proxy.parts[2].channels[k].values[1] = 1.0f;
  }
  const SegmentLists lists = segmentsFromLength(lengthPlanes(proxy), Order::Mean);
  EXPECT_TRUE(lists.at(0).empty());
  const std::vector<Segment> segments = lists.at(1);
  ASSERT_EQ(segments.size(), 4u);
  EXPECT_EQ(segments[0].channel, 1);
  EXPECT_EQ(segments[1].channel, 3);
  EXPECT_EQ(segments[2].channel, 0);
  EXPECT_EQ(segments[3].channel, 2);
  for (const Segment& segment : segments) EXPECT_FALSE(segment.ambiguous);
}

TEST(SegmentsFromAttenuation, RecoverOpacitiesInTheGlobalOrder) {
  // Three nested channels with known opacities, in the order in which they are met.
  ProxyImage proxy = synthetic::attenuationProxy({1, 1});
  for (Channel& channel : proxy.parts[0].channels) channel.values = {0.0f};
  const std::array<double, 3> opacity{0.3, 0.5, 0.25};
  double left = 1.0;
  for (std::size_t k = 0; k < 3; ++k) {
    proxy.parts[0].channels[k].values[0] = float(left * opacity[k]);
    left *= 1.0 - opacity[k];
  }
  const auto planes = attenuationPlanes(proxy);
  const std::vector<Segment> segments =
      segmentsFromAttenuation(planes, nestedOrder(planes.partition())).at(0);
  ASSERT_EQ(segments.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(segments[k].channel, int(k));
    EXPECT_NEAR(segments[k].amount, -std::log(1.0 - opacity[k]), 1e-3);
  }
}

TEST(SegmentsFromAttenuation, GiveNothingToWhatLiesBehindAnOpaqueChannel) {
  ProxyImage proxy = synthetic::attenuationProxy({1, 1});
  for (Channel& channel : proxy.parts[0].channels) channel.values = {0.0f};
  proxy.parts[0].channels[0].values[0] = 1.0f;     // all the light
  proxy.parts[0].channels[1].values[0] = 0.0002f;  // rounding: 0/0 would follow
  const auto planes = attenuationPlanes(proxy);
  const std::vector<Segment> segments =
      segmentsFromAttenuation(planes, nestedOrder(planes.partition())).at(0);
  ASSERT_EQ(segments.size(), 1u);
  EXPECT_EQ(segments[0].channel, 0);
  EXPECT_TRUE(std::isfinite(segments[0].amount));
}

TEST(Decode, NamesThePartThatIsMissing) {
  ProxyImage proxy = synthetic::lengthProxy({4, 4});
  std::erase_if(proxy.parts, [](const ProxyPart& part) { return part.name == "runs"; });
  try {
    lengthPlanes(proxy);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::NotFound);
    EXPECT_NE(std::string(error.what()).find("runs"), std::string::npos);
  }
}

TEST(Decode, RefusesAProxyOfAnotherKindAndWrongSizes) {
  EXPECT_THROW(lengthPlanes(synthetic::mipProxy({4, 4})), Error);
  ProxyImage proxy = synthetic::lengthProxy({4, 4});
  proxy.parts[0].channels[1].values.pop_back();
  EXPECT_THROW(lengthPlanes(proxy), Error);
  proxy = synthetic::lengthProxy({4, 4});
  proxy.header.partition.reset();
  EXPECT_THROW(lengthPlanes(proxy), Error);
}

TEST(Decode, RefusesValuesOutOfTheirRangeNamingFileAndChannel) {
  const synthetic::TemporaryFolder folder;
  const auto path = folder.path() / "a.cdb";
  synthetic::writeArchive(path, {16, 12}, 1);
  const Archive archive(path);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  struct Case {
    std::string_view kind;
    std::size_t part;
    std::vector<float> values;
    std::string words;
  };
  const std::vector<Case> cases{
      {kind::kLength, 0, {nan, infinity, -0.5f, 50.0f}, "a length within the domain"},
      {kind::kLength, 1, {nan, infinity, -infinity, -900.0f}, "a depth within the domain"},
      {kind::kLength, 2, {nan, infinity, -1.0f, 1.5f, 60000.0f}, "a whole number"},
      {kind::kAttenuation, 0, {nan, infinity, -0.5f, 1.5f}, "a fraction of light"},
      {kind::kDepth, 0, {nan, -infinity, -900.0f}, "a depth within the domain or +infinity"},
      {kind::kReference, 0, {nan, infinity, -0.5f}, "light >= 0"},
      {kind::kMip, 0, {infinity, -infinity, 900.0f}, "within the field's range"}};
  for (const auto& [kind, part, values, words] : cases) {
    const ArchiveRow* row = nullptr;
    for (const ArchiveRow& each : archive.rows())
      if (each.proxy == kind) row = &each;
    ASSERT_NE(row, nullptr) << kind;
    const ProxyImage good = archive.open(*row).image();
    const auto decode = [&] {
      ViewData data(archive, row->cycle, row->view, row->field);
      if (kind == kind::kLength)
        data.segments(Via::Length, Order::Runs);
      else if (kind == kind::kAttenuation)
        data.segments(Via::Attenuation, Order::Mean);
      else if (kind == kind::kDepth)
        data.layers();
      else
        data.image(kind);
    };
    for (const float value : values) {
      for (const std::size_t pixel : {std::size_t(0), std::size_t(100), std::size_t(191)}) {
        ProxyImage bad = good;
        const Channel& channel = bad.parts[part].channels[0];
        bad.parts[part].channels[0].values[pixel] = value;
        writeDurably(path / row->exr, encodeExr(bad));
        try {
          decode();
          ADD_FAILURE() << kind << " " << value << " was taken";
        } catch (const Error& error) {
          const std::string text = error.what();
          EXPECT_EQ(error.code(), ErrorCode::Format);
          for (const std::string& word :
               {(path / row->exr).string(), "'" + channel.name + "'", words})
            EXPECT_NE(text.find(word), std::string::npos) << word << " is not in: " << text;
        }
      }
    }
    writeDurably(path / row->exr, encodeExr(good));
  }
}

}  // namespace
}  // namespace vestige
