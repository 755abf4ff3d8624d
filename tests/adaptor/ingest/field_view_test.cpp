// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/ingest/field_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace vestige {
namespace {

constexpr std::array<int, 3> kSize{5, 4, 3};
constexpr int kCount = 5 * 4 * 3;

std::array<std::vector<double>, 3> unitNodes() {
  std::array<std::vector<double>, 3> nodes;
  for (std::size_t a = 0; a < 3; ++a) {
    for (int i = 0; i < kSize[a]; ++i) nodes[a].push_back(i);
  }
  return nodes;
}

template <class T>
FieldView packed(SampleType type, const std::vector<T>& data, int components = 1) {
  FieldView field;
  field.type = type;
  field.size = kSize;
  const auto step = std::ptrdiff_t(sizeof(T)) * components;
  field.strides = {step, step * kSize[0], step * kSize[0] * kSize[1]};
  for (int c = 0; c < components; ++c) {
    field.components.push_back(reinterpret_cast<const std::byte*>(data.data() + c));
  }
  return field;
}

std::vector<double> readAll(const FieldReader& reader) {
  const auto [nx, ny, nz] = reader.size();
  std::vector<double> values(std::size_t(nx * ny * nz));
  for (int z = 0; z < nz; ++z) {
    for (int y = 0; y < ny; ++y) reader.row(y, z, values.data() + (z * ny + y) * nx);
  }
  return values;
}

template <class T>
void expectReadsAs(SampleType type) {
  SCOPED_TRACE(nameOf(type));
  ASSERT_EQ(sizeOf(type), sizeof(T));
  std::vector<T> data;
  for (int i = 0; i < kCount; ++i) data.push_back(T(i));
  data[0] = std::numeric_limits<T>::lowest();
  data[1] = std::numeric_limits<T>::max();
  const auto values = readAll(FieldReader(packed(type, data), {}, {}, unitNodes()));
  for (int i = 0; i < kCount; ++i) {
    EXPECT_EQ(values[std::size_t(i)], static_cast<double>(data[std::size_t(i)]));
  }
}

TEST(FieldView, ReadsEveryTypeToItsLimits) {
  expectReadsAs<float>(SampleType::Float32);
  expectReadsAs<double>(SampleType::Float64);
  expectReadsAs<std::int8_t>(SampleType::Int8);
  expectReadsAs<std::uint8_t>(SampleType::UInt8);
  expectReadsAs<std::int16_t>(SampleType::Int16);
  expectReadsAs<std::uint16_t>(SampleType::UInt16);
  expectReadsAs<std::int32_t>(SampleType::Int32);
  expectReadsAs<std::uint32_t>(SampleType::UInt32);
  expectReadsAs<std::int64_t>(SampleType::Int64);
  expectReadsAs<std::uint64_t>(SampleType::UInt64);
}

TEST(FieldView, ReadsInterleavedAndSeparateComponentsAlike) {
  std::vector<float> interleaved, separate(3 * kCount);
  for (int i = 0; i < 3 * kCount; ++i) interleaved.push_back(float(i % 7) - 2.5f);
  for (int i = 0; i < kCount; ++i) {
    for (int c = 0; c < 3; ++c) {
      separate[std::size_t(c * kCount + i)] = interleaved[std::size_t(3 * i + c)];
    }
  }
  const auto aos = packed(SampleType::Float32, interleaved, 3);
  auto soa = packed(SampleType::Float32, separate);
  for (int c = 1; c < 3; ++c) {
    soa.components.push_back(reinterpret_cast<const std::byte*>(separate.data() + c * kCount));
  }
  for (const auto& derivation :
       {Derivation{1, false, {}}, {-1, false, {}}, {2, true, {}}, {-1, true, {}}}) {
    EXPECT_EQ(readAll(FieldReader(aos, {}, derivation, unitNodes())),
              readAll(FieldReader(soa, {}, derivation, unitNodes())));
  }
}

TEST(FieldView, FollowsNegativeAndUnalignedStrides) {
  // Records of 1 + 4 bytes, x running backwards.
  std::vector<std::byte> records(std::size_t(kCount) * 5);
  for (int i = 0; i < kCount; ++i) {
    const auto value = float(i);
    std::memcpy(records.data() + 5 * i + 1, &value, sizeof value);
  }
  FieldView field;
  field.size = kSize;
  field.components = {records.data() + 1 + 5 * (kSize[0] - 1)};
  field.strides = {-5, 5 * kSize[0], 5 * kSize[0] * kSize[1]};
  const auto values = readAll(FieldReader(field, {}, {}, unitNodes()));
  EXPECT_EQ(values[0], 4.0);
  EXPECT_EQ(values[4], 0.0);
  EXPECT_EQ(values[5], 9.0);
}

TEST(FieldView, TurnsNaNInfinityAndMaskedIntoNoData) {
  std::vector<double> data(kCount, 1.0);
  data[1] = std::numeric_limits<double>::infinity();
  data[2] = -data[1];
  data[3] = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::uint8_t> mask(kCount, 1);
  mask[7] = 3;
  const MaskView view{reinterpret_cast<const std::byte*>(mask.data()), 2, {1, 5, 20}};
  const auto values =
      readAll(FieldReader(packed(SampleType::Float64, data), view, {}, unitNodes()));
  for (int i = 0; i < kCount; ++i) {
    EXPECT_EQ(std::isnan(values[std::size_t(i)]), (i >= 1 && i <= 3) || i == 7) << i;
  }
}

TEST(FieldView, MagnitudeNeitherOverflowsNorUnderflows) {
  std::vector<double> data(2 * kCount, 0.0);
  data[0] = 3e200, data[1] = 4e200;
  data[2] = 3e-200, data[3] = 4e-200;
  data[4] = 3.0, data[5] = -4.0;
  data[6] = std::numeric_limits<double>::quiet_NaN();
  const auto values =
      readAll(FieldReader(packed(SampleType::Float64, data, 2), {}, {-1, false, {}}, unitNodes()));
  EXPECT_DOUBLE_EQ(values[0], 5e200);
  EXPECT_DOUBLE_EQ(values[1], 5e-200);
  EXPECT_DOUBLE_EQ(values[2], 5.0);
  EXPECT_TRUE(std::isnan(values[3]));
  EXPECT_EQ(values[4], 0.0);
}

TEST(FieldView, GradientOfALinearFieldIsItsSlopeOnAnyAxes) {
  auto nodes = unitNodes();
  nodes[0] = {0.0, 0.5, 2.0, 2.25, 7.0};
  nodes[2] = {-1.0, 10.0, 11.0};
  std::vector<double> data;
  for (const double z : nodes[2]) {
    for (const double y : nodes[1]) {
      for (const double x : nodes[0]) data.push_back(2.0 * x - 3.0 * y + 6.0 * z);
    }
  }
  const auto values =
      readAll(FieldReader(packed(SampleType::Float64, data), {}, {0, true, {}}, nodes));
  for (const double value : values) EXPECT_NEAR(value, 7.0, 1e-12);
}

TEST(FieldView, TheGradientNormOfLinearFieldsIsThatOfTheirMatrix) {
  std::vector<double> first, second;
  const auto nodes = unitNodes();
  for (const double z : nodes[2])
    for (const double y : nodes[1])
      for (const double x : nodes[0]) {
        first.push_back(20.0 * x - 30.0 * y + 60.0 * z);  // a slope of 70
        second.push_back(4.0 * x + 3.0 * y);              // of 5
      }
  const FieldReader a(packed(SampleType::Float64, first), {}, {}, nodes);
  const FieldReader b(packed(SampleType::Float64, second), {}, {}, nodes);
  const FieldReader norm({a, b}, {10.0, 0.5});
  for (const double value : readAll(norm)) EXPECT_NEAR(value, std::hypot(7.0, 10.0), 1e-12);
  // A norm of norms: that of a constant is 0.
  for (const double value : readAll(FieldReader({norm, a}, {1.0, 7.0})))
    EXPECT_NEAR(value, 10.0, 1e-11);
  second[3] = std::numeric_limits<double>::quiet_NaN();
  const FieldReader holed(packed(SampleType::Float64, second), {}, {}, nodes);
  EXPECT_TRUE(std::isnan(readAll(FieldReader({a, holed}, {1.0, 1.0}))[3]));
}

TEST(FieldView, GradientIsOneSidedBesideMissingSamples) {
  std::vector<double> data;
  for (int i = 0; i < kCount; ++i) data.push_back(i % 5);
  data[2] = std::numeric_limits<double>::quiet_NaN();
  const auto values =
      readAll(FieldReader(packed(SampleType::Float64, data), {}, {0, true, {}}, unitNodes()));
  EXPECT_DOUBLE_EQ(values[1], 1.0);
  EXPECT_TRUE(std::isnan(values[2]));
  EXPECT_DOUBLE_EQ(values[3], 1.0);
}

TEST(FieldView, GradientOfASampleOnItsOwnIsThatOfTheOtherAxes) {
  std::vector<double> data;
  for (int i = 0; i < kCount; ++i) data.push_back(i % 5);
  data[0] = data[2] = std::numeric_limits<double>::quiet_NaN();
  const auto values =
      readAll(FieldReader(packed(SampleType::Float64, data), {}, {0, true, {}}, unitNodes()));
  EXPECT_DOUBLE_EQ(values[1], 0.0) << "it has data, and nothing is known to change along x";
}

TEST(FieldView, NormalisesInDoubleSoThatSmallDifferencesSurvive) {
  std::vector<double> data(kCount, 101325.0);
  data[0] = 101324.99, data[1] = 101325.01;
  data[2] = std::numeric_limits<double>::infinity();
  const FieldReader reader(packed(SampleType::Float64, data), {}, {}, unitNodes());
  for (const int threads : {1, 3}) {
    std::vector<float> out(kCount);
    fillNormalised(reader, 101324.99, 101325.01, {{0, 0, 0}, reader.size()}, 0, 3, out.data(),
                   threads);
    EXPECT_EQ(out[0], 0.0f);
    EXPECT_EQ(out[1], 1.0f);
    EXPECT_TRUE(std::isnan(out[2]));
    EXPECT_NEAR(out[3], 0.5f, 1e-6f);
  }
}

TEST(FieldView, FillsASlabAsPartOfTheWhole) {
  std::vector<float> data;
  for (int i = 0; i < kCount; ++i) data.push_back(float(i));
  const FieldReader reader(packed(SampleType::Float32, data), {}, {}, unitNodes());
  std::vector<float> slab(20);
  fillNormalised(reader, 0.0, 1.0, {{0, 0, 0}, reader.size()}, 1, 2, slab.data(), 2);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(slab[std::size_t(i)], float(20 + i));
}

TEST(FieldView, FillValuesAreNoDataAsTheTypeHoldsThem) {
  const auto missing = [](SampleType type, const auto& data, std::vector<ValueRange> noData,
                          int components = 1, int component = 0) {
    const auto values = readAll(FieldReader(packed(type, data, components), {},
                                            {component, false, std::move(noData)}, unitNodes()));
    std::vector<int> indices;
    for (int i = 0; i < kCount; ++i) {
      if (std::isnan(values[std::size_t(i)])) indices.push_back(i);
    }
    return indices;
  };
  std::vector<float> floats(kCount, 1.0f);
  floats[3] = 1e20f;
  floats[4] = std::nextafter(1e20f, 0.0f);
  floats[5] = -9999.0f;
  floats[6] = -1e30f;
  floats[7] = -2e15f;
  floats[8] = -1e10f;
  EXPECT_EQ(missing(SampleType::Float32, floats, {{1e20, 1e20}}), std::vector<int>{3});
  EXPECT_EQ(missing(SampleType::Float32, floats, {{-9999, -9999}, {-1e30, -1e10}}),
            (std::vector<int>{5, 6, 7, 8}));
  EXPECT_EQ(missing(SampleType::Float32, floats, {{-HUGE_VAL, -9999}}),
            (std::vector<int>{5, 6, 7, 8}));
  std::vector<double> doubles(kCount, 1.0);
  doubles[1] = 1e20;
  doubles[2] = double(1e20f);
  doubles[3] = std::nextafter(1e20, 0.0);
  EXPECT_EQ(missing(SampleType::Float64, doubles, {{1e20, 1e20}}), (std::vector<int>{1, 2}));
  std::vector<std::int16_t> shorts(kCount, 7);
  shorts[9] = -32768;
  EXPECT_EQ(missing(SampleType::Int16, shorts, {{-32768, -32768}, {7.5, 7.5}}),
            std::vector<int>{9});

  // Of vectors: in the component that is read, or in any that a magnitude is made of.
  std::vector<float> vectors(std::size_t(kCount) * 2, 3.0f);
  vectors[2 * 4] = -9999.0f;
  vectors[2 * 6 + 1] = -9999.0f;
  vectors[2 * 8] = vectors[2 * 8 + 1] = -9999.0f;
  EXPECT_EQ(missing(SampleType::Float32, vectors, {{-9999, -9999}}, 2, 0),
            (std::vector<int>{4, 8}));
  EXPECT_EQ(missing(SampleType::Float32, vectors, {{-9999, -9999}}, 2, -1),
            (std::vector<int>{4, 6, 8}));
}

TEST(FieldView, GradientsLookAwayFromFillValues) {
  std::vector<float> data(kCount);
  for (int i = 0; i < kCount; ++i) data[std::size_t(i)] = float(i % 5);
  data[7] = 1e20f;
  const auto values = readAll(
      FieldReader(packed(SampleType::Float32, data), {}, {0, true, {{1e20, 1e20}}}, unitNodes()));
  for (int i = 0; i < kCount; ++i) {
    if (i == 7) {
      EXPECT_TRUE(std::isnan(values[std::size_t(i)]));
    } else {
      EXPECT_NEAR(values[std::size_t(i)], 1.0, 1e-6) << i;
    }
  }
}

}  // namespace
}  // namespace vestige
