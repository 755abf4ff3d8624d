// SPDX-License-Identifier: BSD-3-Clause
#include <cstring>
#include <nlohmann/json.hpp>
#include <random>

#include "proxy/base/durable_file.h"
#include "proxy/format/layout/proxy_check.h"
#include "tests/proxy/archive/archive_fixture.h"

namespace vestige::test {
namespace {

ProxyImage throughFile(const ProxyImage& image) {
  Folder folder;
  writeDurably(folder / "a.exr", encodeExr(image));
  return ExrFile(folder / "a.exr").image();
}

void expectSameHeader(const ProxyHeader& a, const ProxyHeader& b) {
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_EQ(a.field, b.field);
  EXPECT_EQ(a.units, b.units);
  EXPECT_EQ(a.time, b.time);
  EXPECT_EQ(a.cycle, b.cycle);
  EXPECT_EQ(a.view, b.view);
  EXPECT_TRUE(a.camera == b.camera);
  EXPECT_TRUE(a.size == b.size);
  EXPECT_TRUE(a.domain == b.domain);
  EXPECT_TRUE(a.partition == b.partition);
  ASSERT_EQ(a.base.has_value(), b.base.has_value());
  if (a.base) {
    EXPECT_EQ(toJson(*a.base), toJson(*b.base));
  }
  EXPECT_TRUE(a.customization == b.customization);
  EXPECT_EQ(a.isovalues, b.isovalues);
  EXPECT_TRUE(a.statistics == b.statistics);
  EXPECT_EQ(a.provenance, b.provenance);
  EXPECT_EQ(a.note, b.note);
  EXPECT_EQ(a.owner, b.owner);
}

void expectSamePart(const ProxyPart& a, const ProxyPart& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.unit, b.unit);
  EXPECT_EQ(a.zero, b.zero);
  EXPECT_EQ(a.error, b.error);
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (std::size_t c = 0; c < a.channels.size(); ++c) {
    const Channel &x = a.channels[c], &y = b.channels[c];
    EXPECT_EQ(x.name, y.name);
    EXPECT_EQ(x.storage, y.storage);
    ASSERT_EQ(x.values.size(), y.values.size());
    if (std::memcmp(x.values.data(), y.values.data(), x.values.size() * sizeof(float)) == 0)
      continue;
    for (std::size_t i = 0; i < x.values.size(); ++i)
      ASSERT_EQ(std::bit_cast<std::uint32_t>(x.values[i]),
                std::bit_cast<std::uint32_t>(y.values[i]))
          << a.name << "." << x.name << " at " << i << ": " << x.values[i] << " and "
          << y.values[i];
  }
}

void expectSame(const ProxyImage& a, const ProxyImage& b) {
  expectSameHeader(a.header, b.header);
  ASSERT_EQ(a.parts.size(), b.parts.size());
  for (std::size_t p = 0; p < a.parts.size(); ++p) expectSamePart(a.parts[p], b.parts[p]);
}

TEST(Exr, EveryKindOfProxySurvivesStorageBitForBit) {
  for (const ProxyImage& image : someImages(someHeader())) {
    SCOPED_TRACE(image.header.kind);
    expectSame(image, throughFile(image));
    EXPECT_TRUE(problemsOf(image).empty()) << problemsOf(image).front();
  }
}

/// A seed of `parameters` in the middle.
Customization someCustomization(const SeedParameters& parameters) {
  Customization customization;
  customization.resolution = 40;
  customization.seeds.push_back(
      {"core", someHeader().domain.center(), {0.1, 0.0, 1.0 / 3.0}, true, parameters});
  customization.corners[3].gamma = 1.0 / 7.0;
  return customization;
}

TEST(Exr, CustomisationsSurviveWhereTheyHaveAPart) {
  SeedParameters parameters;
  parameters.opacity = 0.1;
  parameters.shift = {0.3, -1.0, 0.0};
  for (ProxyImage image : someImages(someHeader())) {
    image.header.customization = someCustomization(parameters);
    expectSame(image, throughFile(image));
    const std::string& kind = image.header.kind;
    const bool part = kind == kind::kAttenuation || kind == kind::kReference ||
                      kind == kind::kLayered || kind == kind::kMip;
    EXPECT_EQ(problemsOf(image).empty(), part) << kind;
  }
}

TEST(Exr, CustomisationsThatNoReaderTakesAreNotWritten) {
  ProxyImage image = someImages(someHeader()).front();
  SeedParameters parameters;
  parameters.opacity = std::numeric_limits<double>::quiet_NaN();
  image.header.customization = someCustomization(parameters);
  expectError(ErrorCode::InvalidArgument, "customisation of a proxy is nan",
              [&] { encodeExr(image); });
  image.header.customization = someCustomization({});
  image.header.customization->seeds[0].position.x = 99.0;
  expectError(ErrorCode::InvalidArgument, "seed 0 'core' stands at 99", [&] { encodeExr(image); });
}

TEST(Exr, HeadersWithNothingOptionalSurvive) {
  ProxyHeader h = someHeader();
  h.partition.reset();
  h.base.reset();
  h.isovalues.clear();
  h.units = h.provenance = h.note = h.owner = "";
  Planes planes(someHeader());
  ProxyImage image = mipImage(h, planes.mip);
  expectSame(image, throughFile(image));
}

TEST(Exr, PerspectiveCamerasAndAwkwardNumbersSurviveBitForBit) {
  ProxyHeader h = someHeader();
  h.camera = frameBox(h.domain, {1.0, 2.0, 3.0}, {0.0, 0.0, 1.0}, h.size.aspect(),
                      Projection::Perspective, 0.7);
  h.camera.pixelAspect = 1.1;
  h.time = 1e-300;
  h.cycle = 123456789012345;
  h.statistics.deviation = std::numeric_limits<double>::infinity();
  h.statistics.low = -0.0;
  h.isovalues = {5e-324, 1.7976931348623157e308};
  ProxyImage image = throughFile(depthImage(h, Planes(h).depth, Planes(h).normal));
  expectSameHeader(
      [&] {
        auto x = h;
        x.kind = "depth";
        return x;
      }(),
      image.header);
}

TEST(Exr, MultiPerspectiveCamerasSurviveAndOthersSayNothingOfConvergence) {
  ProxyHeader h = someHeader();
  h.camera = frameBoxDistorted(h.domain, {1.0, 2.0, 3.0}, {0.0, 0.0, 1.0}, h.size.aspect(), 0.7);
  const ProxyImage image = depthImage(h, Planes(h).depth, Planes(h).normal);
  EXPECT_EQ(throughFile(image).header.camera, h.camera);
  const auto names = [](const ProxyImage& proxy, const char* attribute) {
    const std::vector<std::byte> bytes = encodeExr(proxy);
    return std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size())
               .find(attribute) != std::string_view::npos;
  };
  EXPECT_TRUE(names(image, "vestige:convergence"));
  EXPECT_FALSE(names(image, "worldToNDC")) << "no matrix makes such a picture";
  const ProxyImage parallel = someImages(someHeader())[0];
  EXPECT_FALSE(names(parallel, "vestige:convergence")) << "as archives always were";
  EXPECT_TRUE(names(parallel, "worldToNDC"));
}

TEST(Exr, EqualImagesGiveEqualBytes) {
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_EQ(encodeExr(someImages(someHeader())[i]), encodeExr(someImages(someHeader())[i]));
}

TEST(Exr, StorageStaysWithinItsStatedError) {
  ProxyHeader h = someHeader({64, 64});
  Planes p(h);
  const std::size_t n = h.size.pixels();
  ProxyImage length = lengthImage(h, p.length, p.moment, p.runs);
  ProxyImage attenuation = attenuationImage(h, p.attenuation, p.transmittance);
  ProxyImage depth = depthImage(h, p.depth, p.normal);
  for (std::size_t k = 0; k < std::size_t(h.partition->channels()); ++k)
    for (std::size_t i = 0; i < n; ++i) {
      const float l = p.length[k * n + i];
      ASSERT_NEAR(length.part("length").channels[k].values[i], l, length.part("length").error);
      ASSERT_NEAR(attenuation.part("attenuation").channels[k].values[i], p.attenuation[k * n + i],
                  attenuation.part("attenuation").error);
      if (l > 0.0f) {
        ASSERT_NEAR(length.part("depth").channels[k].values[i], p.moment[k * n + i] / l,
                    length.part("depth").error + 1e-6);
        ASSERT_EQ(length.part("runs").channels[k].values[i], p.runs[k * n + i]);
      }
    }
  for (std::size_t i = 0; i < n; ++i)
    if (std::isfinite(p.depth[i])) {
      ASSERT_NEAR(depth.part("layer00").channels[0].values[i], p.depth[i],
                  depth.part("layer00").error);
    }
}

TEST(Exr, AnyHalfAndAnyFloatSurvive) {
  ProxyHeader h = someHeader({256, 256});
  ProxyPart part{
      "all", 1.0, 0.0, 0.0, {{"h", ChannelStorage::Half, {}}, {"f", ChannelStorage::Float, {}}}};
  std::mt19937 random(1);
  for (std::uint32_t bits = 0; bits < 65536; ++bits) {
    const int exponent = int(bits >> 10 & 31), mantissa = int(bits & 1023);
    double value =
        exponent ? std::ldexp(1024 + mantissa, exponent - 25) : std::ldexp(mantissa, -24);
    if (exponent == 31) value = mantissa ? NAN : HUGE_VAL;
    part.channels[0].values.push_back(float(bits & 0x8000 ? -value : value));
    part.channels[1].values.push_back(std::bit_cast<float>(std::uint32_t(random())));
  }
  ProxyPart back = throughFile({h, {part}}).parts[0];
  for (std::size_t i = 0; i < 65536; ++i) {
    const float a = part.channels[0].values[i], b = back.channels[0].values[i];
    ASSERT_TRUE(a == b || (std::isnan(a) && std::isnan(b))) << a << " " << b;
    ASSERT_EQ(std::bit_cast<std::uint32_t>(part.channels[1].values[i]),
              std::bit_cast<std::uint32_t>(back.channels[1].values[i]));
  }
}

TEST(Exr, AWhollyEmptyPictureSurvivesAndIsTiny) {
  ProxyHeader h = someHeader({512, 512});
  const std::size_t n = h.size.pixels(), K = std::size_t(h.partition->channels());
  std::vector<float> zero(K * n, 0.0f);
  ProxyImage image = lengthImage(h, zero, zero, zero);
  EXPECT_LT(encodeExr(image).size(), 8000u);
  expectSame(image, throughFile(image));
  std::vector<float> none(n, NAN);
  ProxyImage mip = mipImage(h, none);
  EXPECT_TRUE(std::isnan(throughFile(mip).parts[0].channels[0].values[17]));
  std::vector<float> one(n, 1.0f);
  expectSame(attenuationImage(h, zero, one), throughFile(attenuationImage(h, zero, one)));
}

TEST(Exr, StoringEmptyPixelsChangesTheFileButNothingThatIsRead) {
  Folder folder;
  for (const ProxyImage& image : someImages(someHeader())) {
    writeDurably(folder / "a.exr", encodeExr(image, EmptyPixels::Store));
    expectSame(image, ExrFile(folder / "a.exr").image());
    EXPECT_GE(fs::file_size(folder / "a.exr"), encodeExr(image).size());
  }
}

TEST(Exr, ASinglePixelSurvives) {
  ProxyHeader h = someHeader({1, 1});
  for (const ProxyImage& image : someImages(h)) expectSame(image, throughFile(image));
}

TEST(Exr, PartsDecodeOneByOne) {
  Folder folder;
  ProxyImage image = someImages(someHeader())[1];
  writeDurably(folder / "a.exr", encodeExr(image));
  ExrFile file(folder / "a.exr");
  EXPECT_EQ(file.partNames(), (std::vector<std::string>{"length", "depth", "runs"}));
  EXPECT_TRUE(file.has("runs"));
  EXPECT_FALSE(file.has("Z"));
  expectSamePart(file.part("runs"), image.part("runs"));
  expectSamePart(file.part("length"), image.part("length"));
  expectError(ErrorCode::NotFound, "'Z'", [&] { file.part("Z"); });
}

TEST(Exr, WhatCannotBeStoredIsRefusedByName) {
  ProxyImage good = someImages(someHeader())[1];
  auto refused = [&](const std::string& words, const std::function<void(ProxyImage&)>& spoil) {
    ProxyImage bad = good;
    spoil(bad);
    expectError(ErrorCode::InvalidArgument, words, [&] { encodeExr(bad); });
  };
  refused("has 3 values", [](auto& i) { i.parts[0].channels[0].values.resize(3); });
  refused("a b", [](auto& i) { i.parts[0].channels[1].name = "a b"; });
  refused("comes twice", [](auto& i) { i.parts[1].name = "length"; });
  refused("comes twice", [](auto& i) { i.parts[0].channels[1].name = "i00"; });
  refused("inf", [](auto& i) { i.parts[0].unit = HUGE_VAL; });
  refused("unit 0", [](auto& i) { i.parts[0].unit = 0.0; });
  refused("1e+30", [](auto& i) { i.parts[0].channels[0].values[5] = 1e30f; });
  refused("no channels", [](auto& i) { i.parts[0].channels.clear(); });
  refused("0 parts", [](auto& i) { i.parts.clear(); });
  refused("field name is empty", [](auto& i) { i.header.field.clear(); });
  refused("40000 x 1", [](auto& i) { i.header.size = {40000, 1}; });
  refused("nan", [](auto& i) { i.header.time = NAN; });
  refused("exceeds count", [](auto& i) { i.header.statistics.noData = 2000; });
  refused("nan", [](auto& i) { i.header.camera.position.x = NAN; });
}

}  // namespace
}  // namespace vestige::test
