// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/config/config.h"

#include <gtest/gtest.h>

#include <numbers>

#include "adaptor/config/config_reader.h"
#include "adaptor/plan/classification.h"
#include "adaptor/plan/views.h"
#include "proxy/base/error.h"
#include "proxy/base/nearest_word.h"

namespace vestige {
namespace {

void expectError(const std::string& text, const std::string& expected) {
  try {
    configFromText(text, "run.toml");
    ADD_FAILURE() << "no error in: " << text;
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::Config);
    EXPECT_NE(std::string(error.what()).find(expected), std::string::npos)
        << error.what() << "\nexpected " << expected;
  }
}

TEST(Config, EmptyTextGivesTheDefaults) {
  const Config config = configFromText("", "run.toml");
  EXPECT_EQ(config.output, "vestige.cdb");
  EXPECT_EQ(config.existing, ExistingArchive::Refuse);
  EXPECT_EQ(config.size, (ImageSize{512, 512}));
  EXPECT_TRUE(config.attenuation && config.length && config.depth && config.mip &&
              config.reference);
  EXPECT_TRUE(config.fields.empty() && config.views.empty());
  EXPECT_FALSE(config.dryRun);
}

TEST(Config, ReadsEveryKey) {
  const Config config = configFromText(R"(
dry_run = true
[output]
path = "a.cdb"
existing = "append"
background = [1, 0.5, 0]
note = "a note"
[gl]
backend = "egl"
threads = 3
[image]
width = 640
height = 480
proxies = ["length", "depth"]
phong = true
step_length = 0.5
reference_length = 2
[trigger]
every_cycles = 10
every_time = 0.25
change = { field = "t", measure = "histogram", threshold = 0.1, every_cycles = 5 }
[[view]]
set = "axes"
[[view]]
name = "close"
projection = "perspective"
field_of_view = 90
position = [0, -5, 0]
target = [0, 0, 0]
up = [0, 0, 1]
near = 0.5
far = 20
[[field]]
name = "speed"
source = "velocity"
magnitude = true
gradient = true
units = "m/s"
range = [0, 1]
intervals = 8
opacity = [[0, 0], [0.5, 0.75], [1.0, 0]]
colormap = "inferno"
color_range = [0, 2]
isovalues = [0.25, 0.5]
[[field]]
source = "t"
component = 2
range = "each-step"
quantiles = true
isovalues = "even"
isovalue_count = 3
[[field]]
source = "p"
bounds = [0, 1, 4]
isovalues = "bounds"
)",
                                       "run.toml");
  EXPECT_TRUE(config.dryRun);
  EXPECT_EQ(config.output, "a.cdb");
  EXPECT_EQ(config.existing, ExistingArchive::Append);
  EXPECT_EQ(config.background, glm::dvec3(1.0, 0.5, 0.0));
  EXPECT_EQ(config.note, "a note");
  EXPECT_EQ(config.glBackend, "egl");
  EXPECT_EQ(config.threads, 3);
  EXPECT_EQ(config.size, (ImageSize{640, 480}));
  EXPECT_TRUE(config.length && config.depth && config.phong);
  EXPECT_FALSE(config.attenuation || config.mip || config.reference);
  EXPECT_EQ(config.stepLength, 0.5);
  EXPECT_EQ(config.referenceLength, 2.0);
  EXPECT_EQ(config.trigger.everyCycles, 10);
  EXPECT_EQ(config.trigger.everyTime, 0.25);
  ASSERT_TRUE(config.trigger.change);
  EXPECT_EQ(config.trigger.change->measure, TriggerConfig::Measure::Histogram);
  EXPECT_EQ(config.trigger.change->everyCycles, 5);
  ASSERT_EQ(config.views.size(), 2u);
  EXPECT_NEAR(config.views[1].fieldOfView, std::numbers::pi / 2, 1e-12);
  ASSERT_EQ(config.fields.size(), 3u);
  EXPECT_EQ(config.fields[0].name, "speed");
  EXPECT_TRUE(config.fields[0].magnitude && config.fields[0].gradient);
  EXPECT_EQ(config.fields[0].range, FieldConfig::Range::Fixed);
  EXPECT_EQ(config.fields[0].opacity[1], (OpacityPoint{0.5, 0.75}));
  EXPECT_EQ(config.fields[0].isovalues, (std::vector<double>{0.25, 0.5}));
  EXPECT_EQ(config.fields[1].component, 2);
  EXPECT_EQ(config.fields[1].range, FieldConfig::Range::EachStep);
  EXPECT_TRUE(config.fields[1].quantiles);
  EXPECT_EQ(config.fields[2].bounds, (std::vector<double>{0, 1, 4}));
  EXPECT_EQ(config.fields[2].isovalueRule, FieldConfig::Isovalues::Bounds);
}

TEST(Config, TheGuidesExampleParses) {
  const std::string guide = readTextFile(VESTIGE_SOURCE_DIR "/docs/for-simulation-developers.md");
  const std::string fence = "```toml\n";
  const auto start = guide.find(fence);
  ASSERT_NE(start, std::string::npos);
  const auto text =
      guide.substr(start + fence.size(), guide.find("```\n", start + 1) - start - fence.size());
  const Config config = configFromText(text, "guide");
  EXPECT_EQ(config.fields.size(), 2u);
  EXPECT_EQ(config.trigger.everyCycles, 50);
}

TEST(Config, TheGuidesClassifierParses) {
  const std::string guide = readTextFile(VESTIGE_SOURCE_DIR "/docs/for-simulation-developers.md");
  const auto start = guide.find("[image]\nproxies = [\"features\"");
  ASSERT_NE(start, std::string::npos);
  const auto text = guide.substr(start, guide.find("```\n", start) - start);
  const Config config = configFromText(text, "guide");
  ASSERT_EQ(config.classifiers.size(), 1u);
  EXPECT_EQ(config.classifiers[0].fits.size(), 1u);
}

TEST(Config, TheGuideNamesEveryKeyThatIsKnown) {
  const std::string guide = readTextFile(VESTIGE_SOURCE_DIR "/docs/for-simulation-developers.md");
  // An unknown key without a near one lists all keys of its table.
  for (const std::string table : {"", "[output]\n", "[gl]\n", "[image]\n", "[trigger]\n",
                                  "[[view]]\nset = 'front'\n", "[[field]]\nsource = 'f'\n"}) {
    try {
      configFromText(table + "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx = 1\n", "guide");
      ADD_FAILURE() << table;
    } catch (const Error& error) {
      std::string keys = error.what();
      keys = keys.substr(keys.find("known are ") + 10) + ", ";
      for (std::size_t at = 0; at < keys.size();) {
        const auto end = keys.find(", ", at);
        const auto key = keys.substr(at, end - at);
        EXPECT_NE(guide.find(key), std::string::npos) << table << key;
        if (!table.empty()) {
          EXPECT_NE(guide.find("`" + key + "`"), std::string::npos) << table << key;
        }
        at = end + 2;
      }
    }
  }
}

TEST(Config, NamesFileLineAndKey) {
  expectError("[image]\nwidth = 0\n", "run.toml:2: [image] width: 0 is not in 1..16384");
  expectError("\n\n[image]\nheight = 'x'\n",
              "run.toml:4: [image] height: expected an integer, found a string");
  expectError("[output\n", "run.toml:1:");
  expectError("[[field]]\nsource = 't'\n\n[[field]]\nsource = 'u'\nunits = 3\n",
              "run.toml:6: [[field]] units");
}

TEST(Config, SuggestsTheNearestKnownKey) {
  expectError("[image]\nwidht = 3\n",
              "run.toml:2: [image] widht: unknown key; did you mean width?");
  expectError("[trigger]\nevery_cycle = 3\n", "did you mean every_cycles?");
  expectError("[outputs]\n", "outputs: unknown key; did you mean output?");
  expectError("[[field]]\nsource = 't'\nzzzzzz = 1\n", "unknown key; known are");
  expectError("[trigger]\nchange = {field='t', threshold=1, treshold=2}\n",
              "[trigger] change treshold: unknown key; did you mean threshold?");
}

TEST(Config, RefusesWhatMakesNoSense) {
  expectError("[output]\nexisting = 'replace'\n", "\"replace\" is none of \"refuse\"");
  expectError("[output]\npath = ''\n", "the archive needs a name");
  expectError("[output]\nbackground = [2, 0, 0]\n", "0..1");
  expectError("[output]\nbackground = 'blue'\n", "none of \"transparent\"");
  expectError("[gl]\nbackend = 'vulkan'\n", "vulkan");
  expectError("[image]\nproxies = ['lenght']\n", "\"lenght\" is none of");
  expectError("[image]\nproxies = ['lenght']\n", "(did you mean 'length'?)");
  expectError("[output]\nexisting = 'apend'\n", "(did you mean 'append'?)");
  expectError("[[view]]\nset = 'fornt'\n", "(did you mean 'front'?)");
  expectError("[image]\nproxies = []\n", "at least one");
  expectError("[sliced]\nslabs = 4\n",
              "[image] proxies names neither \"sliced\" nor \"sliced-features\"");
  const std::string sliced = "[image]\nproxies = ['sliced']\n[sliced]\n";
  expectError(sliced + "slabs = 65\n", "65");
  expectError(sliced + "levels = 48\n", "48 is none of 16, 32, 64, 128");
  expectError(sliced + "stacks = 'fronts'\n", "'fronts'");
  expectError(sliced + "stacks = 'views'\n[[view]]\nset = 'front'\nprojection = 'perspective'\n",
              "orthographic");
  expectError("[training]\npictures = 2\n", "[image] proxies does not name \"training\"");
  expectError("[image]\nproxies = ['training']\n[training]\npictures = 5\n", "5 is not in 1..4");
  expectError("[image]\nproxies = ['training']\n[training]\nscale = 2\n", "2 is not in 0..1");
  expectError("[image]\nproxies = ['training']\n[training]\nlight = 1\n", "light");
  const std::string distorted = "[[view]]\nset = 'front'\nprojection = 'multi-perspective'\n";
  expectError(sliced + "stacks = 'views'\n" + distorted, "multi-perspective");
  expectError("[image]\nproxies = ['layered']\n" + distorted, "multi-perspective view");
  expectError("[layered]\nlayers = 4\n", "[image] proxies does not name \"layered\"");
  expectError("[image]\nproxies = ['layered']\n[layered]\nlayers = 17\n", "17");
  expectError("[image]\nproxies = ['layered']\n[layered]\nlight = [0, 0, 0]\n", "no direction");
  expectError("[image]\nstep_length = -1\n", "-1 is not 0 or positive");
  expectError("[image]\nstep_length = nan\n", "not a finite number");
  expectError("[trigger]\nevery_time = 0\n", "0 is not positive");
  expectError("[trigger]\nchange = {field = 't'}\n", "threshold");
  expectError("[trigger]\nchange = {threshold = 1}\n", "which field");
  expectError("field = 3\n", "[[field]]");
  expectError("[[field]]\nunits = 'K'\n", "which published field");
  expectError("[[field]]\nname = 'a,b'\n", "a,b");
  expectError("[[field]]\nsource='t'\ncomponent = 1\nmagnitude = true\n", "component is given");
  expectError("[[field]]\nsource='t'\nrange = [1, 0]\n", "[1, 0] is upside down");
  expectError("[[field]]\nsource='t'\nrange = [1]\n", "1 numbers are given, 2 needed");
  expectError("[[field]]\nsource='t'\nintervals = 65\n", "65 is not in 1..64");
  expectError("[[field]]\nsource='t'\nbounds = [0, 1]\nintervals = 3\n", "bounds already");
  expectError("[[field]]\nsource='t'\nbounds = [0, 0]\n", "[[field]] bounds");
  expectError("[[field]]\nsource='t'\nrange = [0, 1]\nquantiles = true\n", "range of the data");
  expectError("[[field]]\nsource='t'\nopacity = [[0, 2]]\n", "2 at 0 is not in 0..1");
  expectError("[[field]]\nsource='t'\nopacity = [[1, 0], [0, 1]]\n", "value 0 comes after 1");
  expectError("[[field]]\nsource='t'\nopacity = [1]\n", "element 1 is not a pair");
  expectError("[[field]]\nsource='t'\ncolormap = 'viridia'\n", "colormap");
  expectError("[[field]]\nsource='t'\ncolor_range = [1, 1]\n", "low is not below high");
  expectError("[[field]]\nsource='t'\nisovalues = [1, 1]\n", "twice");
  expectError("[[field]]\nsource='t'\nisovalues = [1]\nisovalue_count = 2\n", "isovalue_count");
}

TEST(Config, RefusesViewsThatMakeNoSense) {
  expectError("[[view]]\n", "a set or a name");
  expectError("[[view]]\nset = 'fornt'\n", "fornt");
  expectError("[[view]]\nset = 'front'\nheight = 2\n", "set already says");
  expectError("[[view]]\nname = 'a/b'\ndirection = [0,1,0]\n", "a/b");
  expectError("[[view]]\nname = 'a'\n", "give direction or target");
  expectError("[[view]]\nname = 'a'\ntarget = [0,1,0]\n", "needs a position");
  expectError("[[view]]\nname = 'a'\ndirection = [0,0,0]\n", "no length");
  expectError("[[view]]\nname = 'a'\ndirection = [0,0,1]\nup = [0,0,2]\n", "parallel");
  expectError("[[view]]\nname = 'a'\ndirection = [0,1,0]\nheight = 0\n", "0 is not positive");
  expectError("[[view]]\nset = 'front'\n[[view]]\nset = 'front'\n",
              "run.toml:4: [[view]] set: the view \"front\" is given twice");
  expectError("[[view]]\nset = 'axes'\n[[view]]\nset = 'top'\n", "run.toml:4:");
  expectError("[[view]]\nset = 'axes'\n[[view]]\nname = 'left'\ndirection = [1,2,3]\n",
              "\"left\" is given twice");
  expectError("[[view]]\nset = 'orbit:30,20'\n[[view]]\nset = 'orbit:30.0,20'\n", "given twice");
  expectError("[[view]]\nset = 'front'\nfield_of_view = 180\n", "not < 180");
  expectError("[[view]]\nset = 'front'\nprojection = 'fisheye'\n", "\"fisheye\" is none of");
  expectError("[[view]]\nset = 'front'\nconvergence = 1\n",
              "run.toml:3: [[view]] convergence: is for projection = \"multi-perspective\"");
  const std::string distorted = "[[view]]\nset = 'front'\nprojection = 'multi-perspective'\n";
  expectError(distorted + "convergence = 0\n", "0 is not positive");
  expectError(distorted + "convergence = 0.001\n", "0.001 is not in 0.01 .. 1000000");
  expectError(distorted + distorted, "the view \"front_distorted\" is given twice");
}

TEST(Config, MoreViewsThanAStepCanMakeAreRefused) {
  expectError("[[view]]\nset = 'sphere:5000'\n", "'5000' is no number of directions in 1..4096");
  expectError("[[view]]\nset = 'axes'\n[[view]]\nset = 'sphere:4091'\n",
              "run.toml:4: [[view]] set: makes it 4097 views of 512 x 512");
  expectError("image = { width = 16384, height = 16384 }\n[[view]]\nset = 'axes'\n",
              "run.toml:3: [[view]] set: makes it 6 views of 16384 x 16384, 1610612736 pixels");
  const auto most = configFromText("[[view]]\nset = 'sphere:4096'\n", "run.toml");
  EXPECT_EQ(resolveViews(most, {{0, 0, 0}, {1, 1, 1}}).size(), 4096u);
}

TEST(Config, ExplicitCamerasStandWhereTheyAreTold) {
  const auto config = configFromText(
      "[[view]]\nname='a'\nposition=[0.5, -4, 0.5]\ntarget=[0.5, 0.5, 0.5]\nheight=3\n"
      "[[view]]\nname='down'\ndirection=[0, 0, -1]\n",
      "run.toml");
  const Box domain{{0, 0, 0}, {1, 1, 1}};
  const auto views = resolveViews(config, domain);
  ASSERT_EQ(views.size(), 2u);
  EXPECT_EQ(views[0].camera.position, glm::dvec3(0.5, -4, 0.5));
  EXPECT_NEAR(views[0].camera.forward.y, 1.0, 1e-12);
  EXPECT_EQ(views[0].camera.viewHeight, 3.0);
  EXPECT_LT(views[0].camera.nearDepth, 4.0);
  EXPECT_GT(views[0].camera.farDepth, 5.0);
  EXPECT_NEAR(views[1].camera.forward.z, -1.0, 1e-12);
}

TEST(Config, MultiPerspectiveViewsStandBesideTheOthers) {
  const auto config = configFromText(
      "[[view]]\nset = 'front'\n"
      "[[view]]\nset = 'front'\nprojection = 'multi-perspective'\n"
      "[[view]]\nname = 'a'\ndirection = [1, 1, 0]\nprojection = 'multi-perspective'\n"
      "convergence = 2\nheight = 5\n",
      "run.toml");
  const Box domain{{0, 0, 0}, {1, 1, 1}};
  const auto views = resolveViews(config, domain);
  ASSERT_EQ(views.size(), 3u);
  EXPECT_EQ(views[1].name, "front_distorted");
  EXPECT_EQ(views[1].camera, frameBoxDistorted(domain, {0, 1, 0}, {0, 0, 1}, 1.0));
  EXPECT_EQ(views[2].camera.convergence, 2.0);
  EXPECT_EQ(views[2].camera.viewHeight, 5.0);
}

TEST(Config, FrontIsTheDefaultView) {
  const auto views = resolveViews(Config{}, {{0, 0, 0}, {1, 1, 1}});
  ASSERT_EQ(views.size(), 1u);
  EXPECT_EQ(views[0].name, "front");
}

TEST(Config, NearestWordIsByEditDistance) {
  EXPECT_EQ(nearestWord("temprature", {"density", "temperature"}), "temperature");
  EXPECT_EQ(nearestWord("x", {"density", "temperature"}), "");
}

TEST(Config, BudgetsAreBytesWithUnitsAndSharesOfTime) {
  const auto bytes = [](const std::string& value) {
    return configFromText("[budget]\nbytes_per_step = " + value + "\n", "run.toml")
        .budget.bytesPerStep;
  };
  EXPECT_EQ(bytes("1500"), 1500u);
  EXPECT_EQ(bytes("2e6"), 2000000u);
  EXPECT_EQ(bytes("'20 MB'"), 20000000u);
  EXPECT_EQ(bytes("'20MB'"), 20000000u);
  EXPECT_EQ(bytes("'1.5 GiB'"), std::uint64_t(1.5 * 0x1p30));
  EXPECT_EQ(bytes("'7 B'"), 7u);
  const Config config = configFromText("[budget]\ntime_share = 0.25\n", "run.toml");
  EXPECT_EQ(config.budget.timeShare, 0.25);
  EXPECT_FALSE(config.budget.bytesPerStep);
  EXPECT_FALSE(configFromText("", "run.toml").budget.any());
}

TEST(Config, BudgetsThatMakeNoSenseAreErrors) {
  const auto budget = [](const std::string& line) { return "[budget]\n" + line + "\n"; };
  expectError(
      budget("bytes_per_step = '20 XB'"),
      "run.toml:2: [budget] bytes_per_step: \"20 XB\" has no unit that is known: B, kB, MB");
  expectError(budget("bytes_per_step = '20'"), "has no unit that is known");
  expectError(budget("bytes_per_step = 'much'"), "\"much\" does not begin with a number");
  expectError(budget("bytes_per_step = 'nan MB'"), "nan MB is not in 1 .. 2^60 bytes");
  expectError(budget("bytes_per_step = 0"), "0 is not in 1 .. 2^60 bytes");
  expectError(budget("bytes_per_step = -3"), "-3 is not in 1 .. 2^60 bytes");
  expectError(budget("bytes_per_step = '0.2 B'"), "0.2 B is not in 1 .. 2^60 bytes");
  expectError(budget("bytes_per_step = '9e9 TB'"), "9e9 TB is not in 1 .. 2^60 bytes");
  expectError(budget("bytes_per_step = inf"), "not a finite number");
  expectError(budget("bytes_per_step = true"),
              "expected a number of bytes, or a text such as \"20 MB\", found true or false");
  expectError(budget("time_share = 0"), "[budget] time_share: 0 is not positive");
  expectError(budget("time_share = 1.01"), "[budget] time_share: 1.01 is more than 1");
  expectError(budget("time_share = '10 %'"), "expected a number");
  expectError("[budget]\n", "run.toml:1: [budget] bytes_per_step: neither this nor time_share");
  expectError(budget("bytes_per_stop = 3"), "neither this nor time_share");
  expectError(budget("time_share = 1\nbytes = 3"), "[budget] bytes: unknown key");
  expectError("budget = 3\n", "expected a table");
}

FieldStatistics statisticsOver(double low, double high) {
  FieldStatistics statistics;
  statistics.count = 256;
  statistics.low = low;
  statistics.high = high;
  statistics.histogram.assign(256, 1);
  return statistics;
}

TEST(Classification, DefaultsAreUniformIntervalsARampAndEvenIsovalues) {
  const auto made = classify({}, statisticsOver(0.0, 10.0), 1.0);
  EXPECT_EQ(made.partition, IntervalPartition::uniform(0.0, 10.0, 16));
  EXPECT_EQ(made.isovalues, (std::vector<double>{2.0, 4.0, 6.0, 8.0}));
  EXPECT_EQ(made.base.opacity(0.0), 0.0);
  EXPECT_GT(made.base.opacity(10.0), 0.0);
}

TEST(Classification, FieldsOfBothSignsHaveABoundAtZero) {
  FieldConfig config;
  EXPECT_EQ(classify(config, statisticsOver(-1.0, 3.0), 1.0).partition.bounds()[4], 0.0);
  config.range = FieldConfig::Range::Fixed;
  config.low = -3.0;
  config.high = 1.0;
  const auto fixed = classify(config, statisticsOver(-1.0, 3.0), 1.0).partition;
  EXPECT_EQ(fixed.low(), -3.0);
  EXPECT_EQ(fixed.high(), 1.0);
  EXPECT_EQ(fixed.bounds()[12], 0.0);
  config.bounds = {-2.0, -0.5, 1.0};
  EXPECT_EQ(classify(config, statisticsOver(-1.0, 3.0), 1.0).partition,
            IntervalPartition::fromBounds({-2.0, -0.5, 1.0}))
      << "what the user gives stays";
}

TEST(Classification, IsovaluesFollowTheirRule) {
  FieldConfig config;
  config.opacity = {{0, 0}, {2, 1}, {4, 0}, {6, 0.5}, {10, 0}};
  const auto statistics = statisticsOver(0.0, 10.0);
  EXPECT_EQ(classify(config, statistics, 1.0).isovalues, (std::vector<double>{2.0, 6.0}));
  config.isovalueRule = FieldConfig::Isovalues::Bounds;
  config.intervals = 4;
  EXPECT_EQ(classify(config, statistics, 1.0).isovalues, (std::vector<double>{2.5, 5.0, 7.5}));
  config.isovalueRule = FieldConfig::Isovalues::Explicit;
  config.isovalues = {7.0, 1.0};
  EXPECT_EQ(classify(config, statistics, 1.0).isovalues, (std::vector<double>{1.0, 7.0}));
}

TEST(Classification, ConstantFieldsHaveARange) {
  const auto made = classify({}, statisticsOver(3.0, 3.0), 1.0);
  EXPECT_LT(made.partition.low(), 3.0 + 1e-30);
  EXPECT_GT(made.partition.high(), made.partition.low());
}

TEST(Classification, QuantilesFollowTheHistogram) {
  FieldConfig config;
  config.quantiles = true;
  config.intervals = 2;
  auto statistics = statisticsOver(0.0, 256.0);
  statistics.histogram.assign(256, 0);
  for (int i = 0; i < 64; ++i) statistics.histogram[std::size_t(i)] = 4;
  const auto made = classify(config, statistics, 1.0);
  EXPECT_NEAR(made.partition.bounds()[1], 32.0, 1.01);
}

TEST(Config, ReadsACustomisationWithTheKeysOfLooks) {
  const Config config = configFromText(R"([customization]
resolution = 48
metric = "manhattan"
corners = { opacity = 0.5 }
[[customization.seeds]]
name = "core"
position = [1, 2, 3]
extent = [0, 0, 0.5]
gamma = 0.7
[[customization.seeds]]
position = [0, 0, 0]
enabled = false
shift = [0.1, 0, -1]
)",
                                       "run.toml");
  ASSERT_TRUE(config.customization);
  const Customization& made = *config.customization;
  EXPECT_EQ(made.resolution, 48);
  EXPECT_EQ(made.metric, SeedMetric::Manhattan);
  for (const SeedParameters& corner : made.corners) EXPECT_EQ(corner.opacity, 0.5);
  ASSERT_EQ(made.seeds.size(), 2u);
  EXPECT_EQ(made.seeds[0].position, glm::dvec3(1, 2, 3));
  EXPECT_EQ(made.seeds[0].parameters.gamma, 0.7);
  EXPECT_FALSE(made.seeds[1].enabled);
  EXPECT_FALSE(configFromText("[customization]\ncorners = {}\n", "run.toml").customization)
      << "it changes nothing";
}

TEST(Config, RefusesCustomisationsThatAMarchCannotMake) {
  const std::string seed = "[customization]\n[[customization.seeds]]\nposition = [0, 0, 0]\n";
  expectError(seed + "gama = 2\n", "run.toml:4: [customization] seeds[0].gama");
  expectError(seed + "gamma = 0\n", "run.toml:4: [customization] seeds[0].gamma: is 0");
  expectError(seed + "opacity = 'x'\n", "run.toml:4: [customization] seeds[0].opacity");
  expectError("[customization]\nresolution = 7\n", "run.toml:2: [customization] resolution: is 7");
  expectError("[customization]\ncorners = [{}]\n", "run.toml:2: [customization] corners: lists 1");
  expectError("customization = 3\n", "customization");
  expectError(seed + "function = { colormap = 'magma' }\n",
              "run.toml:4: [customization] seeds[0].function: is for looks");
  expectError(seed + "blend = 0.5\n", "run.toml:4: [customization] seeds[0].blend");
  expectError("[customization]\ncorners = { function = { colormap = 'magma' } }\n",
              "run.toml:2: [customization] corners.function: is for looks");
  expectError("[customization]\ncorners = [{}, {}, { function = {} }, {}, {}, {}, {}, {}]\n",
              "run.toml:2: [customization] corners[2].function: is for looks");
  const std::string opaque = "[customization.corners]\nopacity = 2\n";
  expectError("[image]\nproxies = ['length', 'depth', 'training']\n" + opaque,
              "run.toml:3: customization: is seen in \"attenuation\"");
  expectError("[image]\nproxies = ['mip']\n" + opaque, "none of these is made");
  EXPECT_TRUE(
      configFromText("[image]\nproxies = ['mip']\n[customization.corners]\ngamma = 2\n", "run.toml")
          .customization);
}

constexpr const char* kClassifier = "[[classifier]]\nkind = 'gaussian'\nfields = ['t', 'w']\n";

TEST(Config, ReadsClassifiers) {
  const Config config = configFromText(std::string(kClassifier) + R"(name = "front"
[[classifier.primitives]]
name = "hot"
center = [300, 1]
width = [10, 0.5]
[[classifier.primitives]]
fit = { low = [0, 0, 1], high = [2, 2, 1], full = true }
)",
                                       "run.toml");
  ASSERT_EQ(config.classifiers.size(), 1u);
  const ClassifierConfig& classifier = config.classifiers[0];
  EXPECT_EQ(classifier.name, "front");
  EXPECT_EQ(classifier.fields, (std::vector<std::string>{"t", "w"}));
  ASSERT_EQ(classifier.fits.size(), 1u);
  EXPECT_EQ(classifier.fits[0].primitive, 1u);
  EXPECT_EQ(classifier.fits[0].region.high, glm::dvec3(2, 2, 1));
  EXPECT_TRUE(classifier.fits[0].full);
  EXPECT_TRUE(config.features);
  EXPECT_FALSE(config.slicedFeatures || config.makesFields());
}

TEST(Config, ClassifiersAreMadeBesideTheFieldsThatAreNamed) {
  const std::string field = "[[field]]\nname = 'n'\ngradient_norm = ['t', 'w']\n";
  const Config both = configFromText(field + kClassifier, "run.toml");
  EXPECT_TRUE(both.features && both.length);
  EXPECT_EQ(both.fields[0].gradientNorm, (std::vector<std::string>{"t", "w"}));
  const Config stacks = configFromText(
      std::string("[image]\nproxies = ['sliced-features']\n[sliced]\nslabs = 9\n") + kClassifier,
      "run.toml");
  EXPECT_FALSE(stacks.features || stacks.sliced);
  ASSERT_TRUE(stacks.slicedFeatures);
  EXPECT_EQ(stacks.slicedFeatures->slabs, 9);
}

TEST(Config, RefusesClassifiersWithoutSense) {
  const std::string good = kClassifier;
  expectError(good + "name = 3\n", "run.toml:4: [[classifier]] name: must be a text, not 3");
  expectError(good + "name = 'a b'\n", "other characters");
  expectError("[[field]]\nname = 'x'\n" + good + "name = 'x'\n",
              "run.toml:6: [[classifier]] name: \"x\" is the name of a field");
  expectError(good + good, "run.toml:4: [[classifier]] name: \"features\" is the name");
  expectError(good + "widths = 1\n", "run.toml:4: [[classifier]] widths: is not known here");
  expectError("[[classifier]]\nkind = 'gauss'\n", "run.toml:2: [[classifier]] kind: is 'gauss'");
  const std::string primitive = good + "[[classifier.primitives]]\n";
  expectError(primitive + "width = [1]\n", "run.toml:5: [[classifier]] primitives[0].width");
  const auto fit = [&](const std::string& keys, const std::string& more = "") {
    return primitive + "fit = {" + keys + "}\n" + more;
  };
  expectError(fit("low = [0, 0]"), "run.toml:5: [[classifier]] primitives[0].fit.low: must hold");
  expectError(fit("low = [0, 0, 0]"), "primitives[0].fit.high");
  expectError(fit("low = [0, 2, 0], high = [1, 1, 1]"), "is 2 along axis 1, above high 1");
  expectError(fit("low = [0, 0, 0], high = [1, 1, 1], big = 1"), "primitives[0].fit.big");
  expectError(fit("low = [0, 0, 0], high = [1, 1, 1]", "center = [1, 1]\n"),
              "run.toml:6: [[classifier]] primitives[0].center: is given, and fit");
  expectError("[image]\nproxies = ['length']\n" + good, "names neither \"features\"");
  expectError("[image]\nproxies = ['features']\n", "there is no [[classifier]]");
  expectError("[image]\nproxies = ['sliced-features']\n[sliced]\nlevels = 64\n" + good,
              "levels: are of \"sliced\"");
  expectError("[[field]]\ngradient_norm = []\n", "gradient_norm: of which fields?");
  expectError("[[field]]\ngradient_norm = ['t']\nsource = 't'\n", "source: gradient_norm already");
}

TEST(Config, ReadsFillValuesAndRangesOfThem) {
  const auto fields =
      configFromText("[[field]]\nsource='t'\nno_data = [1e20, -9999, [-inf, -1e10]]\n", "run.toml")
          .fields;
  EXPECT_EQ(fields[0].noData,
            (std::vector<ValueRange>{{1e20, 1e20}, {-9999, -9999}, {-HUGE_VAL, -1e10}}));
  expectError("[[field]]\nsource='t'\nno_data = 1e20\n", "an array of numbers");
  expectError("[[field]]\nsource='t'\nno_data = [[1, 0]]\n", "[1, 0] is upside down");
  expectError("[[field]]\nsource='t'\nno_data = [1, 'x']\n", "element 2 is neither a number");
  expectError("[[field]]\nsource='t'\nno_data = [[1, 2, 3]]\n", "element 1 is neither");
  expectError("[[field]]\nsource='t'\nno_data = [nan]\n", "element 1 is neither");
  expectError("[[field]]\ngradient_norm=['t']\nno_data = [1]\n", "already says");
}

}  // namespace
}  // namespace vestige
