// SPDX-License-Identifier: BSD-3-Clause
// The program vestige-explorer as its users meet it, and the proof that it has no way to the
// fields.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "explorer/picture/picture.h"
#include "proxy/format/layout/field_layout.h"
#include "proxy/transfer/colormap.h"
#include "tests/explorer/synthetic.h"

namespace vestige {
namespace {

struct Outcome {
  int code;
  std::string text;  ///< standard output and error
};

Outcome shell(const std::string& command) {
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  Outcome outcome{-1, {}};
  std::array<char, 4096> buffer;
  for (std::size_t n; (n = fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
    outcome.text.append(buffer.data(), n);
  }
  const int status = pclose(pipe);
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return outcome;
}

Outcome explorer(const std::string& arguments) {
  return shell(std::string("'") + VESTIGE_EXPLORER + "' " + arguments);
}

std::string contentOf(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class Program : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new synthetic::TemporaryFolder;
    synthetic::writeArchive(folder_->path() / "run.cdb", {64, 48}, 3);
  }
  static void TearDownTestSuite() { delete folder_; }
  static std::string archive() { return "'" + (folder_->path() / "run.cdb").string() + "'"; }
  static std::string file(const std::string& name) { return (folder_->path() / name).string(); }

  static synthetic::TemporaryFolder* folder_;
};
synthetic::TemporaryFolder* Program::folder_ = nullptr;

TEST_F(Program, ListsAnArchiveForPeopleAndForPrograms) {
  const Outcome human = explorer("info " + archive());
  EXPECT_EQ(human.code, 0) << human.text;
  for (const char* word : {"3 steps", "view front", "density [kg/m3]", "5 intervals", "length"}) {
    EXPECT_NE(human.text.find(word), std::string::npos) << word << " in " << human.text;
  }
  const Outcome machine = explorer("info --json " + archive());
  const auto info = nlohmann::json::parse(machine.text);
  EXPECT_EQ(info["cycles"], (nlohmann::json{0, 10, 20}));
  EXPECT_EQ(info["fields"][0]["bounds"].size(), 6u);
  EXPECT_EQ(info["proxies"].size(), 5u);
}

TEST_F(Program, ShowsTimingsWhereTheRunLeftThem) {
  EXPECT_EQ(explorer("info --timings " + archive()).code, 1);
  std::filesystem::copy(folder_->path() / "run.cdb", folder_->path() / "timed.cdb",
                        std::filesystem::copy_options::recursive);
  std::ofstream(file("timed.cdb/timings.csv")) << "cycle,march_s\n0,0.5\n7\n10,1.5\n";
  const Outcome outcome = explorer("info --timings '" + file("timed.cdb") + "'");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_NE(outcome.text.find("march_s"), std::string::npos);
  EXPECT_TRUE(std::regex_search(outcome.text, std::regex("mean +1\\n"))) << outcome.text;
}

TEST_F(Program, RendersAPictureAndSaysWhichProxyAnswered) {
  const Outcome outcome =
      explorer("render " + archive() + " -o '" + file("a.png") +
               "' --colormap hot --colorbar --axes --box --time-label --trust -v");
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_NE(outcome.text.find("uses length"), std::string::npos) << outcome.text;
  EXPECT_NE(outcome.text.find("trust:"), std::string::npos);
  EXPECT_EQ(readPicture(file("a.png")).size, (ImageSize{64, 48}));
}

TEST_F(Program, GivesTheSamePictureFromASavedLook) {
  const std::string options =
      "--step 10 --opacity '0.2:0,0.5:0.4,1:0.9' --colormap inferno --light 20,40 --ao "
      "--enhance --rotate 25,10 --size 80x60 --background '#203040' --source layers";
  ASSERT_EQ(explorer("render " + archive() + " -o '" + file("b.png") + "' " + options +
                     " --save-look '" + file("b.json") + "'")
                .code,
            0);
  ASSERT_EQ(explorer("render " + archive() + " -o '" + file("c.png") + "' --look '" +
                     file("b.json") + "'")
                .code,
            0);
  EXPECT_EQ(contentOf(file("b.png")), contentOf(file("c.png")));
}

TEST_F(Program, CustomisesByAFileAndDrawsItsSeeds) {
  std::ofstream(file("seeds.json")) << R"({"resolution": 32, "seeds": [
    {"position": [0.3, 0, 0.3], "opacity": 0.1, "shift": [0.3, 0, 0]}]})";
  const std::string options = " --source layers --customize '" + file("seeds.json") +
                              "' --seeds identity --save-look '" + file("custom.json") + "'";
  const Outcome outcome =
      explorer("render " + archive() + " -o '" + file("custom.png") + "'" + options);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  ASSERT_EQ(explorer("render " + archive() + " -o '" + file("again.png") + "' --look '" +
                     file("custom.json") + "'")
                .code,
            0);
  EXPECT_EQ(contentOf(file("custom.png")), contentOf(file("again.png")));
  explorer("render " + archive() + " -o '" + file("plain.png") + "' --source layers");
  EXPECT_NE(contentOf(file("custom.png")), contentOf(file("plain.png")));
  const auto refuses = [&](const char* text, const std::string& part) {
    std::ofstream(file("seeds.json")) << text;
    const Outcome refused =
        explorer("render " + archive() + " -o x.png --customize '" + file("seeds.json") + "'");
    EXPECT_EQ(refused.code, 1);
    EXPECT_NE(refused.text.find(part), std::string::npos) << refused.text;
  };
  refuses("{", "is not JSON");
  refuses(R"({"seeds": [{"position": [0, 0, 0], "gama": 2}]})",
          "'customization.seeds[0].gama' is not known here");
}

TEST_F(Program, ComparesPicturesAndArchives) {
  explorer("render " + archive() + " -o '" + file("d.exr") + "'");
  explorer("render " + archive() + " -o '" + file("e.exr") + "' --via attenuation");
  EXPECT_NE(explorer("compare '" + file("d.exr") + "' '" + file("d.exr") + "'").text.find("inf dB"),
            std::string::npos);
  const auto measures = nlohmann::json::parse(
      explorer("compare --json '" + file("d.exr") + "' '" + file("e.exr") + "'").text);
  EXPECT_GT(measures["psnr"].get<double>(), 10.0);
  EXPECT_LT(measures["psnr"].get<double>(), 100.0);
  const Outcome both = explorer("compare " + archive() + " " + archive());
  EXPECT_EQ(both.code, 0) << both.text;
  EXPECT_EQ(std::count(both.text.begin(), both.text.end(), '\n'), 3) << both.text;
  const auto equal = nlohmann::json::parse(
      explorer("compare --json '" + file("d.exr") + "' '" + file("d.exr") + "'").text);
  EXPECT_TRUE(equal["psnr"].is_null());
  EXPECT_EQ(equal["ssim"], 1.0);
}

/// An archive of one step: the run's, with another base function, and a view that it lacks.
void writeOther(const std::filesystem::path& path, const std::vector<std::string>& views) {
  ArchiveWriter writer(path, ExistingArchive::Refuse);
  std::vector<EncodedProxy> proxies;
  for (const std::string& view : views) {
    for (ProxyImage image :
         {synthetic::lengthProxy({32, 24}), synthetic::referenceProxy({32, 24})}) {
      image.header.view = view;
      image.header.base->setOpacity({{0.0, 0.9}, {1.0, 0.0}});
      image.header.base->setColormap(Colormap::named("hot"));
      for (ProxyPart& part : image.parts)
        if (part.name == "reference")
          for (Channel& channel : part.channels) channel.values.assign(32 * 24, 0.7f);
      proxies.push_back(encodeProxy(image));
    }
  }
  writer.writeStep(proxies);
}

TEST_F(Program, ComparesOneLookOfTwoArchivesAndSkipsWhatOneLacks) {
  writeOther(file("other.cdb"), {"front", "side"});
  const std::string command =
      " compare " + archive() + " '" + file("other.cdb") + "' --json --step 0";
  const Outcome outcome = shell(std::string("('") + VESTIGE_EXPLORER + "'" + command + " 2> '" +
                                file("skipped.txt") + "')");
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  const auto lines = nlohmann::json::parse(outcome.text);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0]["view"], "front");
  // The other archive's own base, or its own picture, would be far off.
  EXPECT_GT(lines[0]["psnr"].get<double>(), 25.0);
  EXPECT_FALSE(lines[0].contains("missing"));
  EXPECT_EQ(lines[1]["view"], "side");
  EXPECT_TRUE(lines[1]["psnr"].is_null());
  EXPECT_NE(lines[1]["missing"].get<std::string>().find("has nothing of field 'density' in view "
                                                        "'side' at cycle 0"),
            std::string::npos);
  EXPECT_NE(contentOf(file("skipped.txt")).find("skipped: cycle 0, field 'density', view 'side'"),
            std::string::npos);
  writeOther(file("side.cdb"), {"side"});
  const Outcome nothing = explorer("compare " + archive() + " '" + file("side.cdb") + "'");
  EXPECT_EQ(nothing.code, 1);
  EXPECT_NE(nothing.text.find("nothing of both archives could be compared"), std::string::npos);
  const Outcome typo = explorer("compare " + archive() + " " + archive() + " --view frnt");
  EXPECT_EQ(typo.code, 1);
  EXPECT_NE(typo.text.find("has no view 'frnt' (did you mean 'front'?); there are: front"),
            std::string::npos)
      << typo.text;
}

TEST_F(Program, ChecksAndFindsDamage) {
  EXPECT_EQ(explorer("check " + archive()).code, 0);
  const std::filesystem::path copy = folder_->path() / "damaged.cdb";
  std::filesystem::copy(folder_->path() / "run.cdb", copy,
                        std::filesystem::copy_options::recursive);
  for (const auto& entry : std::filesystem::recursive_directory_iterator(copy)) {
    if (entry.path().extension() == ".exr") {
      std::filesystem::resize_file(entry.path(), std::filesystem::file_size(entry.path()) / 2);
      break;
    }
  }
  const Outcome outcome = explorer("check '" + copy.string() + "'");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.text.find(".exr"), std::string::npos) << outcome.text;
}

TEST_F(Program, ExportsNumbers) {
  const Outcome outcome =
      explorer("export " + archive() + " -o '" + file("numbers") + "' --step 10 --proxy length");
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  const std::string array = contentOf(file("numbers/10_front_density_length_length.npy"));
  EXPECT_EQ(array.substr(1, 5), "NUMPY");
  EXPECT_NE(array.find("'shape': (8,48,64,)"), std::string::npos);
  EXPECT_EQ(array.size() % 64, 0u);
  EXPECT_NE(contentOf(file("numbers/statistics.csv")).find("10,0.5,density,kg/m3,1000"),
            std::string::npos)
      << contentOf(file("numbers/statistics.csv"));
  EXPECT_NE(contentOf(file("numbers/histograms.csv")).find(",4\n"), std::string::npos);
  EXPECT_EQ(explorer("export " + archive() + " -o '" + file("x") + "' --field none").code, 1);
  // One line whatever is written; the manifest names the files.
  EXPECT_EQ(std::count(outcome.text.begin(), outcome.text.end(), '\n'), 1) << outcome.text;
  EXPECT_NE(outcome.text.find("manifest.json"), std::string::npos) << outcome.text;
  const auto manifest = nlohmann::json::parse(contentOf(file("numbers/manifest.json")));
  EXPECT_EQ(manifest["files"].size(), 6u);
  for (const auto& entry : manifest["files"]) {
    EXPECT_TRUE(std::filesystem::exists(file("numbers/" + entry["file"].get<std::string>())));
    EXPECT_FALSE(entry["channels"].empty());
  }
}

TEST_F(Program, ProbesAPixelOfThePictureThatTheSameOptionsRender) {
  const Outcome outcome = explorer("probe " + archive() + " --pixel 64,48 --size 128x96 --step 10");
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  for (const char* words :
       {"pixel 64,48 of 128 x 96", "length of density in view front, its pixel 32,24"})
    EXPECT_NE(outcome.text.find(words), std::string::npos) << outcome.text;
  const Outcome json = explorer("probe " + archive() + " --pixel 1,1 --rotate 20,0 --json");
  EXPECT_EQ(nlohmann::json::parse(json.text)["otherRays"].size(), 5u) << json.text;
  for (const char* pixel : {"-1,0", "64,48", "0.5,1", "nan,1", "3"}) {
    const Outcome bad = explorer("probe " + archive() + " --pixel=" + pixel);
    EXPECT_EQ(bad.code, 1) << pixel << bad.text;
  }
}

TEST_F(Program, MakesMoviesOverTimeAndOfATurn) {
  const Outcome time = explorer("movie " + archive() + " -o '" + file("time.mp4") + "' --fps 5");
  EXPECT_EQ(time.code, 0) << time.text;
  EXPECT_NE(time.text.find("3 frames"), std::string::npos);
  EXPECT_GT(std::filesystem::file_size(file("time.mp4")), 500u);
  const Outcome turn = explorer("movie " + archive() + " -o '" + file("turn.mp4") +
                                "' --turn 40 --frames 4 --size 63x47 --plain");
  EXPECT_EQ(turn.code, 0) << turn.text;
}

TEST_F(Program, LeavesAnEarlierMovieAloneWhenTheEncoderFails) {
  std::ofstream(file("bad.nonsense")) << "an earlier movie";
  const Outcome outcome = explorer("movie " + archive() + " -o '" + file("bad.nonsense") + "'");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.text.find("ffmpeg"), std::string::npos);
  EXPECT_EQ(std::filesystem::file_size(file("bad.nonsense")), 16u);
  EXPECT_FALSE(std::filesystem::exists(file("bad.part.nonsense")));
}

TEST_F(Program, LearnsColoursAndRendersWithThem) {
  const std::string path = file("learned.cdb"), quoted = "'" + path + "'";
  std::filesystem::copy(folder_->path() / "run.cdb", path,
                        std::filesystem::copy_options::recursive);
  const std::string look = " -o '" + file("learned.png") + "' --color learned --factors 1,1,.5,1,1";
  const Outcome early = explorer("render " + quoted + look);
  EXPECT_EQ(early.code, 1);
  EXPECT_NE(early.text.find("vestige-explorer train"), std::string::npos) << early.text;
  for (const char* clusters : {"8", "3"}) {
    const Outcome train = explorer("train " + quoted + " --every-step -k " + clusters);
    ASSERT_EQ(train.code, 0) << train.text;
    EXPECT_NE(train.text.find(std::string(clusters) + " clusters of length from 1 picture (unlit)"),
              std::string::npos)
        << train.text;
  }
  const Outcome render = explorer("render " + quoted + look + " -v --step 10");
  EXPECT_EQ(render.code, 0) << render.text;
  EXPECT_NE(render.text.find("uses learned: 3 clusters"), std::string::npos) << render.text;
  const Outcome check = explorer("check " + quoted);
  EXPECT_EQ(check.code, 0) << check.text;
  EXPECT_NE(check.text.find("18 rows, all sound"), std::string::npos) << check.text;
  const Outcome info = explorer("info " + quoted);
  EXPECT_NE(info.text.find("learned colours of density in view front, cycle 20: 3 clusters"),
            std::string::npos)
      << info.text;
}

TEST_F(Program, DrawsAClassifierAndChangesItsFeatures) {
  const std::string classifier = file("classifier.json");
  std::ofstream(classifier) << R"({"kind": "gaussian", "fields": ["density"], "primitives": [
    {"name": "shell", "center": [0.4], "width": [0.1], "opacity": 0.5, "color": "#ff8000"},
    {"name": "core", "center": [0.9], "width": [0.1], "opacity": 0.5, "color": "#0080ff"}]})";
  const std::string render =
      "render " + archive() + " --classifier '" + classifier + "' --size 32x24 -o '";
  const std::string look = file("shell.json");
  const Outcome whole = explorer(render + file("whole.png") + "'");
  EXPECT_EQ(whole.code, 0) << whole.text;
  const Outcome one = explorer(render + file("one.png") + "' --feature core:off --save-look '" +
                               look + "' --feature shell:opacity=0.9,color=#ffffff --colorbar");
  EXPECT_EQ(one.code, 0) << one.text;
  EXPECT_NE(contentOf(file("whole.png")), contentOf(file("one.png")));
  const Outcome again =
      explorer("render " + archive() + " --look '" + look + "' -o '" + file("again.png") + "'");
  EXPECT_EQ(again.code, 0) << again.text;
  EXPECT_EQ(contentOf(file("one.png")), contentOf(file("again.png")));
}

TEST_F(Program, FitsAPrimitiveToWhatIsBrushedOnASlice) {
  // density = x in [-1, 1]^3.
  FieldSamples field;
  for (FieldAxis& axis : field.axes) axis = {17, -1.0, 0.125, {}};
  field.low = -1.0;
  field.high = 1.0;
  for (int i = 0; i < 17 * 17 * 17; ++i) field.values.push_back(float(i % 17) / 16.0f);
  const std::string run = file("fields.cdb");
  ArchiveWriter writer(run, ExistingArchive::Refuse);
  writer.writeStep(std::vector<EncodedProxy>{encodeProxy(
      fieldImage(synthetic::header(kind::kField, {64, 64}), std::move(field), {1, 1e-5}))});
  const std::string into = file("fitted.json");
  // The front view looks along +y, right is +x: pixels 40 .. 56 of 64 lie right of the middle.
  const Outcome fit = explorer("fit '" + run + "' --fields density --slice 0,1,0,0 --size 64x64 " +
                               "--brush 48,32,4 --name right --into '" + into + "'");
  EXPECT_EQ(fit.code, 0) << fit.text;
  const auto fitted = nlohmann::json::parse(contentOf(into));
  const double center = fitted["primitives"][0]["center"][0];
  EXPECT_GT(center, 0.2);
  EXPECT_LT(center, 0.8);
  const Outcome box = explorer("fit '" + run + "' --fields density --region -1,-1,-1,-0.5,1,1 " +
                               "--name left --into '" + into + "'");
  EXPECT_EQ(box.code, 0) << box.text;
  const auto both = nlohmann::json::parse(contentOf(into));
  ASSERT_EQ(both["primitives"].size(), 2u);
  EXPECT_NEAR(both["primitives"][1]["center"][0].get<double>(), -0.75, 0.07);
  const Outcome drawn =
      explorer("render '" + run + "' --classifier '" + into + "' -o '" + file("fitted.png") + "'");
  EXPECT_EQ(drawn.code, 0) << drawn.text;
  const Outcome shown =
      explorer("fit '" + run + "' --fields density --slice 0,1,0,0 --size 64x64 " +
               "--brush 48,32,6 --picture '" + file("brush.png") + "'");
  EXPECT_EQ(shown.code, 0) << shown.text;
  const Outcome bare =
      explorer("render '" + run + "' --slice 0,1,0,0 --size 64x64 -o '" + file("bare.png") + "'");
  EXPECT_EQ(bare.code, 0) << bare.text;
  const Picture brushed = readPicture(file("brush.png")), slice = readPicture(file("bare.png"));
  const auto change = [&](int x, int y) {
    float most = 0.0f;
    for (int c = 0; c < 3; ++c)
      most = std::max(most, std::abs(brushed.pixel(x, y)[c] - slice.pixel(x, y)[c]));
    return most;
  };
  EXPECT_GT(change(54, 32), 0.2f) << "the rim of the brush";
  EXPECT_GT(change(48, 26), 0.2f);
  EXPECT_LT(change(48, 32), 0.01f) << "its middle";
  EXPECT_LT(change(20, 32), 0.01f) << "far from it";
  const Outcome nothing = explorer("fit '" + run + "' --fields density --region 5,5,5,6,6,6");
  EXPECT_EQ(nothing.code, 1);
  EXPECT_NE(nothing.text.find("nothing to fit"), std::string::npos) << nothing.text;
}

TEST_F(Program, FramesStretchesAndSurfacesAreOptionsAndKeysOfTheLook) {
  const std::string look = file("framed.json");
  const Outcome made =
      explorer("render " + archive() + " -o '" + file("framed.png") +
               "' --rotate 20,10 --fit --zoom 1.5 --pan 0.1,-0.2 --center 0.1,0,0 " +
               "--scale 1,1,2 --size 40x30 --save-look '" + look + "'");
  EXPECT_EQ(made.code, 0) << made.text;
  EXPECT_EQ(made.text, "") << "nothing to warn of";
  const auto keys = nlohmann::json::parse(contentOf(look));
  EXPECT_EQ(keys["frame"], "fit");
  EXPECT_EQ(keys["zoom"], 1.5);
  EXPECT_EQ(keys["scale"], (nlohmann::json{1.0, 1.0, 2.0}));
  const Outcome again = explorer("render " + archive() + " --look '" + look + "' -o '" +
                                 file("framed_again.png") + "'");
  EXPECT_EQ(again.code, 0) << again.text;
  EXPECT_EQ(contentOf(file("framed.png")), contentOf(file("framed_again.png")));
  const Outcome both = explorer("render " + archive() + " -o x.png --fit --frame orbit");
  EXPECT_EQ(both.code, 2) << both.text;
}

TEST_F(Program, WarnsOnStandardErrorOfWhatALookAsksForInVain) {
  const std::string render = "render " + archive() + " -o '" + file("vain.png") + "' ";
  const Outcome time = explorer(render + "--time 1e9");
  EXPECT_EQ(time.code, 0) << time.text;
  EXPECT_NE(time.text.find("warning: no step is stored at time 1×10⁹"), std::string::npos)
      << time.text;
  const Outcome reference = explorer(render + "--source reference --colormap grey --ao");
  EXPECT_EQ(reference.code, 0) << reference.text;
  for (const char* key : {"'colormap' has no effect", "'ao' has no effect"})
    EXPECT_NE(reference.text.find(key), std::string::npos) << reference.text;
}

TEST_F(Program, FitsNoFeatureNarrowerThanWhatIsStored) {
  // A plateau at 0.5, stored to 0.25.
  FieldSamples field;
  for (FieldAxis& axis : field.axes) axis = {17, -1.0, 0.125, {}};
  field.low = -1.0;
  field.high = 1.0;
  for (int i = 0; i < 17 * 17 * 17; ++i)
    field.values.push_back(i % 17 < 8 ? float(i % 17) / 16.0f : 0.75f);
  const std::string run = file("plateau.cdb");
  ArchiveWriter(run, ExistingArchive::Refuse)
      .writeStep(std::vector<EncodedProxy>{encodeProxy(
          fieldImage(synthetic::header(kind::kField, {64, 64}), std::move(field), {1, 0.25}))});
  const std::string into = file("plateau.json");
  const Outcome fit = explorer("fit '" + run + "' --fields density --region 0.5,-1,-1,1,1,1 " +
                               "--into '" + into + "'");
  EXPECT_EQ(fit.code, 0) << fit.text;
  EXPECT_NE(fit.text.find("the tolerance of the stored field, 0.25"), std::string::npos)
      << fit.text;
  const auto fitted = nlohmann::json::parse(contentOf(into));
  EXPECT_NEAR(fitted["primitives"][0]["width"][0].get<double>(), 0.25, 1e-9);
}

TEST_F(Program, RefusesLooksThatAreDeepEndlessOrBeyond64Bits) {
  const std::string render = "render " + archive() + " -o '" + file("hostile.png") + "' ";
  const auto refuses = [&](const std::string& options, const std::string& part) {
    const Outcome refused = explorer(render + options);
    EXPECT_EQ(refused.code, 1) << refused.text;
    EXPECT_NE(refused.text.find(part), std::string::npos) << refused.text.substr(0, 400);
  };
  const std::string deep = file("deep.json");
  std::ofstream(deep) << std::string(200000, '[') + std::string(200000, ']');
  for (const char* option : {"--look '", "--classifier '", "--customize '"})
    refuses(option + deep + "'", "nested deeper than 64 levels");
  refuses("--look /dev/zero", "no regular file");
  std::ofstream(deep) << R"({"cycle": 18446744073709551615})";
  refuses("--look '" + deep + "'", "18446744073709551615");
  std::ofstream(deep) << R"({"zoom": 1e999})";
  refuses("--look '" + deep + "'", "out of range");
  refuses("--size 4294967360x64", "4294967360x64");
}

TEST_F(Program, SaysWhenItsOutputIsLost) {
  const Outcome lost =
      shell(std::string("('") + VESTIGE_EXPLORER + "' info " + archive() + " >/dev/full)");
  EXPECT_EQ(lost.code, 1);
  EXPECT_NE(lost.text.find("standard output could not be written"), std::string::npos) << lost.text;
}

TEST_F(Program, NamesWhatCannotBeCompared) {
  const Outcome missing = explorer("compare " + archive() + " /nonexistent.cdb");
  EXPECT_EQ(missing.code, 1);
  EXPECT_NE(missing.text.find("'/nonexistent.cdb' does not exist"), std::string::npos)
      << missing.text;
  const Outcome mixed = explorer("compare " + archive() + " /dev/null");
  EXPECT_NE(mixed.text.find("'/dev/null' is not"), std::string::npos) << mixed.text;
  const std::string folder = file("nothing");
  std::filesystem::create_directory(folder);
  const Outcome repaired = explorer("check '" + folder + "' --repair");
  EXPECT_EQ(repaired.code, 1);
  EXPECT_NE(repaired.text.find("is no archive"), std::string::npos) << repaired.text;
  EXPECT_TRUE(std::filesystem::is_empty(folder));
}

TEST_F(Program, TellsErrorsFromWrongCommandLines) {
  const auto says = [](const std::string& arguments, int code, const char* word) {
    const Outcome outcome = explorer(arguments);
    EXPECT_EQ(outcome.code, code) << arguments << "\n" << outcome.text;
    EXPECT_NE(outcome.text.find(word), std::string::npos) << outcome.text;
  };
  says("render", 2, "archive");
  says("paint", 2, "'paint'");
  says("paint render " + archive(), 2, "'paint'");
  says("info /nowhere.cdb", 1, "/nowhere.cdb");
  says("render " + archive() + " -o x.tiff", 1, ".png or .exr");
  says("render " + archive() + " -o x.png --step 7", 1, "0, 10, 20");
  says("render " + archive() + " -o x.png --factors 1,b", 1, "'b'");
  says("render " + archive() + " -o x.png --size 10", 1, "--size");
  says("render " + archive() + " -o x.png --colormap mauve", 1, "viridis");
  says("render " + archive() + " -o x.png --look /nowhere.json", 1, "/nowhere.json");
  says("render " + archive() + " -o /nowhere/x.png", 1, "/nowhere/x.png");
  says("render --light 1,2 --light -3,4,5,6 " + archive() + " -o x.png", 1, "2 to 3");
  says("render " + archive() + " -o x.png --look /", 1, "'/' cannot be read");
  says("render " + archive() + " -o x.png --background '#+1+2+3'", 1, "'#+1+2+3'");
  says("movie " + archive() + " -o x.mp4 --fps 0", 1, "0 frames a second");
  says("movie " + archive() + " -o x.mp4 --step 10", 1, "--step");
  says("movie " + archive() + " -o x.mp4 --frames 3", 2, "--turn");
  says("compare /nowhere.png /neither.png", 1, "/nowhere.png");
  says("export " + archive() + " -o x --proxy nope", 1, "'nope'");
  says("render " + archive() + " -o x.png --classifier /nowhere.json", 1, "/nowhere.json");
  says("render " + archive() + " -o x.png --feature shell", 1, "'shell'");
  says("render " + archive() + " -o x.png --feature shell:size=2", 1, "'size=2'");
  says("render " + archive() + " -o x.png --feature shell:off", 1, "'features'");
  says("fit " + archive() + " --fields density --region 0,0,0,1,1,1", 1, "'density'");
  says("fit " + archive() + " --fields a,b,c,d,e --region 0,0,0,1,1,1", 1, "1 to 4");
  says("fit " + archive() + " --region 0,0,0,1,1,1", 2, "--fields");
  says("train /nowhere.cdb", 1, "'/nowhere.cdb' does not exist");
  says("train " + archive() + " -k 0", 2, "--clusters");
  says("train " + archive() + " --step 7", 1, "0, 10, 20");
  says("train " + archive() + " --view side", 1, "'side'");
  says("train " + archive() + " --from sliced", 1, "no sliced proxy");
  says("check /nowhere.cdb", 1, "'/nowhere.cdb' is no folder");
}

TEST_F(Program, SaysWhatWasMeant) {
  const auto says = [](const std::string& arguments, const char* words) {
    const Outcome outcome = explorer(arguments);
    EXPECT_NE(outcome.code, 0);
    EXPECT_NE(outcome.text.find(words), std::string::npos) << outcome.text;
  };
  says("rendr " + archive(), "(did you mean 'render'?)");
  says("render " + archive() + " -o x.png --colrmap hot", "did you mean --colormap?");
  says("render " + archive() + " -o x.png --view fornt", "(did you mean 'front'?)");
  says("render " + archive() + " -o x.png --field densty", "(did you mean 'density'?)");
  says("export " + archive() + " -o x --proxy lenght", "(did you mean 'length'?)");
  std::ofstream(file("typo.json")) << R"({"colormpa": "hot"})";
  says("render " + archive() + " -o x.png --look '" + file("typo.json") + "'",
       "(did you mean 'colormap'?)");
}

TEST_F(Program, GroupsItsHelp) {
  const Outcome commands = explorer("--help");
  for (const char* words : {"Pictures:", "Numbers:", "Health:", "colormaps"})
    EXPECT_NE(commands.text.find(words), std::string::npos) << commands.text;
  const Outcome options = explorer("render --help");
  for (const char* words : {"Opacity and colour:", "Light:", "Annotations:", "viridis"})
    EXPECT_NE(options.text.find(words), std::string::npos) << options.text;
  EXPECT_EQ(options.text.find("\nLook:"), std::string::npos)
      << "an option of looks that help_groups.cpp does not name\n"
      << options.text;
}

TEST_F(Program, ListsAndDrawsTheColourMaps) {
  const Outcome outcome = explorer("colormaps -o '" + file("maps.png") + "'");
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  const auto names = Colormap::names();
  EXPECT_EQ(std::size_t(std::count(outcome.text.begin(), outcome.text.end(), '\n')), names.size());
  const Picture picture = readPicture(file("maps.png"));
  EXPECT_GT(picture.size.height, int(names.size()) * 15);
  // The last column of bars holds the end of each map, in order.
  std::size_t found = 0;
  for (int y = 0; y < picture.size.height && found < names.size(); ++y) {
    const float* pixel = picture.pixel(picture.size.width - 13, y);
    const glm::dvec3 end = Colormap::named(names[found]).at(1.0);
    if (glm::length(glm::dvec3(pixel[0], pixel[1], pixel[2]) - end) < 0.02) ++found;
  }
  EXPECT_EQ(found, names.size());
}

TEST_F(Program, WorksOnAnArchiveThatStandsAloneInAnEmptyFolder) {
  synthetic::TemporaryFolder alone;
  std::filesystem::copy(folder_->path() / "run.cdb", alone.path() / "run.cdb",
                        std::filesystem::copy_options::recursive);
  const Outcome outcome =
      shell("cd '" + alone.path().string() + "' && env -i PATH=/usr/bin:/bin '" + VESTIGE_EXPLORER +
            "' render run.cdb -o out.png --factors 1,0,2,1,1");
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_TRUE(std::filesystem::exists(alone.path() / "out.png"));
}

TEST_F(Program, SaysInDoctorThatAPictureCanBeMade) {
  const Outcome outcome = explorer("doctor");
  EXPECT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_NE(outcome.text.find("self-test picture right"), std::string::npos);
}

TEST(Reach, TheProgramLinksNeitherAdaptorNorVtk) {
  const Outcome libraries = shell(std::string("ldd '") + VESTIGE_EXPLORER + "'");
  ASSERT_EQ(libraries.code, 0) << libraries.text;
  ASSERT_NE(libraries.text.find("libc.so"), std::string::npos);
  EXPECT_EQ(libraries.text.find("vtk"), std::string::npos) << libraries.text;
  EXPECT_EQ(libraries.text.find("adaptor"), std::string::npos) << libraries.text;
  // Whatever was linked statically shows by its symbols.
  const Outcome symbols = shell(std::string("nm -C '") + VESTIGE_EXPLORER + "'");
  ASSERT_EQ(symbols.code, 0);
  ASSERT_NE(symbols.text.find("vestige::Renderer::render"), std::string::npos);
  for (const char* name : {"vestige::Marcher", " vestige_open", " vestige_execute", "vtkDataSet"}) {
    EXPECT_EQ(symbols.text.find(name), std::string::npos) << name;
  }
}

TEST(Reach, NoSourceOfTheExplorerIncludesAdaptorOrVtk) {
  const std::regex forbidden("#\\s*include\\s*[<\"](adaptor/|vtk|mini-sim/)");
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(VESTIGE_EXPLORER_SOURCE)) {
    const auto extension = entry.path().extension();
    if (extension != ".h" && extension != ".cpp") continue;
    ++files;
    EXPECT_FALSE(std::regex_search(contentOf(entry.path()), forbidden)) << entry.path();
  }
  EXPECT_GT(files, 20);
}

}  // namespace
}  // namespace vestige
