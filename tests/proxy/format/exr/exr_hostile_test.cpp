// SPDX-License-Identifier: BSD-3-Clause
// Hostile EXR files: whatever their bytes claim, reading gives a picture or a
// sentence, soon and within bounded memory.
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "tests/proxy/archive/archive_fixture.h"
#include "exr_surgeon.h"
#include "tests/proxy/archive/hostile.h"

namespace vestige {
namespace {

using namespace vestige::test;
constexpr int kMost = std::numeric_limits<int>::max(), kLeast = std::numeric_limits<int>::min();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::string encoded(const ProxyImage& image) {
  const std::vector<std::byte> bytes = encodeExr(image);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

class HostileExr : public testing::Test {
 protected:
  static void SetUpTestSuite() { setExrThreads(0); }  // tests fork

  Folder folder_;
  const fs::path file_ = folder_ / "some.exr";

  /// Reads everything in a file of these bytes; of what became a huge picture the headers, to be
  /// fast (memory has a test of its own).
  std::string reaction(const std::string& bytes, bool mustRefuse) const {
    replaceFile(file_, bytes);
    return complaint(
        file_,
        [&] {
          const ExrFile exr(file_);
          if (exr.header().size.pixels() < 1000000) exr.image();
        },
        mustRefuse);
  }
  void expectRefused(const std::string& what, const std::string& bytes) const {
    EXPECT_EQ(contained([&] { return reaction(bytes, true); }), "") << what;
  }
};

TEST_F(HostileExr, TruncationAnywhereIsRefused) {
  for (const ProxyImage& image : someImages(someHeader())) {
    const std::string whole = encoded(image);
    EXPECT_EQ(reaction(whole, false), "");
    EXPECT_EQ(contained([&] {
                for (std::size_t size = 0; size < whole.size(); size += 64) {
                  const std::string wrong = reaction(whole.substr(0, size), true);
                  if (!wrong.empty()) return std::to_string(size) + " bytes: " + wrong;
                }
                return reaction(whole.substr(0, whole.size() - 1), true);
              }),
              "")
        << image.header.kind;
  }
}

TEST_F(HostileExr, FlippedBitsNeverCrash) {
  std::mt19937 engine(1);
  for (const ProxyImage& image : someImages(someHeader({12, 10}))) {
    const std::string whole = encoded(image);
    EXPECT_EQ(contained([&]() -> std::string {
                for (std::size_t at = engine() % 3; at < whole.size(); at += 1 + engine() % 5) {
                  std::string bytes = whole;
                  bytes[at] = char(bytes[at] ^ (1 << engine() % 8));
                  if (engine() % 4 == 0) bytes[engine() % bytes.size()] = char(engine());
                  const std::string wrong = reaction(bytes, false);
                  if (!wrong.empty()) return "byte " + std::to_string(at) + ": " + wrong;
                }
                return {};
              }),
              "")
        << image.header.kind;
  }
}

TEST_F(HostileExr, GarbageInNumbersNeverCrashes) {
  std::mt19937 engine(2);
  const std::int32_t odd[] = {0, -1, 1, 255, 65536, kMost, kLeast, 0x7f7f7f7f, 0x01000000};
  const std::string whole = encoded(someImages(someHeader({12, 10}))[1]);
  EXPECT_EQ(contained([&]() -> std::string {
              for (int i = 0; i < 4000; ++i) {
                std::string bytes = whole;
                const std::size_t at = engine() % (bytes.size() - 4);
                bytes.replace(at, 4, ExrSurgeon::number(odd[engine() % std::size(odd)]));
                const std::string wrong = reaction(bytes, false);
                if (!wrong.empty()) return "at " + std::to_string(at) + ": " + wrong;
              }
              return {};
            }),
            "");
}

TEST_F(HostileExr, AbsurdClaimsOfTheContainerAreRefused) {
  const ExrSurgeon sound(encoded(someImages(someHeader())[1]));
  ASSERT_EQ(reaction(sound.bytes(), true), "accepts it");
  const auto n = [](auto... numbers) { return ExrSurgeon::number(numbers...); };
  struct Claim {
    const char* attribute;
    std::string value;
  };
  const Claim claims[] = {{"dataWindow", n(0, 0, kMost, kMost)},
                          {"dataWindow", n(kLeast, kLeast, kMost, kMost)},
                          {"dataWindow", n(-1, 0, 39, 29)},
                          {"dataWindow", n(5, 5, 4, 4)},
                          {"dataWindow", n(0, 0, 40, 29)},
                          {"dataWindow", n(0, 0)},
                          {"displayWindow", n(0, 0, kMost, kMost)},
                          {"displayWindow", n(0, 0, 32768, 29)},
                          {"displayWindow", n(0, 0, -1, -1)},
                          {"displayWindow", n(kLeast, 0, kMost, 29)},
                          {"displayWindow", n(0, 0, 32767, 32767)},
                          {"chunkCount", n(kMost)},
                          {"chunkCount", n(-1)},
                          {"chunkCount", n(0)},
                          {"compression", std::string(1, char(4))},
                          {"compression", std::string(1, char(255))},
                          {"lineOrder", std::string(1, char(77))},
                          {"type", "deepscanline"},
                          {"type", "tiledimage"},
                          {"channels", std::string(1, '\0')},
                          {"channels", "x" + n(std::int8_t(0), 1, 0, 1 << 30, 1) + '\0'},
                          {"channels", "x" + n(std::int8_t(0), 77, 0, 1, 1) + '\0'},
                          {"channels", "x" + n(std::int8_t(0), 1, 0, 0, 0) + '\0'},
                          {"channels", "endless"},
                          {"name", ""},
                          {"vestige:unit", "half"},
                          {"vestige:unit", n(0.0)},
                          {"vestige:zero", n(kNaN)}};
  for (const Claim& claim : claims) {
    ExrSurgeon exr = sound;
    exr.everywhere(claim.attribute, claim.value);
    expectRefused(std::string(claim.attribute) + " in all parts", exr.bytes());
    exr = sound;
    exr.value(claim.attribute, 2) = claim.value;
    expectRefused(std::string(claim.attribute) + " in the last part", exr.bytes());
  }
}

TEST_F(HostileExr, AbsurdCustomisationsAreRefused) {
  ProxyImage image = someImages(someHeader())[0];
  image.header.customization.emplace().corners[0].opacity = 2.0;
  const ExrSurgeon sound(encoded(image));
  ASSERT_EQ(reaction(sound.bytes(), true), "accepts it");
  const std::string deep(100000, '[');
  for (const std::string& value :
       {std::string("{"), std::string("[]"), std::string("7"), deep,
        std::string(R"({"resolution": 1e9})"), std::string(R"({"resolution": -1})"),
        std::string(R"({"metric": "taxi"})"), std::string(R"({"corners": [{}]})"),
        std::string(R"({"corners": [7, {}, {}, {}, {}, {}, {}, {}]})"),
        std::string(R"({"corners": {"gamma": 0}})"), std::string(R"({"corners": {"gama": 1}})"),
        std::string(R"({"corners": {"opacity": 1e999}})"),
        std::string(R"({"corners": {"opacity": -1}})"),
        std::string(R"({"corners": {"shift": [0, 0]}})"),
        std::string(R"({"seeds": [{"opacity": 2}]})"),
        std::string(R"({"seeds": [{"position": [99, 0, 0]}]})"),
        std::string(R"({"seeds": [{"position": [1e300, 1e300, 1e300], "extent": [-1, 0, 0]}]})")}) {
    ExrSurgeon exr = sound;
    exr.everywhere("vestige:customization", value);
    expectRefused(value.substr(0, 60), exr.bytes());
  }
}

TEST_F(HostileExr, PartsOfDifferentPicturesAreRefused) {
  ExrSurgeon exr(encoded(someImages(someHeader())[1]));
  exr.value("displayWindow", 1) = ExrSurgeon::number(0, 0, 79, 59);
  expectRefused("a larger second part", exr.bytes());
  exr.value("displayWindow", 1) = exr.value("displayWindow", 0);
  exr.value("name", 1) = exr.value("name", 0);
  expectRefused("two parts of one name", exr.bytes());
}

TEST_F(HostileExr, OversizedAttributesAndListsAreRefused) {
  const std::string whole = encoded(someImages(someHeader())[3]);
  for (const std::uint32_t size : {0xffffffffu, 0x7fffffffu, 0x01000001u, 100000u}) {
    std::string bytes = whole;
    const std::size_t at = bytes.find(std::string("comments\0string\0", 16)) + 16;
    bytes.replace(at, 4, ExrSurgeon::number(size));
    expectRefused("an attribute's size", bytes);
  }
  ExrSurgeon exr(whole);
  for (int i = 0; i < 1000000; ++i) exr.headers[0].push_back({std::to_string(i), "int", "1234"});
  expectRefused("a million attributes", exr.bytes());
  exr = ExrSurgeon(encoded(someImages(someHeader())[1]));
  exr.headers.resize(5000, exr.headers[0]);
  for (std::size_t i = 0; i < exr.headers.size(); ++i) exr.value("name", i) = std::to_string(i);
  expectRefused("five thousand parts", exr.bytes());
  exr = ExrSurgeon(whole);
  exr.headers[0].push_back({std::string(300, 'n'), "int", "1234"});
  expectRefused("a long name", exr.bytes());
  exr = ExrSurgeon(whole);
  exr.headers[0].push_back(exr.headers[0].back());
  expectRefused("an attribute twice", exr.bytes());
}

TEST_F(HostileExr, AttributesWhoseSizeIsNotTheirTypesAreRefused) {
  const ExrSurgeon sound(encoded(someImages(someHeader())[3]));
  // A reader that goes by types instead of sizes would take what follows for attributes.
  for (const char* type : {"int", "double", "float", "v3d", "m44f", "box2i", "stringvector",
                           "floatvector", "preview", "idmanifest", "chlist", "tiledesc", "opaque"})
    for (const std::size_t size : {0u, 3u, 400u}) {
      ExrSurgeon exr = sound;
      exr.headers[0].insert(exr.headers[0].begin(), {"hidden", type, std::string(size, '\1')});
      expectRefused(std::string(type) + " of " + std::to_string(size), exr.bytes());
    }
  ExrSurgeon exr = sound;
  exr.value("channels") += "more";
  expectRefused("bytes after the channels", exr.bytes());
  exr = sound;
  for (ExrSurgeon::Attribute& a : exr.headers[0])
    if (a.name == "type") a.value = "deepscanline";
  expectRefused("one deep part", exr.bytes());
}

TEST_F(HostileExr, AbsurdDescriptionsAreRefused) {
  const ExrSurgeon sound(encoded(someImages(someHeader())[1]));
  const auto n = [](auto... numbers) { return ExrSurgeon::number(numbers...); };
  const auto repeated = [](const std::string& word, int count) {
    std::string out;
    for (int i = 0; i < count; ++i) out += word;
    return out;
  };
  struct Claim {
    const char* attribute;
    std::string value;
  };
  const Claim claims[] = {
      {"vestige:schema", n(99)},
      {"vestige:schema", n(-1)},
      {"vestige:cycle", "1e5"},
      {"vestige:cycle", "99999999999999999999"},
      {"vestige:time", n(kNaN)},
      {"vestige:projection", "fisheye"},
      {"vestige:position", n(kNaN, 0.0, 0.0)},
      {"vestige:forward", n(0.0, 0.0, 0.0)},
      {"vestige:viewHeight", n(-1.0)},
      {"vestige:pixelAspect", n(0.0)},
      {"vestige:farDepth", n(-1e300)},
      {"vestige:domainLow", n(kNaN, kNaN, kNaN)},
      {"vestige:domainHigh", n(-1e9, -1e9, -1e9)},
      {"vestige:bounds", "[1,0]"},
      {"vestige:bounds", "[0,1e999]"},
      {"vestige:bounds", "[[0],1]"},
      {"vestige:bounds", "[" + repeated("1,", 1000000) + "2]"},
      {"vestige:bounds", repeated("[", 1000000)},
      {"vestige:isovalues", "[" + repeated("1,", 1000000) + "2]"},
      {"vestige:isovalues", "{}"},
      {"vestige:statistics", repeated("[", 1000000) + repeated("]", 1000000)},
      {"vestige:statistics", repeated("{\"count\":", 300000) + "1" + repeated("}", 300000)},
      {"vestige:statistics", "null"},
      {"vestige:statistics", "{\"count\":-1}"},
      {"vestige:baseTransferFunction", "{\"opacity\":" + repeated("[", 300000) + "}"},
      {"vestige:baseTransferFunction", "\xff\xfe"},
  };
  for (const Claim& claim : claims) {
    ExrSurgeon exr = sound;
    exr.value(claim.attribute) = claim.value;
    expectRefused(std::string(claim.attribute) + " " + claim.value.substr(0, 20), exr.bytes());
  }
  {
    // A multi-perspective picture of which nobody says how its rays converge.
    ExrSurgeon exr = sound;
    exr.value("vestige:projection") = "multi-perspective";
    expectRefused("no convergence", exr.bytes());
    ProxyHeader header = someHeader();
    header.camera = frameBoxDistorted(header.domain, {0, 1, 0}, {0, 0, 1}, 1.0);
    const ExrSurgeon distorted(encoded(someImages(header)[1]));
    for (const double value : {0.0, -1.0, 1e-300, 1e300, kNaN}) {
      ExrSurgeon claim = distorted;
      claim.value("vestige:convergence") = n(value);
      expectRefused("a convergence of " + std::to_string(value), claim.bytes());
    }
  }
  for (const Claim& claim : {Claim{"vestige:channels", repeated("a:half ", 100000)},
                             {"vestige:channels", "i00"},
                             {"vestige:channels", "nothing:half"},
                             {"vestige:channels", repeated("i00:half ", 1000)},
                             {"vestige:constantChannels", repeated("nodata=1 ", 1000000)},
                             {"vestige:constantChannels", "nowhere=1"},
                             {"vestige:constantChannels", "nodata=one"}})
    for (std::size_t part = 0; part < sound.headers.size(); ++part) {
      ExrSurgeon exr = sound;
      exr.value(claim.attribute, part) = claim.value;
      expectRefused(std::string(claim.attribute) + " " + claim.value.substr(0, 20), exr.bytes());
    }
}

TEST_F(HostileExr, ChunksThatAreNotWhereTheTableSaysNeverCrash) {
  const ExrSurgeon sound(encoded(someImages(someHeader())[1]));
  std::mt19937_64 engine(3);
  EXPECT_EQ(contained([&]() -> std::string {
              for (int i = 0; i < 1500; ++i) {
                ExrSurgeon exr = sound;
                std::uint64_t& offset = exr.offsets[engine() % exr.offsets.size()];
                const std::uint64_t odd[] = {0,
                                             1,
                                             8,
                                             exr.offsets[engine() % exr.offsets.size()],
                                             offset + engine() % 9 - 4,
                                             ~std::uint64_t(0),
                                             std::uint64_t(1) << 63,
                                             std::uint64_t(1) << 40,
                                             engine()};
                offset = odd[engine() % std::size(odd)];
                // Part number, line and size stand at the head of a chunk.
                if (i % 2) {
                  const std::uint64_t chunk =
                      sound.offsets[engine() % sound.offsets.size()] - sound.offsets[0];
                  exr.chunks.replace(chunk + 4 * (engine() % 3), 4,
                                     ExrSurgeon::number(std::int32_t(engine())));
                }
                const std::string wrong = reaction(exr.bytes(), false);
                if (!wrong.empty()) return std::to_string(i) + ": " + wrong;
              }
              return {};
            }),
            "");
}

TEST_F(HostileExr, AHugePictureInASmallFileTakesBoundedMemory) {
  for (const ProxyImage& image : someImages(someHeader()))
    for (const int side : {1000, 4000, 9000, 16000, 20000, 23000, 32768}) {
      ExrSurgeon exr(encoded(image));
      exr.everywhere("displayWindow", ExrSurgeon::number(0, 0, side - 1, side - 1));
      replaceFile(file_, exr.bytes());
      EXPECT_EQ(contained([&] {
                  return complaint(
                      file_, [&] { ExrFile opened(file_); }, side > 20000);
                }),
                "")
          << image.header.kind << " " << side;
      EXPECT_EQ(contained([&] { return complaint(file_, [&] { ExrFile(file_).image(); }); }), "")
          << image.header.kind << " " << side;
    }
}

TEST_F(HostileExr, OneVeryWideLineTakesBoundedMemory) {
  ExrSurgeon exr(encoded(someImages(someHeader())[3]));
  std::string channels;
  for (int i = 0; i < 4096; ++i)
    channels +=
        (i == 0 ? "value" : "x" + std::to_string(i)) + '\0' + ExrSurgeon::number(2, 0, 1, 1);
  exr.value("channels") = channels + '\0';
  exr.value("displayWindow") = exr.value("dataWindow") = ExrSurgeon::number(0, 0, 32767, 0);
  exr.value("comments") = std::string(1000000, 'x');
  exr.offsets.resize(1);
  expectRefused("half a gigabyte a line", exr.bytes());
}

TEST_F(HostileExr, AHoleDoesNotMakeAFileLarge) {
  ExrSurgeon exr(encoded(someImages(someHeader())[1]));
  exr.everywhere("displayWindow", ExrSurgeon::number(0, 0, 32767, 32767));
  replaceFile(file_, exr.bytes());
  ASSERT_EQ(::truncate(file_.c_str(), off_t(1) << 40), 0);
  EXPECT_EQ(contained([&] {
              return complaint(
                  file_, [&] { ExrFile(file_).image(); }, true);
            }),
            "");
}

}  // namespace
}  // namespace vestige
