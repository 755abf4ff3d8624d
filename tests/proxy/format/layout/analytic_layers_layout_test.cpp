// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/layout/analytic_layers_layout.h"

#include <random>

#include "proxy/base/durable_file.h"
#include "proxy/format/exr/exr_file.h"
#include "proxy/format/layout/proxy_check.h"
#include "tests/proxy/archive/archive_fixture.h"

namespace vestige::test {
namespace {

constexpr ImageSize kSize{20, 14};

/// Layers of all states, some thinner than a step of storage, some beyond the far end.
AnalyticLayerPlanes somePlanes(const ProxyHeader& header, int layers) {
  const std::size_t pixels = header.size.pixels();
  const auto k = std::size_t(layers);
  AnalyticLayerPlanes planes{layers, std::vector<float>((k + 1) * pixels),
                             std::vector<float>(3 * k * pixels), std::vector<float>(k * pixels),
                             std::vector<AnalyticLayerState>(pixels)};
  const DepthRange range = depthRange(header.camera, header.domain);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit(0.0f, 1.0f);
  for (std::size_t p = 0; p < pixels; ++p) {
    planes.state[p] = AnalyticLayerState(p % 3);
    double depth = range.low + 0.3 * unit(random) * (range.high - range.low);
    for (std::size_t i = 0; i <= k; ++i) {
      planes.boundary[i * pixels + p] = float(std::min(depth, range.high));
      const double step = p % 5 == 0 ? 0.0 : p % 5 == 1 ? 1e-6 : 0.3;
      depth += step * unit(random) * (range.high - range.low);
    }
    for (std::size_t i = 0; i < k; ++i) {
      planes.tau[i * pixels + p] = 8.0f * unit(random) * unit(random);
      for (std::size_t c = 0; c < 3; ++c) {
        planes.color[(3 * i + c) * pixels + p] = 1.2f * unit(random);
      }
    }
  }
  return planes;
}

ProxyHeader header() {
  ProxyHeader header = someHeader(kSize);
  header.shading = "unlit";
  return header;
}

ProxyImage stored(const ProxyImage& image, const Folder& folder) {
  const fs::path path = folder / "layered.exr";
  writeDurably(path, encodeExr(image));
  return ExrFile(path).image();
}

TEST(LayeredLayout, ValuesSurviveStorageToTheStatedErrors) {
  const Folder folder;
  for (const int layers : {1, 4, 8, kMostLayers}) {
    const AnalyticLayerPlanes planes = somePlanes(header(), layers);
    const ProxyImage image = layeredImage(header(), planes);
    EXPECT_EQ(problemsOf(image), std::vector<std::string>{});
    const ProxyImage read = stored(image, folder);
    EXPECT_EQ(read.header.shading, "unlit");
    const AnalyticLayerPlanes back = layeredPlanes(read);
    ASSERT_EQ(back.layers, layers);
    EXPECT_EQ(back.state, planes.state);
    const std::size_t pixels = kSize.pixels();
    const auto near = [&](const std::vector<float>& a, const std::vector<float>& b,
                          const char* part) {
      const double error = read.part(part).error;
      ASSERT_EQ(a.size(), b.size());
      for (std::size_t i = 0; i < a.size(); ++i) {
        if (planes.state[i % pixels] == AnalyticLayerState::Empty) {
          EXPECT_EQ(a[i], 0.0f);
        } else {
          EXPECT_NEAR(a[i], b[i], error * (1.0 + 1e-6)) << part << " " << i;
        }
      }
    };
    near(back.boundary, planes.boundary, "boundaries");
    near(back.color, planes.color, "layer00");
    near(back.tau, planes.tau, "tau");
    for (std::size_t i = pixels; i < back.boundary.size(); ++i) {
      if (planes.state[i % pixels] == AnalyticLayerState::Empty) continue;
      EXPECT_GT(back.boundary[i], back.boundary[i - pixels]) << "layers have a thickness";
    }
    // What is read is what was made, bit for bit.
    EXPECT_EQ(back.boundary, layeredPlanes(image).boundary);
    EXPECT_EQ(back.color, layeredPlanes(image).color);
    EXPECT_EQ(back.tau, layeredPlanes(image).tau);
  }
}

TEST(LayeredLayout, PlanesOfAnotherSizeAreRefused) {
  AnalyticLayerPlanes planes = somePlanes(header(), 3);
  planes.tau.pop_back();
  expectError(ErrorCode::InvalidArgument, "tau has 839 values, 3 planes of 20 x 14 need 840",
              [&] { layeredImage(header(), planes); });
  planes.layers = 17;
  expectError(ErrorCode::InvalidArgument, "has 17 layers, not 1 to 16",
              [&] { layeredImage(header(), planes); });
}

TEST(LayeredLayout, EachWrongValueIsFound) {
  const ProxyImage good = layeredImage(header(), somePlanes(header(), 2));
  const std::size_t whole = 1, empty = 0;  // pixels of that state
  const auto expectProblem = [&](const char* part, std::size_t channel, std::size_t pixel,
                                 float value, const std::string& words) {
    ProxyImage image = good;
    for (ProxyPart& p : image.parts)
      if (p.name == part) p.channels[channel].values[pixel] = value;
    const std::vector<std::string> problems = problemsOf(image);
    ASSERT_FALSE(problems.empty()) << part << ": " << words;
    EXPECT_NE(problems[0].find(words), std::string::npos) << problems[0];
  };
  expectProblem("layer01", 2, whole, -0.5f, "light >= 0");
  expectProblem("layer00", 0, empty, 0.5f, "0 where the state is 0");
  expectProblem("tau", 0, whole, NAN, "an optical depth");
  expectProblem("tau", 1, empty, 1.0f, "0 where the state is 0");
  expectProblem("state", 0, whole, 3.0f, "0, 1 or 2");
  expectProblem("state", 0, whole, 0.5f, "0, 1 or 2");
  expectProblem("boundaries", 1, whole, 1e9f, "a depth within the domain");
  expectProblem("boundaries", 2, whole, good.part("boundaries").channels[0].values[whole],
                "deeper than the one before");
  ProxyImage missing = good;
  missing.parts.erase(missing.parts.begin());
  EXPECT_FALSE(problemsOf(missing).empty());
  missing = good;
  std::erase_if(missing.parts, [](const ProxyPart& part) { return part.name == "tau"; });
  EXPECT_FALSE(problemsOf(missing).empty());
  expectError(ErrorCode::Format, "has 0 layers", [&] { layeredPlanes(missing); });
  ProxyImage distorted = good;
  distorted.header.camera = frameBoxDistorted(good.header.domain, {0, 1, 0}, {0, 0, 1}, 1.0);
  EXPECT_FALSE(problemsOf(distorted).empty());
  expectError(ErrorCode::Format, "is multi-perspective", [&] { layeredPlanes(distorted); });
}

}  // namespace
}  // namespace vestige::test
