// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/export/export.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>

#include "explorer/export/npy.h"
#include "explorer/inspect/probe.h"
#include "proxy/base/error.h"
#include "proxy/format/layout/field_layout.h"
#include "proxy/format/layout/learned_layout.h"
#include "tests/explorer/synthetic.h"
#include "tests/support/walked_stack.h"

namespace vestige {
namespace {

using nlohmann::json;

std::string contentOf(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// What NumPy would load: the shape as it is written, and the values.
struct Loaded {
  std::string header;
  std::vector<double> values;
};
Loaded load(const std::filesystem::path& path) {
  const std::string bytes = contentOf(path);
  EXPECT_EQ(bytes.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8)) << path;
  const std::size_t length =
      std::size_t(std::uint8_t(bytes.at(8))) + 256 * std::size_t(std::uint8_t(bytes.at(9)));
  EXPECT_EQ((10 + length) % 64, 0u);
  Loaded loaded{bytes.substr(10, length), {}};
  const auto read = [&](auto number) {
    for (std::size_t at = 10 + length; at < bytes.size(); at += sizeof number) {
      std::memcpy(&number, bytes.data() + at, sizeof number);
      loaded.values.push_back(double(number));
    }
  };
  loaded.header.find("<f8") != std::string::npos ? read(0.0) : read(0.0f);
  return loaded;
}

class Export : public ::testing::Test {
 protected:
  /// The entries of an archive of one step, exported to out().
  json exported(const std::vector<EncodedProxy>& proxies,
                ChannelFormat format = ChannelFormat::Npy) {
    const auto path = folder_.path() / "run.cdb";
    ArchiveWriter(path, ExistingArchive::Overwrite).writeStep(proxies);
    const Archive archive(path);
    json files = exportChannels(archive, archive.rows(), ExportFolder(out()), format, {});
    EXPECT_EQ(json::parse(manifestText(archive, files))["files"], files);
    return files;
  }
  std::filesystem::path out() const { return folder_.path() / "out"; }
  Loaded load(const json& entry) const {
    Loaded loaded = vestige::load(out() / entry["file"].get<std::string>());
    std::size_t values = 1;
    for (const std::size_t extent : entry["shape"]) values *= extent;
    EXPECT_EQ(loaded.values.size(), values) << entry["file"];
    EXPECT_EQ(entry["dimensions"].size(), entry["shape"].size());
    return loaded;
  }
  static const json& named(const json& files, const char* part) {
    for (const json& entry : files)
      if (entry.value("part", "") == part) return entry;
    ADD_FAILURE() << part;
    return files[0];
  }

  synthetic::TemporaryFolder folder_;
};

FieldSamples unevenField() {
  FieldSamples field;
  field.axes[0] = {4, -1.0, 0.5, {}};
  field.axes[1] = {3, -1.0, 1.0, {}};
  field.axes[2] = {5, 0.0, 1.0, {-1.0, -0.9, -0.5, 0.25, 1.0}};
  field.low = 280.0;
  field.high = 340.0;
  for (int i = 0; i < 60; ++i) field.values.push_back(float(i) / 59.0f);
  field.values[17] = std::numeric_limits<float>::quiet_NaN();
  return field;
}

TEST_F(Export, GivesAFieldInItsUnitsOnItsAxesWithNansForNoData) {
  const FieldSamples field = unevenField();
  ProxyHeader header = synthetic::header(kind::kField, {8, 8});
  header.view = kFieldView;
  const json files = exported({encodeProxy(fieldImage(header, field, {1, 1e-4}))});
  ASSERT_EQ(files.size(), 1u);
  const json& entry = files[0];
  EXPECT_TRUE(entry["file"].get<std::string>().ends_with("density.field.npy")) << entry["file"];
  EXPECT_EQ(entry["shape"], (json{5, 3, 4}));
  EXPECT_EQ(entry["dimensions"], (json{"z", "y", "x"}));
  EXPECT_EQ(entry["units"], "kg/m3");
  EXPECT_EQ(entry["axes"], (json{{-1.0, -0.5, 0.0, 0.5}, {-1.0, 0.0, 1.0}, field.axes[2].nodes}));
  EXPECT_EQ(entry["largestError"], 1e-4);
  const Loaded loaded = load(entry);
  EXPECT_NE(loaded.header.find("'<f8'"), std::string::npos) << loaded.header;
  EXPECT_NE(loaded.header.find("(5,3,4,)"), std::string::npos) << loaded.header;
  for (std::size_t i = 0; i < 60; ++i) {
    if (i == 17)
      EXPECT_TRUE(std::isnan(loaded.values[i]));
    else
      EXPECT_NEAR(loaded.values[i], 280.0 + 60.0 * double(i) / 59.0, 2e-4) << i;
  }
}

TEST_F(Export, WritesAFieldAsLinesOfPlacesAndValues) {
  ProxyHeader header = synthetic::header(kind::kField, {8, 8});
  header.view = kFieldView;
  const json files =
      exported({encodeProxy(fieldImage(header, unevenField(), {1, 1e-4}))}, ChannelFormat::Csv);
  const std::string text = contentOf(out() / files[0]["file"].get<std::string>());
  EXPECT_TRUE(text.starts_with("x,y,z,value\n-1,-1,-1,")) << text.substr(0, 60);
  EXPECT_NE(text.find("\n-0.5,0,-0.9,nan\n"), std::string::npos) << text;  // sample 17
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 61);
}

/// A view along +y of [0, 2] x [0, 4] x [0, 1] in which every ray rises from -0.1 to 1.2.
SlicedStack risingStack() {
  ProxyHeader header = synthetic::header(kind::kSliced, {6, 4});
  header.domain = {{0, 0, 0}, {2, 4, 1}};
  header.camera = frameBox(header.domain, {0, 1, 0}, {0, 0, 1}, header.size.aspect());
  header.camera.viewHeight = 1.0;  // no rim: every ray hits
  header.slabDepths = test::evenSlabs(header.camera, header.domain, 4);
  const double near = header.slabDepths.front();
  return test::walkedStack(header, 32, [near](std::size_t, const test::StretchSink& sink) {
    sink({near, near + 4.0, -0.1, 1.2});
  });
}

TEST_F(Export, GivesStacksAsWorldLengthsOfEachSlabAndInterval) {
  const SlicedStack stack = risingStack();
  const json files = exported({encodeProxy(stack)});
  const json& entry = named(files, "lengths");
  EXPECT_EQ(entry["shape"], (json{4, synthetic::kIntervals + 3, 4, 6}));
  EXPECT_EQ(entry["dimensions"], (json{"slab", "channel", "y", "x"}));
  EXPECT_EQ(entry["units"], "world length");
  EXPECT_EQ(entry["slabDepths"], json(stack.header.slabDepths));
  EXPECT_EQ(entry["channels"][1]["low"], 0.2);
  EXPECT_EQ(entry["channels"][1]["high"], 0.4);
  const std::vector<double> values = load(entry).values;
  const std::size_t pixels = 24, channels = synthetic::kIntervals + 3, middle = 6 * 2 + 3;
  double all = 0.0;
  const std::vector<ProbeCell> cells = probe(stack, 3, 2);
  for (std::size_t s = 0; s < 4; ++s)
    for (const ProbeShare& share : cells[s].shares) {
      std::size_t k = 0;
      while (entry["channels"][k]["name"] != share.channel) ++k;
      const double length = values[(s * channels + k) * pixels + middle];
      EXPECT_NEAR(length, share.length, 1e-6);
      all += length;
    }
  EXPECT_NEAR(all, 4.0, 1e-5);
  double interval = 0.0;  // 0.2 of the 1.3 that a ray rises over its length of 4
  for (std::size_t s = 0; s < 4; ++s) interval += values[(s * channels + 2) * pixels + middle];
  EXPECT_NEAR(interval, 4.0 * 0.2 / 1.3, 4.0 / 32.0);

  const std::vector<double> faces = load(named(files, "faces")).values;
  EXPECT_EQ(faces[middle], synthetic::kIntervals);                   // below
  EXPECT_EQ(faces[4 * pixels + middle], synthetic::kIntervals + 1);  // above
  EXPECT_EQ(named(files, "turns")["shape"], (json{4, 2, 4, 6}));
  for (const double turn : load(named(files, "turns")).values) EXPECT_TRUE(std::isnan(turn));
}

TEST_F(Export, GivesPicturesInWorldUnitsWithNansWhereThereIsNothing) {
  const ImageSize size{24, 16};
  const json files = exported(
      {encodeProxy(synthetic::lengthProxy(size)), encodeProxy(synthetic::depthProxy(size, {0.5})),
       encodeProxy(synthetic::mipProxy(size)), encodeProxy(synthetic::referenceProxy(size))});
  EXPECT_EQ(files.size(), 7u);
  const ProxyHeader header = synthetic::header(kind::kLength, size);
  const double pixel = header.camera.viewHeight / size.height;
  const std::size_t pixels = size.pixels(), corner = 0, middle = pixels / 2 + 12;
  for (const json& entry : files) {
    EXPECT_EQ(entry["axes"][0].size(), 24u);
    EXPECT_EQ(entry["axes"][1].size(), 16u);
    EXPECT_NEAR(entry["axes"][0][12].get<double>(), 0.5 * pixel, 1e-12);
    EXPECT_NEAR(entry["axes"][1][0].get<double>(), 7.5 * pixel, 1e-12);
    EXPECT_EQ(entry["channels"].size(), entry["shape"][0]);
    for (const json& channel : entry["channels"]) {
      EXPECT_GT(channel["meaning"].get<std::string>().size(), 5u) << channel;
      EXPECT_TRUE(channel.contains("units"));
    }
  }
  const std::size_t inner = synthetic::kIntervals - 1;  // the innermost shell, radius 0.2
  const auto length = load(named(files, "length")).values;
  const auto depth = load(named(files, "depth")).values;
  for (const Segment& segment : synthetic::trueSegments(header, 12, 8)) {
    if (segment.channel != int(inner)) continue;
    EXPECT_NEAR(length[inner * pixels + middle], segment.amount, 1e-3);
  }
  EXPECT_NEAR(depth[inner * pixels + middle], -header.camera.position.y, 0.01);
  EXPECT_EQ(length[inner * pixels + corner], 0.0);
  EXPECT_TRUE(std::isnan(depth[inner * pixels + corner]));
  const auto ends = load(named(files, "ends")).values;
  EXPECT_EQ(ends[middle], synthetic::kIntervals);  // below
  EXPECT_EQ(ends[corner], -1.0);
  const auto layer = load(named(files, "layer00")).values;
  EXPECT_NEAR(layer[middle], -header.camera.position.y - 0.5, 0.02);
  EXPECT_TRUE(std::isnan(layer[corner]));
  EXPECT_EQ(named(files, "layer00")["units"], "by channel");
  EXPECT_EQ(named(files, "mip")["units"], "kg/m3");
}

TEST_F(Export, GivesTheTableOfLearnedColoursARowACluster) {
  ProxyHeader header = synthetic::header(kind::kLearned, {8, 8});
  header.looks = {*header.base};
  header.learned = LearnedOrigin{"length", {8, 8}, 0.01};
  const auto n = std::size_t(header.partition->channels());
  LearnedTable table{
      int(n), 2, std::vector<float>(2 * n), std::vector<float>(6 * n), {1, 2, 3, 4, 5, 6}};
  std::iota(table.jacobian.begin(), table.jacobian.end(), 10.0f);
  const json files = exported({encodeProxy(learnedImage(header, table))});
  EXPECT_EQ(files[0]["shape"], (json{2, 4 * n + 3}));
  EXPECT_EQ(files[0]["channels"][n]["name"], "red_by_i00");
  const auto values = load(files[0]).values;
  EXPECT_EQ(values[4 * n], 1.0);
  EXPECT_EQ(values[4 * n + 3 + n], 10.0 + 3.0 * double(n));
  EXPECT_EQ(values.back(), 6.0);
}

TEST_F(Export, KeepsFilesApartWhoseNamesFallTogether) {
  std::vector<EncodedProxy> proxies;
  for (const char* field : {"a/b", "a_b"}) {
    ProxyImage image = synthetic::mipProxy({4, 4});
    image.header.field = field;
    proxies.push_back(encodeProxy(image));
  }
  const json files = exported(proxies);
  EXPECT_NE(files[0]["file"], files[1]["file"]);
}

TEST(Npy, SaysWhatFollows) {
  const std::vector<std::size_t> shape{2, 3};
  const std::string header = npyHeader(NpyType::Float32, shape);
  EXPECT_EQ(header.size() % 64, 0u);
  EXPECT_EQ(header.back(), '\n');
  EXPECT_NE(header.find("{'descr': '<f4', 'fortran_order': False, 'shape': (2,3,), }"),
            header.npos);
}

TEST_F(Export, LeavesArchivesAndFilesOfOthersAlone) {
  const auto path = folder_.path() / "an.cdb";
  ArchiveWriter(path, ExistingArchive::Refuse)
      .writeStep({encodeProxy(synthetic::mipProxy({4, 4}))});
  const auto codeOf = [](const std::function<void()>& work) -> std::optional<ErrorCode> {
    try {
      work();
    } catch (const Error& error) {
      return error.code();
    }
    return std::nullopt;
  };
  EXPECT_EQ(codeOf([&] { ExportFolder{path}; }), ErrorCode::Exists);
  EXPECT_EQ(codeOf([&] { ExportFolder{path / "deep" / "er"}; }), ErrorCode::Exists);
  EXPECT_FALSE(std::filesystem::exists(path / "deep"));
  const auto folder = folder_.path() / "mine";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "statistics.csv") << "mine";
  EXPECT_EQ(codeOf([&] { ExportFolder(folder).file("statistics.csv"); }), ErrorCode::Exists);
  EXPECT_EQ(codeOf([&] { ExportFolder(folder).file("histograms.csv"); }), std::nullopt);
  // What an export wrote may be written anew.
  std::ofstream(folder / "manifest.json")
      << R"({"archive": "a.cdb", "files": [{"file": "statistics.csv"}]})";
  EXPECT_EQ(codeOf([&] { ExportFolder(folder).file("statistics.csv"); }), std::nullopt);
  // Some manifest of somebody.
  std::ofstream(folder / "manifest.json") << R"({"files": []})";
  EXPECT_EQ(codeOf([&] { ExportFolder{folder}; }), ErrorCode::Exists);
}

}  // namespace
}  // namespace vestige
