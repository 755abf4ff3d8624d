// SPDX-License-Identifier: BSD-3-Clause
//
// Ranges over the steps of a run, and values that stand for no data, through a session.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "proxy/archive/archive.h"
#include "simulation.h"

namespace vestige::test {
namespace {

/// Few proxies, so that tests are quick.
const std::string kFew = std::string(kSmallImage) + "proxies = ['length', 'reference']\n";
const std::string kAppend = kFew + "[output]\nexisting = 'append'\n";

ProxyHeader headerAt(const std::string& path, long cycle, const std::string& field = "f",
                     std::string_view proxy = kind::kLength) {
  const Archive archive(path);
  const ArchiveRow* row = archive.find(cycle, "front", field, proxy);
  if (!row) throw std::runtime_error("no " + field + " at cycle " + std::to_string(cycle));
  return archive.open(*row).header();
}

IntervalPartition intervalsAt(const std::string& path, long cycle, const std::string& field = "f") {
  return headerAt(path, cycle, field).partition.value();
}

/// The largest opacity of the reference picture: 0 = it is black.
float mostOpacity(const std::string& path, long cycle) {
  const Archive archive(path);
  const auto image = archive.open(*archive.find(cycle, "front", "f", kind::kReference)).image();
  const auto& alpha = image.channel("reference", "A").values;
  return *std::max_element(alpha.begin(), alpha.end());
}

Sample constant(float value) {
  Sample sample({12, 10, 8});
  std::fill(sample.values.begin(), sample.values.end(), value);
  return sample;
}

/// The usual sample, times a factor.
Sample waves(float factor = 1.0f) {
  Sample sample({12, 10, 8});
  for (float& value : sample.values) value *= factor;
  return sample;
}

std::pair<double, double> rangeOf(const Sample& sample) {
  const auto [low, high] = std::minmax_element(sample.values.begin(), sample.values.end());
  return {*low, *high};
}

std::pair<double, double> endsOf(const IntervalPartition& intervals) {
  return {intervals.low(), intervals.high()};
}

long lines(const Simulation& run, const std::string& part) {
  return std::count_if(run.log.begin(), run.log.end(), [&](const std::string& line) {
    return line.find(part) != std::string::npos;
  });
}

TEST(RangeSession, AFirstStepThatDoesNotVarySettlesNothing) {
  const Folder folder;
  int number = 0;
  const float kNone = std::numeric_limits<float>::quiet_NaN();
  for (const auto& [how, first] : std::vector<std::pair<std::string, float>>{
           {"", 0.0f},
           {"", 1e20f},
           {"", kNone},
           {"quantiles = true\n", 7.0f},
           {"isovalues = 'bounds'\nintervals = 5\n", 0.0f}}) {
    const std::string path = folder / std::to_string(number++);
    Simulation run(path, kFew + "[[field]]\nsource = 'f'\n" + how);
    ASSERT_EQ(run.step(constant(first), 0), VESTIGE_OK) << run.error();
    ASSERT_EQ(run.step(constant(first), 1), VESTIGE_OK) << run.error();
    ASSERT_EQ(run.step(waves(1000.0f), 2), VESTIGE_OK) << run.error();
    ASSERT_EQ(run.step(waves(900.0f), 3), VESTIGE_OK) << run.error();
    EXPECT_EQ(cyclesOf(path), (std::vector<long>{0, 1, 2, 3})) << "all are stored";
    EXPECT_EQ(endsOf(intervalsAt(path, 2)), rangeOf(waves(1000.0f)));
    EXPECT_EQ(intervalsAt(path, 3), intervalsAt(path, 2)) << "from then on it is settled";
    EXPECT_GT(mostOpacity(path, 2), 0.1f);
    EXPECT_EQ(lines(run, "its intervals are those of the first step at which it varies"), 1);
    EXPECT_EQ(lines(run, "outside of its intervals"), 0);
    EXPECT_EQ(damageOf(path), "");
  }
}

TEST(RangeSession, EachFieldSettlesForItself) {
  const Folder folder;
  const std::string path = folder / "a.cdb";
  Simulation run(path, kFew);
  const auto step = [&](const Sample& f, const Sample& g, std::int64_t cycle) {
    vestige_block(run.session, 0, &f.grid);
    vestige_share_field(run.session, 0, "f", VESTIGE_FLOAT32, VESTIGE_POINT, 1, f.values.data(),
                        nullptr);
    vestige_share_field(run.session, 0, "g", VESTIGE_FLOAT32, VESTIGE_POINT, 1, g.values.data(),
                        nullptr);
    ASSERT_EQ(vestige_execute(run.session, cycle, double(cycle)), VESTIGE_OK) << run.error();
  };
  step(waves(), constant(0.0f), 0);
  step(waves(0.5f), waves(20.0f), 1);
  step(waves(0.5f), waves(10.0f), 2);
  for (const long cycle : {0, 1, 2}) EXPECT_EQ(endsOf(intervalsAt(path, cycle)), rangeOf(waves()));
  for (const long cycle : {1, 2})
    EXPECT_EQ(endsOf(intervalsAt(path, cycle, "g")), rangeOf(waves(20.0f)));
}

TEST(RangeSession, IntervalsThatDataOutgrowAreWidenedWithAWarning) {
  const Folder folder;
  const std::string path = folder / "a.cdb";
  Simulation run(path, kFew);
  ASSERT_EQ(run.step(waves(1e-6f), 0), VESTIGE_OK) << run.error();
  ASSERT_EQ(run.step(waves(1000.0f), 10), VESTIGE_OK) << run.error();
  ASSERT_EQ(run.step(waves(700.0f), 20), VESTIGE_OK) << run.error();
  const auto wide = intervalsAt(path, 10);
  EXPECT_EQ(endsOf(wide), rangeOf(waves(1000.0f)));
  EXPECT_EQ(intervalsAt(path, 20), wide) << "and stay";
  EXPECT_EQ(wide.intervals(), 16);
  EXPECT_GT(mostOpacity(path, 10), 0.1f);
  EXPECT_EQ(headerAt(path, 10).statistics.shareOutside(), 0.0);
  // One warning with how much, where, what range the data have, and what to do.
  EXPECT_EQ(lines(run, "outside of its intervals"), 1);
  EXPECT_TRUE(run.logged("warning: field 'f': "));
  EXPECT_TRUE(run.logged("% of the samples at cycle 10 are outside"));
  EXPECT_TRUE(run.logged("From now on the intervals are"));
  EXPECT_TRUE(run.logged("range = [low, high] in its [[field]]"));
}

TEST(RangeSession, DataThatGrowSteadilyWidenIntervalsNowAndThen) {
  const Folder folder;
  const std::string path = folder / "a.cdb";
  Simulation run(path, kFew);
  std::vector<std::pair<double, double>> ends;
  for (long cycle = 0; cycle < 12; ++cycle) {
    const Sample sample = waves(std::pow(1.1f, float(cycle)));
    ASSERT_EQ(run.step(sample, cycle), VESTIGE_OK) << run.error();
    ends.push_back(endsOf(intervalsAt(path, cycle)));
    // No step has more than a percent outside.
    EXPECT_LE(headerAt(path, cycle).statistics.shareOutside(), 0.01);
  }
  // 2.9 times as large in the end; each widening is by a quarter and more.
  const auto changes = std::unique(ends.begin(), ends.end()) - ends.begin();
  EXPECT_GE(changes, 3);
  EXPECT_LE(changes, 6);
  EXPECT_EQ(lines(run, "warning: field 'f'"), 1);
}

TEST(RangeSession, ASpikeWidensNothingWhatIsSmallAndFarDoes) {
  const Folder folder;
  const std::string path = folder / "a.cdb";
  Simulation run(path, kFew);
  Sample calm, spike;
  spike.values[1000] = 1e6f;  // one of 7680
  ASSERT_EQ(run.step(calm, 0), VESTIGE_OK) << run.error();
  ASSERT_EQ(run.step(spike, 1), VESTIGE_OK) << run.error();
  EXPECT_EQ(intervalsAt(path, 1), intervalsAt(path, 0));
  EXPECT_EQ(headerAt(path, 1).statistics.above, 1u);
  EXPECT_EQ(lines(run, "outside of its intervals"), 0);
  // A flame of two thousandths is what the run is about.
  Sample flame;
  std::fill_n(flame.values.begin() + 3000, 15, 50.0f);
  ASSERT_EQ(run.step(flame, 2), VESTIGE_OK) << run.error();
  EXPECT_EQ(intervalsAt(path, 2).high(), 50.0);
  EXPECT_EQ(intervalsAt(path, 2).low(), intervalsAt(path, 0).low());
  EXPECT_EQ(lines(run, "outside of its intervals"), 1);
}

TEST(RangeSession, ConfiguredIntervalsStayAndTheWarningComesAgainWhenItIsMuchWorse) {
  const Folder folder;
  for (const std::string& given :
       std::vector<std::string>{"range = [-0.5, 2.2]\n", "bounds = [-0.5, 0, 2.2]\n"}) {
    const std::string path = folder / given.substr(0, 3);
    Simulation run(path, kFew + "[[field]]\nsource = 'f'\n" + given);
    ASSERT_EQ(run.step(waves(0.65f), 0), VESTIGE_OK) << run.error();
    EXPECT_GT(headerAt(path, 0).statistics.shareOutside(), 0.0);
    EXPECT_LT(headerAt(path, 0).statistics.shareOutside(), 0.08);
    ASSERT_EQ(run.step(waves(0.66f), 1), VESTIGE_OK) << run.error();
    EXPECT_EQ(lines(run, "outside of its intervals, -0.5 to 2.2"), 1);
    ASSERT_EQ(run.step(waves(1e4f), 2), VESTIGE_OK) << run.error();
    ASSERT_EQ(run.step(waves(2e4f), 3), VESTIGE_OK) << run.error();
    EXPECT_EQ(lines(run, "outside of its intervals, -0.5 to 2.2"), 2);
    EXPECT_TRUE(run.logged(given.substr(0, given.find(' ')) + " in its [[field]] says what is"));
    EXPECT_EQ(endsOf(intervalsAt(path, 3)), std::pair(-0.5, 2.2));
  }
}

TEST(RangeSession, ARestartGoesOnWithWhatWasSettledLast) {
  const Folder folder;
  const std::string path = folder / "a.cdb";
  {
    Simulation run(path, kAppend);
    ASSERT_EQ(run.step(constant(0.0f), 0), VESTIGE_OK) << run.error();
  }
  {
    Simulation run(path, kAppend);  // nothing is settled yet
    ASSERT_EQ(run.step(waves(10.0f), 1), VESTIGE_OK) << run.error();
    ASSERT_EQ(run.step(waves(100.0f), 2), VESTIGE_OK) << run.error();
    ASSERT_EQ(run.step(constant(1.0f), 3), VESTIGE_OK) << run.error();
  }
  {
    Simulation run(path, kAppend);
    ASSERT_EQ(run.step(waves(5.0f), 4), VESTIGE_OK) << run.error();
  }
  EXPECT_EQ(endsOf(intervalsAt(path, 1)), rangeOf(waves(10.0f)));
  EXPECT_EQ(endsOf(intervalsAt(path, 2)), rangeOf(waves(100.0f)));
  EXPECT_EQ(intervalsAt(path, 4), intervalsAt(path, 2));
  // Another number of intervals is a new start, which is settled, too.
  Simulation run(path, kAppend + "[[field]]\nsource = 'f'\nintervals = 4\n");
  ASSERT_EQ(run.step(waves(5.0f), 5), VESTIGE_OK) << run.error();
  ASSERT_EQ(run.step(waves(4.0f), 6), VESTIGE_OK) << run.error();
  EXPECT_EQ(endsOf(intervalsAt(path, 5)), rangeOf(waves(5.0f)));
  EXPECT_EQ(intervalsAt(path, 6), intervalsAt(path, 5));
}

TEST(RangeSession, AClassifierSettlesWhenAllOfItsFieldsVary) {
  const Folder folder;
  const std::string path = folder / "a.cdb";
  const std::string config = std::string(kSmallImage) + "[output]\nexisting = 'append'\n" + R"(
[[classifier]]
kind = "gaussian"
fields = ["f"]
[[classifier.primitives]]
name = "all"
fit = { low = [0, 0, 0], high = [1, 1, 1] }
)";
  const auto center = [&](long cycle) {
    const auto features = headerAt(path, cycle, "features", kind::kFeatures).features.value();
    return toJson(features)["classifier"]["primitives"][0]["center"][0].get<double>();
  };
  {
    Simulation run(path, config);
    ASSERT_EQ(run.step(constant(5.0f), 0), VESTIGE_OK) << run.error();
  }
  Simulation run(path, config);
  ASSERT_EQ(run.step(waves(), 1), VESTIGE_OK) << run.error();
  ASSERT_EQ(run.step(waves(3.0f), 2), VESTIGE_OK) << run.error();
  EXPECT_NEAR(center(0), 5.0, 1e-12);
  EXPECT_LT(center(1), 2.0);
  EXPECT_EQ(center(2), center(1));
  EXPECT_EQ(damageOf(path), "");
}

TEST(FillValues, AreNoDataInEveryProxy) {
  const Folder folder;
  Sample filled = waves(), masked = waves();
  for (std::size_t i = 0; i < filled.values.size(); i += 7) {
    filled.values[i] = i % 2 ? 1e20f : -9999.0f;
    masked.values[i] = std::nanf("");
  }
  const std::string config =
      std::string(kSmallImage) +
      "proxies = ['attenuation', 'length', 'depth', 'mip', 'reference', 'layered', 'sliced', "
      "'field', 'training', 'features', 'sliced-features']\n"
      "[[classifier]]\nkind = 'gaussian'\nfields = ['f']\n"
      "[[field]]\nsource = 'f'\n";
  {
    Simulation run(folder / "fill.cdb", config + "no_data = [1e20, [-1e5, -9000]]\n");
    ASSERT_EQ(run.step(filled, 0), VESTIGE_OK) << run.error();
    EXPECT_TRUE(run.logged("138 samples of 960 without data"));
    EXPECT_EQ(lines(run, "far from the others"), 0);
  }
  {
    Simulation run(folder / "nan.cdb", config);
    ASSERT_EQ(run.step(masked, 0), VESTIGE_OK) << run.error();
  }
  EXPECT_EQ(filesOf(folder / "fill.cdb"), filesOf(folder / "nan.cdb"));
}

TEST(FillValues, ThatNobodyNamedAreSuspected) {
  const Folder folder;
  int number = 0;
  const auto warned = [&](const Sample& sample, const std::string& expected) {
    Simulation run(folder / std::to_string(number++), kFew);
    EXPECT_EQ(run.step(sample, 0), VESTIGE_OK) << run.error();
    EXPECT_EQ(run.step(sample, 1), VESTIGE_OK) << run.error();
    EXPECT_EQ(lines(run, "far from the others"), expected.empty() ? 0 : 1) << expected;
    EXPECT_TRUE(run.logged(expected)) << expected;
  };
  const auto with = [&](float value, std::size_t every) {
    Sample sample = waves();
    for (std::size_t i = 0; i < sample.values.size(); i += every) sample.values[i] = value;
    return sample;
  };
  warned(with(1e20f, 10), "10 % of the samples are exactly 1e+20, far from the others (-");
  warned(with(-9999.0f, 20), "no_data = [-9999] in its [[field]]");
  warned(with(9.96921e36f, 20), "no_data = [9.96921e+36]");
  warned(with(-3.4028235e38f, 20), "no_data = [-3.4028235e+38]");
  warned(with(-12345678.0f, 20), "no_data = [-12345678");
  // A few, values that data may well have, and fields that say nothing else.
  warned(with(1e20f, 150), "");
  warned(with(2.0f, 3), "");
  warned(with(30.0f, 3), "");
  warned(constant(1e20f), "");
  Sample two = constant(20.0f);
  std::fill_n(two.values.begin(), 100, 100.0f);
  warned(two, "");
}

/// Two fields of doubles on the usual grid; what execute returns.
int stepOf(Simulation& run, const Sample& sample, const std::vector<double>& f,
           const std::vector<double>& g, std::int64_t cycle) {
  vestige_block(run.session, 0, &sample.grid);
  for (const auto& [name, values] : {std::pair("f", &f), std::pair("g", &g)})
    vestige_share_field(run.session, 0, name, VESTIGE_FLOAT64, VESTIGE_POINT, 1, values->data(),
                        nullptr);
  return vestige_execute(run.session, cycle, double(cycle));
}

std::vector<double> doublesOf(const Sample& sample, double factor) {
  std::vector<double> values(sample.values.begin(), sample.values.end());
  for (double& value : values) value *= factor;
  return values;
}

TEST(RangeSession, AFieldWiderThanADoubleIsLeftOutAndTheOthersAreStored) {
  const Folder folder;
  const std::string path = folder / "a.cdb";
  const std::string withClassifier =
      "[image]\nwidth = 48\nheight = 40\nproxies = ['length', 'mip', 'field', 'features']\n"
      "[trigger]\nchange = { field = 'g', measure = 'mean', threshold = 0.25 }\n"
      "[[classifier]]\nname = 'both'\nkind = 'gaussian'\nfields = ['f', 'g']\n";
  Simulation run(path, withClassifier);
  const Sample sample = waves();
  const auto [low, high] = rangeOf(sample);
  const std::vector<double> f = doublesOf(sample, 1.0);
  std::vector<double> wide = f;
  for (double& value : wide) value = ((value - low) / (high - low) - 0.5) * 2.0 * 1.2e308;
  ASSERT_EQ(stepOf(run, sample, f, wide, 0), VESTIGE_OK) << run.error();
  EXPECT_EQ(lines(run,
                  "cycle 0 is stored without 'both', 'g': field 'g' has values from -1.2e+308 "
                  "to 1.2e+308"),
            1);
  ASSERT_EQ(stepOf(run, sample, f, doublesOf(sample, 3.0), 1), VESTIGE_OK) << run.error();
  const Archive archive(path);
  EXPECT_TRUE(archive.find(0, "front", "f", kind::kLength));
  EXPECT_FALSE(archive.find(0, "front", "g", kind::kLength));
  EXPECT_FALSE(archive.find(0, "front", "both", kind::kFeatures));
  EXPECT_TRUE(archive.find(1, "front", "g", kind::kLength)) << "the next step is whole again";
  EXPECT_TRUE(archive.find(1, "front", "both", kind::kFeatures));
  EXPECT_EQ(damageOf(path), "");
  Simulation other(folder / "b.cdb", kFew);
  EXPECT_EQ(stepOf(other, sample, wide, wide, 0), VESTIGE_ERROR_FIELD) << "nothing is left";
  EXPECT_NE(other.error().find("'f' has values from -1.2e+308"), std::string::npos)
      << other.error();
}

TEST(RangeSession, ValuesUpToTheLargestDoubleAreStored) {
  const Folder folder;
  const std::string path = folder / "a.cdb";
  Simulation run(path, kFew + "[[field]]\nsource = 'f'\n[[field]]\nsource = 'g'\n");
  const Sample sample = waves();
  const auto [low, high] = rangeOf(sample);
  std::vector<double> f, constant(sample.values.size(), 1.7e308);
  for (const float value : sample.values)
    f.push_back(((double(value) - low) / (high - low) - 0.5) * 1.7e308);
  ASSERT_EQ(stepOf(run, sample, f, constant, 0), VESTIGE_OK) << run.error();
  EXPECT_EQ(endsOf(intervalsAt(path, 0)), std::pair(-0.85e308, 0.85e308));
  EXPECT_EQ(headerAt(path, 0, "g").statistics.mean, 1.7e308);
  EXPECT_GT(mostOpacity(path, 0), 0.1f);
  // Intervals cannot be widened to what no double is wide.
  for (double& value : f) value += 0.8e308;
  ASSERT_EQ(stepOf(run, sample, f, constant, 1), VESTIGE_OK) << run.error();
  EXPECT_EQ(damageOf(path), "");
}

TEST(RangeSession, ValuesFarBeyondAGivenRangeAreAboveItAndNotWithoutData) {
  const Folder folder;
  Simulation run(folder / "a.cdb", kFew + "[[field]]\nsource = 'f'\nrange = [0, 1]\n");
  const Sample sample = waves();
  const std::vector<double> f(sample.values.size(), 1e300);
  ASSERT_EQ(stepOf(run, sample, f, f, 0), VESTIGE_OK) << run.error();
  const Archive archive(folder / "a.cdb");
  const auto image = archive.open(*archive.find(0, "front", "f", kind::kLength)).image();
  const auto& above = image.channel("length", "above").values;
  EXPECT_GT(*std::max_element(above.begin(), above.end()), 0.5f);
}

}  // namespace
}  // namespace vestige::test
