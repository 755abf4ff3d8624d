// SPDX-License-Identifier: BSD-3-Clause
//
// Stored fields: what comes back is within the stated tolerance, gaps stay gaps, and files that lie
// about themselves are refused.
#include "proxy/format/layout/field_layout.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "proxy/base/error.h"
#include "proxy/format/layout/proxy_check.h"
#include "proxy/camera/view_set.h"
#include "tests/proxy/archive/archive_fixture.h"

namespace vestige {
namespace {

FieldSamples waves(std::array<int, 3> size) {
  FieldSamples field;
  field.low = 101324.99;
  field.high = 101325.01;
  for (std::size_t a = 0; a < 3; ++a) field.axes[a] = {size[a], -1.0, 0.5, {}};
  for (int z = 0; z < size[2]; ++z) {
    for (int y = 0; y < size[1]; ++y) {
      for (int x = 0; x < size[0]; ++x) {
        field.values.push_back(0.5f + 0.5f * std::sin(0.3f * float(x)) * std::cos(0.2f * float(y)) *
                                          std::sin(0.1f + 0.25f * float(z)));
      }
    }
  }
  return field;
}

ProxyHeader fieldHeader() {
  ProxyHeader header;
  header.field = "pressure";
  header.view = "front";
  header.domain = {{-1.0, -1.0, -1.0}, {9.0, 8.0, 7.0}};
  header.camera = frameBox(header.domain, {0, 1, 0}, {0, 0, 1}, 1.0);
  header.statistics.low = 101324.99;
  header.statistics.high = 101325.01;
  return header;
}

double worst(const FieldSamples& a, const FieldSamples& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    most = std::max(most, double(std::abs(a.values[i] - b.values[i])));
  }
  return most;
}

class TemporaryExr {
 public:
  explicit TemporaryExr(const ProxyImage& image)
      : path_(std::filesystem::path(testing::TempDir()) / "field_layout_test.exr") {
    const auto bytes = encodeExr(image);
    std::ofstream(path_, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
    size_ = bytes.size();
  }
  ~TemporaryExr() { std::filesystem::remove(path_); }
  const std::filesystem::path& path() const { return path_; }
  std::size_t size() const { return size_; }

 private:
  std::filesystem::path path_;
  std::size_t size_ = 0;
};

TEST(StoredField, ComesBackWithinItsToleranceThroughAFile) {
  const FieldSamples field = waves({37, 22, 19});
  for (const double share : {1e-2, 1e-4}) {
    const double tolerance = share * (field.high - field.low);
    const TemporaryExr file(fieldImage(fieldHeader(), field, {1, tolerance}));
    const ProxyImage image = ExrFile(file.path()).image();
    EXPECT_EQ(problemsOf(image), std::vector<std::string>{});
    EXPECT_EQ(image.header.view, kFieldView);
    EXPECT_EQ(image.parts[0].error, tolerance);
    const FieldSamples back = fieldSamples(image);
    EXPECT_EQ(back.axes, field.axes);
    EXPECT_LE(worst(field, back), share);
    EXPECT_GT(worst(field, back), 0.0);
    // One byte a pixel costs little more than the stream.
    EXPECT_LT(file.size(), image.header.grid->bytes * 102 / 100 + 4096);
  }
}

TEST(StoredField, GapsStayGapsAndDoNotSpread) {
  FieldSamples field = waves({20, 17, 9});
  std::vector<std::size_t> gaps{0, 5, 6, 400, field.values.size() - 1};
  for (const std::size_t i : gaps) field.values[i] = std::numeric_limits<float>::quiet_NaN();
  const double share = 1e-3;
  const FieldSamples back =
      fieldSamples(fieldImage(fieldHeader(), field, {1, share * (field.high - field.low)}));
  for (std::size_t i = 0; i < field.values.size(); ++i) {
    if (std::isnan(field.values[i])) {
      EXPECT_TRUE(std::isnan(back.values[i])) << i;
    } else {
      ASSERT_NEAR(back.values[i], field.values[i], share) << i;
    }
  }
}

TEST(StoredField, ReductionKeepsLinearFieldsAndPlaces) {
  FieldSamples field;
  field.axes = {FieldAxis{8, 2.0, 0.5, {}}, FieldAxis{4, 0.0, 1.0, {}},
                FieldAxis{5, 0.0, 1.0, {0.0, 1.0, 3.0, 4.0, 9.0}}};
  for (int z = 0; z < 5; ++z) {
    for (int y = 0; y < 4; ++y) {
      for (int x = 0; x < 8; ++x) {
        field.values.push_back(
            float(0.02 * field.axes[0].at(x) + 0.03 * y + 0.04 * field.axes[2].at(z)));
      }
    }
  }
  field.values[0] = std::numeric_limits<float>::quiet_NaN();  // one of eight: still data
  const FieldSamples half = reduced(field, 2);
  EXPECT_EQ(half.axes[0], (FieldAxis{4, 2.25, 1.0, {}}));
  EXPECT_EQ(half.axes[2].nodes, (std::vector<double>{0.5, 3.5, 9.0}));
  for (int z = 0; z < 3; ++z) {
    for (int y = 0; y < 2; ++y) {
      for (int x = 0; x < 4; ++x) {
        if (x + y + z == 0) continue;
        const double expected =
            0.02 * half.axes[0].at(x) + 0.03 * half.axes[1].at(y) + 0.04 * half.axes[2].at(z);
        EXPECT_NEAR(half.values[std::size_t((z * 2 + y) * 4 + x)], expected, 1e-6);
      }
    }
  }
  EXPECT_TRUE(std::isfinite(half.values[0]));
  for (const std::size_t i : {1u, 8u, 9u, 32u}) {
    field.values[i] = std::numeric_limits<float>::quiet_NaN();
  }
  EXPECT_TRUE(std::isnan(reduced(field, 2).values[0]));  // five of eight
}

TEST(StoredField, EqualFieldsGiveEqualBytes) {
  const FieldSamples field = waves({21, 14, 33});
  EXPECT_EQ(encodeExr(fieldImage(fieldHeader(), field, {2, 1e-5})),
            encodeExr(fieldImage(fieldHeader(), field, {2, 1e-5})));
}

TEST(StoredField, RefusesWhatMakesNoSense) {
  const FieldSamples field = waves({6, 5, 4});
  EXPECT_THROW(fieldImage(fieldHeader(), field, {0, 1e-5}), Error);
  EXPECT_THROW(fieldImage(fieldHeader(), field, {1, 0.0}), Error);
  FieldSamples less = field;
  less.values.pop_back();
  EXPECT_THROW(fieldImage(fieldHeader(), less, {1, 1e-5}), Error);
  const auto wrong = [](auto change) {
    nlohmann::json grid = toJson(FieldGrid{});
    change(grid);
    EXPECT_THROW(fieldGridFromJson(grid), Error) << grid.dump();
  };
  wrong([](auto& grid) { grid["low"] = 2.0; });
  wrong([](auto& grid) { grid["codec"] = "lossless"; });
  wrong([](auto& grid) { grid["axes"][0]["spacing"] = 0.0; });
  wrong([](auto& grid) { grid["axes"][1] = {{"nodes", {1.0, 1.0}}}; });
  wrong([](auto& grid) { grid["axes"][2]["count"] = 1 << 20; });
  wrong([](auto& grid) { grid["axes"].erase(2); });
  wrong([](auto& grid) { grid["tolerance"] = -1.0; });
  wrong([](auto& grid) { grid["bytes"] = -5; });
  wrong([](auto& grid) { grid.erase("reduction"); });
}

TEST(StoredField, HostileStreamsAreErrorsOrNoise) {
  const ProxyImage image = fieldImage(fieldHeader(), waves({30, 21, 17}), {1, 1e-6});
  const auto refused = [](const ProxyImage& hostile) {
    EXPECT_THROW(fieldSamples(hostile), Error);
    EXPECT_FALSE(problemsOf(hostile).empty());
  };
  ProxyImage hostile = image;
  for (FieldAxis& axis : hostile.header.grid->axes) axis.count = 1 << 16;
  refused(hostile);
  hostile = image;
  hostile.header.grid->axes[2].count = 1 << 12;
  refused(hostile);
  hostile = image;
  hostile.header.grid->bytes = image.header.size.pixels() + 1;
  refused(hostile);
  hostile = image;
  hostile.parts[0].channels[0].values[2] = 255.0f;  // a slab of 16 MB
  refused(hostile);
  hostile = image;
  hostile.parts[0].channels[0].values[7] = 0.5f;
  refused(hostile);
  hostile = image;
  hostile.header.grid.reset();
  refused(hostile);
  // Any bytes at all: decoded to something or refused, never out of bounds (asan looks on).
  std::mt19937 random(7);
  for (int i = 0; i < 60; ++i) {
    hostile = image;
    auto& bytes = hostile.parts[0].channels[0].values;
    for (int j = 0; j < 40; ++j) bytes[20 + random() % (bytes.size() - 20)] = float(random() % 256);
    try {
      fieldSamples(hostile);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::Format);
    }
  }
}

}  // namespace
}  // namespace vestige
