// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/transfer/transfer_function.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "proxy/base/error.h"

namespace vestige {
namespace {

using nlohmann::json;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TransferFunction make(std::vector<OpacityPoint> points, double length = 2.0) {
  return TransferFunction(std::move(points), length, Colormap::named("viridis"), -1.0, 3.0);
}

TEST(TransferFunction, IsPiecewiseLinearInOpacityAndConstantBeyond) {
  const auto f = make({{1.0, 0.2}, {2.0, 0.6}});
  EXPECT_DOUBLE_EQ(f.opacity(1.25), 0.3);
  EXPECT_DOUBLE_EQ(f.opacity(-1e300), 0.2);
  EXPECT_DOUBLE_EQ(f.opacity(1e300), 0.6);
  EXPECT_DOUBLE_EQ(f.extinction(1.25), -std::log(0.7) / 2.0);
  EXPECT_EQ(f.opacity(kNaN), 0.0);
  EXPECT_EQ(f.color(kNaN), glm::dvec3(0.0));
}

TEST(TransferFunction, CapsOpaqueExtinction) {
  const auto f = make({{0.0, 1.0}}, 4.0);
  EXPECT_EQ(f.extinction(0.0), TransferFunction::kMaxOpticalDepth / 4.0);
  const auto look = f.onIntervals(IntervalPartition::uniform(0.0, 1.0, 3));
  EXPECT_DOUBLE_EQ(look.extinction[1], TransferFunction::kMaxOpticalDepth / 4.0);
}

TEST(TransferFunction, IsTransparentWithoutPoints) {
  const auto f = make({});
  EXPECT_EQ(f.extinction(0.5), 0.0);
  EXPECT_TRUE(f.opacityPeaks().empty());
  for (const double e : f.onIntervals(IntervalPartition::uniform(0, 1, 4)).extinction)
    EXPECT_EQ(e, 0.0);
}

TEST(TransferFunction, TakesTwoPointsAtOneValueAsAJump) {
  const auto f = make({{0.0, 0.1}, {1.0, 0.1}, {1.0, 0.5}, {2.0, 0.5}}, 1.0);
  EXPECT_DOUBLE_EQ(f.opacity(std::nextafter(1.0, 0.0)), 0.1);
  EXPECT_DOUBLE_EQ(f.opacity(1.0), 0.5);
  const auto look = f.onIntervals(IntervalPartition::fromBounds({0.0, 1.0, 2.0}));
  EXPECT_NEAR(look.extinction[0], -std::log(0.9), 1e-15);
  EXPECT_NEAR(look.extinction[1], -std::log(0.5), 1e-15);
}

/// The mean over [low, high] by a midpoint rule that knows nothing of the pieces.
struct Means {
  double extinction = 0.0;
  glm::dvec3 color{0.0};
};
Means bruteForce(const TransferFunction& f, double low, double high) {
  constexpr int kSteps = 200000;
  Means m;
  for (int i = 0; i < kSteps; ++i) {
    const double v = std::lerp(low, high, (i + 0.5) / kSteps);
    const double e = f.extinction(v);
    m.extinction += e;
    m.color += e * f.color(v);
  }
  m.color /= m.extinction;
  m.extinction /= kSteps;
  return m;
}

TEST(TransferFunction, IntervalMeansEqualFineQuadrature) {
  std::mt19937_64 engine(11);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int trial = 0; trial < 12; ++trial) {
    std::vector<OpacityPoint> points;
    for (int i = 0; i < 2 + trial; ++i) {
      const double o = unit(engine);
      points.push_back({4.0 * unit(engine) - 1.0, trial % 3 == 0 && i == 1 ? 1.0 : o});
    }
    const TransferFunction f(points, 0.5, Colormap::named(trial % 2 ? "turbo" : "grey"), 0.0, 2.0);
    const auto p = IntervalPartition::uniform(-0.5, 2.5, 3);
    const auto look = f.onIntervals(p);
    for (int k = 0; k < 3; ++k) {
      const Means m = bruteForce(f, p.bounds()[k], p.bounds()[k + 1]);
      EXPECT_NEAR(look.extinction[k], m.extinction, 2e-4 * m.extinction);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(look.color[k][c], m.color[c], 2e-3);
    }
  }
}

TEST(TransferFunction, IntervalMeansHaveTheClosedForm) {
  // Mean of -ln(1 - o) for o from a to b: [u - u ln u] over u = 1 - o.
  const auto closed = [](double a, double b) {
    const auto primitive = [](double u) { return u - u * std::log(u); };
    return (primitive(1.0 - a) - primitive(1.0 - b)) / (b - a);
  };
  for (const auto& [a, b] : {std::pair(0.0, 0.9), {0.1, 0.5}, {0.5, 0.65}, {0.0, 0.3}}) {
    const auto f = make({{0.0, a}, {1.0, b}}, 1.0);
    EXPECT_NEAR(f.onIntervals(IntervalPartition::uniform(0, 1, 1)).extinction[0], closed(a, b),
                1e-12);
  }
  // A ramp to opacity 1: the primitive at 0 is 0, so the mean is 1, less what the cap cuts away.
  const auto f = make({{0.0, 0.0}, {1.0, 1.0}}, 1.0);
  EXPECT_NEAR(f.onIntervals(IntervalPartition::uniform(0, 1, 1)).extinction[0],
              1.0 - std::exp(-20.0), 1e-12);
}

TEST(TransferFunction, MeansOfMergedIntervalsAverage) {
  const auto f = make({{-1.0, 0.0}, {0.3, 0.99}, {0.4, 0.05}, {2.0, 1.0}, {2.9, 0.0}});
  const auto fine = f.onIntervals(IntervalPartition::uniform(-1.0, 3.0, 64));
  const auto coarse = f.onIntervals(IntervalPartition::uniform(-1.0, 3.0, 4));
  for (int k = 0; k < 4; ++k) {
    double sum = 0.0;
    glm::dvec3 color(0.0);
    for (int i = 16 * k; i < 16 * (k + 1); ++i) {
      sum += fine.extinction[i];
      color += fine.extinction[i] * fine.color[i];
    }
    EXPECT_NEAR(coarse.extinction[k], sum / 16.0, 1e-12 * (1.0 + sum));
    EXPECT_NEAR(glm::length(coarse.color[k] - color / sum), 0.0, 2e-3);
  }
}

TEST(TransferFunction, ConstantOpacityIsExactInEveryChannel) {
  const auto f = make({{5.0, 0.75}}, 3.0);
  const auto p = IntervalPartition::uniform(-1.0, 3.0, 5);
  const auto look = f.onIntervals(p);
  for (int c = 0; c < p.noData(); ++c)
    EXPECT_NEAR(look.extinction[c], -std::log(0.25) / 3.0, 1e-15);
  EXPECT_EQ(look.extinction[p.noData()], 0.0);
  EXPECT_EQ(look.color[p.below()], f.color(-1.0));
  EXPECT_EQ(look.color[p.above()], f.color(3.0));
}

TEST(TransferFunction, BelowAndAboveTakeTheValuesAtTheOuterBounds) {
  const auto f = make({{0.0, 0.1}, {4.0, 0.9}});
  const auto p = IntervalPartition::uniform(1.0, 3.0, 2);
  const auto look = f.onIntervals(p);
  EXPECT_EQ(look.extinction[p.below()], f.extinction(1.0));
  EXPECT_EQ(look.extinction[p.above()], f.extinction(3.0));
}

TEST(TransferFunction, FactorsScaleIntervalsAndNothingElse) {
  auto f = make({{-1.0, 0.2}, {3.0, 0.7}});
  const auto p = IntervalPartition::uniform(-1.0, 3.0, 3);
  const auto before = f.onIntervals(p);
  f.setFactors({0.0, 1.0, 2.5});
  const auto after = f.onIntervals(p);
  EXPECT_EQ(after.extinction[0], 0.0);
  EXPECT_EQ(after.extinction[1], before.extinction[1]);
  EXPECT_DOUBLE_EQ(after.extinction[2], 2.5 * before.extinction[2]);
  EXPECT_EQ(after.extinction[p.below()], before.extinction[p.below()]);
  EXPECT_EQ(after.color[2], before.color[2]);
  EXPECT_THROW(f.onIntervals(IntervalPartition::uniform(0, 1, 4)), Error);
  EXPECT_THROW(f.setFactors({-1.0}), Error);
  EXPECT_THROW(f.setFactors({kNaN}), Error);
  EXPECT_THROW(f.setFactors(std::vector<double>(65, 1.0)), Error);
}

TEST(TransferFunction, TransparentIntervalsHaveTheirPlainMeanColour) {
  const TransferFunction f({{0.0, 0.0}}, 1.0, Colormap::fromSrgb("red", {{1, 0, 0}}), 0.0, 1.0);
  const auto look = f.onIntervals(IntervalPartition::uniform(0.0, 1.0, 2));
  EXPECT_NEAR(glm::length(look.color[0] - glm::dvec3(1, 0, 0)), 0.0, 1e-14);
}

TEST(TransferFunction, PeaksAreLocalMaximaAndMiddlesOfPlateaus) {
  EXPECT_EQ(make({{0, 0}, {1, 0.5}, {2, 0.1}, {3, 0.8}, {4, 0.8}, {5, 0}}).opacityPeaks(),
            (std::vector<double>{1.0, 3.5}));
  EXPECT_EQ(make({{0, 0.5}, {1, 0.1}, {2, 0.3}}).opacityPeaks(), (std::vector<double>{0.0, 2.0}));
  EXPECT_EQ(make({{0, 0.1}, {1, 0.2}, {2, 0.2}, {3, 0.3}}).opacityPeaks(),
            (std::vector<double>{3.0}));
  EXPECT_TRUE(make({{0, 0}, {1, 0}}).opacityPeaks().empty());
}

TEST(TransferFunction, RampHidesTheLowerQuarter) {
  const auto f = TransferFunction::ramp(100.0, 200.0, 1.0);
  EXPECT_EQ(f.opacity(125.0), 0.0);
  EXPECT_GT(f.opacity(126.0), 0.0);
  EXPECT_GT(f.opacity(200.0), f.opacity(150.0));
  EXPECT_EQ(f.colorLow(), 100.0);
  EXPECT_NO_THROW(
      TransferFunction::ramp(7.0, 7.0, 1.0).onIntervals(IntervalPartition::uniform(7.0, 7.0, 16)));
}

TEST(TransferFunction, ColoursAFlatRangeByItsSides) {
  const TransferFunction f({}, 1.0, Colormap::named("grey"), 2.0, 2.0);
  EXPECT_EQ(f.color(1.9), glm::dvec3(0.0));
  EXPECT_EQ(f.color(2.1), glm::dvec3(1.0));
}

TEST(TransferFunction, RefusesArgumentsOutOfRange) {
  EXPECT_THROW(make({{kNaN, 0.0}}), Error);
  EXPECT_THROW(make({{0.0, kNaN}}), Error);
  EXPECT_THROW(make({{0.0, 1.0001}}), Error);
  EXPECT_THROW(make({{0.0, -0.1}}), Error);
  EXPECT_THROW(make({{0, 0}, {0, 0.1}, {0, 0.2}}), Error);
  EXPECT_THROW(make({}, 0.0), Error);
  EXPECT_THROW(make({}, kNaN), Error);
  EXPECT_THROW(make(std::vector<OpacityPoint>(10001)), Error);
  EXPECT_THROW(make({}).setColorRange(1.0, 0.0), Error);
  EXPECT_THROW(make({}).setColorRange(0.0, kNaN), Error);
}

TEST(TransferFunction, SurvivesJson) {
  auto f = make({{101324.99, 0.1}, {101325.01, 1.0 / 3.0}}, 0.1);
  f.setFactors({1.0, 0.0, 2.0});
  for (const Colormap& map : {Colormap::named("inferno_r"), Colormap::fromSrgb("x", {{0, 0.1, 1}}),
                              Colormap::fromSrgb("viridis", {{0, 0, 0}, {1, 1, 1}})}) {
    f.setColormap(map);
    const auto g = transferFunctionFromJson(json::parse(toJson(f).dump()));
    EXPECT_EQ(g.opacityPoints(), f.opacityPoints());
    EXPECT_EQ(g.referenceLength(), f.referenceLength());
    EXPECT_EQ(g.colormap().srgbColors(), f.colormap().srgbColors());
    EXPECT_EQ(g.colorLow(), f.colorLow());
    EXPECT_EQ(g.colorHigh(), f.colorHigh());
    EXPECT_EQ(g.factors(), f.factors());
    EXPECT_EQ(toJson(g), toJson(f));
  }
}

json valid() { return toJson(make({{0.0, 0.5}, {1.0, 0.25}})); }

TEST(TransferFunction, SortsPointsOfJson) {
  json j = valid();
  j["opacity"] = {{3.0, 0.3}, {1.0, 0.1}, {2.0, 0.2}};
  const auto f = transferFunctionFromJson(j);
  EXPECT_EQ(f.opacityPoints(), (std::vector<OpacityPoint>{{1, 0.1}, {2, 0.2}, {3, 0.3}}));
}

void expectRefused(const json& j, const std::string& key) {
  try {
    transferFunctionFromJson(j);
    ADD_FAILURE() << "accepted a bad " << key;
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::Config) << e.what();
    EXPECT_NE(std::string(e.what()).find(key), std::string::npos) << e.what();
    EXPECT_LT(std::string(e.what()).size(), 400u);
  }
}

TEST(TransferFunction, NamesTheKeyThatHostileJsonSpoils) {
  const json junk[] = {nullptr,
                       true,
                       "x",
                       1e6,
                       -1,
                       json::array(),
                       json::object(),
                       {1, 2, 3},
                       {{1, "2"}},
                       {{kNaN, 0.5}},
                       {{0.5, kNaN}},
                       {{0.5, 1.5}},
                       {{1.0}},
                       {{0, 0}, {0, 0.5}, {0, 1}},
                       std::string(100000, 'x')};
  for (const char* key : {"opacity", "referenceLength", "colormap", "colorRange", "factors"})
    for (const json& value : junk) {
      const bool sound =
          (std::string(key) == "opacity" && value == json::array()) ||
          (std::string(key) == "factors" && (value == json::array() || value == json({1, 2, 3}))) ||
          (std::string(key) == "referenceLength" && value == json(1e6));
      json j = valid();
      j[key] = value;
      if (sound)
        EXPECT_NO_THROW(transferFunctionFromJson(j)) << key << value;
      else
        expectRefused(j, key);
    }
  for (const char* key : {"opacity", "referenceLength", "colormap", "colorRange"}) {
    json j = valid();
    j.erase(key);
    expectRefused(j, key);
  }
}

TEST(TransferFunction, RefusesJsonThatIsTooMuch) {
  json j = valid();
  for (int i = 0; i < 10001; ++i) j["opacity"].push_back({i, 0.5});
  expectRefused(j, "opacity");
  j = valid();
  j["colormap"] = json(std::vector<std::vector<int>>(4097, {0, 0, 0}));
  expectRefused(j, "colormap");
  j = valid();
  j["factors"] = std::vector<int>(65, 1);
  expectRefused(j, "factors");
  j = valid();
  j["opactiy"] = 1;
  expectRefused(j, "opactiy");
  j = valid();
  j["factors"] = {1, -2};
  expectRefused(j, "factors");
  j = valid();
  j["colorRange"] = {2, 1};
  expectRefused(j, "colorRange");
  j = valid();
  j["colormap"] = {{0, 0, 2}};
  expectRefused(j, "2");
  expectRefused(json::array(), "list");
  j = valid();
  std::string deep(200000, '[');
  deep += std::string(200000, ']');
  j["opacity"] = json::parse(deep);
  expectRefused(j, "opacity");
}

TEST(TransferFunction, ReadsOpacityFromText) {
  EXPECT_EQ(opacityFromText("0:0, 1e3:0.5,-2.5:+1"),
            (std::vector<OpacityPoint>{{0, 0}, {1000, 0.5}, {-2.5, 1}}));
  for (const auto& [text, piece] : {std::pair("", "''"),
                                    {"1:0,", "''"},
                                    {"1:0,x:1", "'x:1'"},
                                    {"1:2", "'1:2'"},
                                    {"5", "'5'"},
                                    {"1:0.5:2", "'1:0.5:2'"},
                                    {"nan:1", "'nan:1'"},
                                    {"1:inf", "'1:inf'"},
                                    {"1;2", "'1;2'"},
                                    {"1,5:0", "'1'"},
                                    {"1:-0.1", "'1:-0.1'"}}) {
    try {
      opacityFromText(text);
      ADD_FAILURE() << text;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::Config);
      EXPECT_NE(std::string(e.what()).find(piece), std::string::npos) << e.what();
    }
  }
  std::string many = "0:0";
  for (int i = 0; i < 10000; ++i) many += ",1:1";
  EXPECT_THROW(opacityFromText(many), Error);
}

}  // namespace
}  // namespace vestige
