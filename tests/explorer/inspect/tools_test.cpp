// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "explorer/annotation/annotate.h"
#include "explorer/annotation/text.h"
#include "explorer/annotation/ticks.h"
#include "explorer/export/export.h"
#include "explorer/export/movie.h"
#include "explorer/export/subprocess.h"
#include "explorer/inspect/info.h"
#include "explorer/layers/layers.h"
#include "explorer/picture/picture.h"
#include "explorer/picture/printable.h"
#include "explorer/picture/trust.h"
#include "proxy/archive/archive.h"
#include "proxy/base/error.h"
#include "proxy/base/parallel.h"
#include "tests/explorer/synthetic.h"

namespace vestige {
namespace {

ErrorCode codeOf(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.code();
  }
  ADD_FAILURE() << "nothing was thrown";
  return ErrorCode::Internal;
}

TEST(Info, SaysWhichCyclesWereMadeHow) {
  const synthetic::TemporaryFolder folder;
  const auto madeBy = [&](const std::vector<std::string>& provenances) {
    const auto path = folder.path() / ("a" + std::to_string(provenances.size()) + ".cdb");
    ArchiveWriter writer(path, ExistingArchive::Refuse);
    long cycle = 10;
    for (const std::string& text : provenances) {
      ProxyImage image = synthetic::mipProxy({4, 4});
      image.header.cycle = cycle++;
      image.header.provenance = text;
      writer.writeStep({encodeProxy(image)});
    }
    return infoText(archiveInfo(Archive(path)));
  };
  EXPECT_NE(madeBy({"x"}).find("\n  made by x\n"), std::string::npos);
  const std::string two = madeBy({"x; level 1", "x; level 1", "x; level 2"});
  EXPECT_NE(two.find("\n  cycles 10 to 11 made by x; level 1\n  cycle 12 made by x; level 2\n"),
            std::string::npos)
      << two;
  const std::string many = madeBy({"0", "1", "2", "3", "4", "5", "6", "7", "8", "9"});
  EXPECT_NE(many.find("made by 3\n  ... 2 more changes\n  cycle 16 made by 6\n"), std::string::npos)
      << many;
  EXPECT_EQ(madeBy({"", ""}).find("made by"), std::string::npos);
  // A file that is damaged does not keep the others from being listed.
  const auto path = folder.path() / "a3.cdb";
  std::filesystem::resize_file(path / Archive(path).rows()[1].exr, 40);
  const std::string damaged = infoText(archiveInfo(Archive(path)));
  EXPECT_NE(damaged.find("cycle 11 made by what cannot be read: "), std::string::npos) << damaged;
  EXPECT_NE(damaged.find("cycle 12 made by x; level 2"), std::string::npos) << damaged;
}

TEST(Info, SaysHowMuchIsOutsideOfTheIntervalsUnlessItIsRounding) {
  const synthetic::TemporaryFolder folder;
  const auto saidOf = [&](const std::string& name, double beyond) {
    ProxyImage image = synthetic::lengthProxy({4, 4});
    const IntervalPartition& intervals = *image.header.partition;
    FieldStatistics& statistics = image.header.statistics;
    statistics.count = 100;
    statistics.noData = statistics.above = 0;
    statistics.below = 5;
    statistics.low = intervals.low() - beyond * (intervals.high() - intervals.low());
    statistics.high = intervals.high();
    const auto path = folder.path() / name;
    ArchiveWriter(path, ExistingArchive::Refuse).writeStep({encodeProxy(image)});
    return infoText(archiveInfo(Archive(path)));
  };
  const std::string outside = saidOf("outside.cdb", 0.01);
  EXPECT_NE(outside.find("5 % below, 0 % above"), std::string::npos) << outside;
  const std::string rounded = saidOf("rounded.cdb", 1e-7);
  EXPECT_EQ(rounded.find("outside of the intervals"), std::string::npos) << rounded;
}

TEST(Info, NamesDamagedFilesAndGoesOn) {
  const synthetic::TemporaryFolder folder;
  const auto path = folder.path() / "a.cdb";
  {
    ArchiveWriter writer(path, ExistingArchive::Refuse);
    for (long cycle = 0; cycle < 3; ++cycle) {
      std::vector<EncodedProxy> step;
      for (ProxyImage image : {synthetic::lengthProxy({4, 4}), synthetic::mipProxy({4, 4})}) {
        image.header.cycle = cycle;
        step.push_back(encodeProxy(image));
      }
      writer.writeStep(step);
    }
  }
  const auto rows = Archive(path).rows();
  // The first and the last, of which views and the domain are read.
  for (const std::size_t row : {std::size_t(0), rows.size() - 1})
    std::filesystem::resize_file(path / rows[row].exr, 40);
  const nlohmann::json info = archiveInfo(Archive(path));
  EXPECT_EQ(info["views"].size(), 1u);
  EXPECT_EQ(info["fields"].size(), 1u);
  EXPECT_TRUE(info.contains("domain"));
  const std::string text = infoText(info);
  for (const std::size_t row : {std::size_t(0), rows.size() - 1})
    EXPECT_NE(text.find("damaged: " + rows[row].exr + ": "), std::string::npos) << text;
  EXPECT_NE(text.find("`vestige-explorer check`"), std::string::npos) << text;
  // Nothing can be read at all.
  for (const ArchiveRow& row : rows) std::filesystem::resize_file(path / row.exr, 40);
  EXPECT_NE(infoText(archiveInfo(Archive(path))).find("damaged: "), std::string::npos);
}

TEST(Printable, ShowsControlCharactersAndKeepsEverythingElse) {
  EXPECT_EQ(printable("m/s \xc2\xb0\x43 \xe2\x88\x92\n\tx"), "m/s \xc2\xb0\x43 \xe2\x88\x92\n\tx");
  EXPECT_EQ(printable("\x1b[31mK\r\x7f\xc2\x9b"), "\\x1b[31mK\\x0d\\x7f\\x9b");
  EXPECT_EQ(printable(std::string("a\0b\xc2", 4)), "a\\x00b\xc2");
}

TEST(Csv, WritesNumbersThatReadBackAndQuotesText) {
  EXPECT_EQ(std::stod(csvNumber(0.1)), 0.1);
  EXPECT_EQ(csvNumber(std::numeric_limits<double>::infinity()), "inf");
  EXPECT_EQ(csvText("plain"), "plain");
  EXPECT_EQ(csvText("a,\"b\""), "\"a,\"\"b\"\"\"");
}

TEST(Ticks, AreRoundInsideTheRangeAndEquallySpaced) {
  for (const auto& [low, high] : std::vector<std::pair<double, double>>{{0.0, 1.0},
                                                                        {-1024.0, 2986.0},
                                                                        {101324.99, 101325.01},
                                                                        {1e-9, 3e-9},
                                                                        {-5e8, 2e9},
                                                                        {-1e12, -1e12 + 0.01},
                                                                        {1e-300, 1e-299},
                                                                        {1e17, 1e17 + 4096.0}}) {
    const std::vector<Tick> ticks = ticksOf(low, high).ticks;
    ASSERT_GE(ticks.size(), 3u) << low;
    ASSERT_LE(ticks.size(), 11u) << low;
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      EXPECT_GE(ticks[i].value, low - 1e-6 * (high - low));
      EXPECT_LE(ticks[i].value, high + 1e-6 * (high - low));
      EXPECT_LE(ticks[i].text.size(), 8u) << ticks[i].text;
      if (i == 0) continue;
      EXPECT_NEAR(ticks[i].value - ticks[i - 1].value, ticks[1].value - ticks[0].value,
                  1e-6 * (high - low) + 1e-15 * std::max(std::abs(low), std::abs(high)));
      EXPECT_NE(ticks[i].text, ticks[i - 1].text);
    }
  }
}

TEST(Ticks, SayTheirPowerOfTenAndWhatIsTakenAwayOnce) {
  const auto texts = [](double low, double high, int wanted) {
    const Ticks ticks = ticksOf(low, high, wanted);
    std::string text = ticks.scale + ":";
    for (const Tick& tick : ticks.ticks) text += " " + tick.text;
    return text;
  };
  EXPECT_EQ(texts(0.0, 1.0, 2), ": 0.0 0.5 1.0");
  EXPECT_EQ(texts(-1024.0, 2986.0, 4), ": -1000 0 1000 2000");
  EXPECT_EQ(texts(0.0, 1e-12, 2), "×10⁻¹²: 0.0 0.5 1.0");
  EXPECT_EQ(texts(0.0, 4e-7, 4), "×10⁻⁹: 0 100 200 300 400");
  EXPECT_EQ(texts(0.0, 2.5e7, 5), "×10⁶: 0 5 10 15 20 25");
  EXPECT_EQ(texts(101325.01, 101325.02, 2), "+101325: 0.010 0.015 0.020");
  EXPECT_EQ(texts(-1e12, -1e12 + 0.01, 2).substr(0, 6), "−1×");
  EXPECT_EQ(numberText(1.5e-9), "1.5×10⁻⁹");
  EXPECT_EQ(numberText(-0.25), "-0.25");
}

TEST(Ticks, AreNoneForARangeOfNothing) {
  EXPECT_TRUE(ticksOf(1.0, 1.0).ticks.empty());
  EXPECT_TRUE(ticksOf(0.0, std::numeric_limits<double>::infinity()).ticks.empty());
}

TEST(Lines, CoverTheirPixelsAndStayInThePicture) {
  Picture picture = Picture::blank({20, 10});
  drawLine(picture, {-100.0, 5.5}, {100.0, 5.5}, 1.0, glm::dvec3(1.0, 0.5, 0.0));
  for (int x = 0; x < 20; ++x) {
    EXPECT_NEAR(picture.pixel(x, 5)[0], 1.0, 1e-5);
    EXPECT_EQ(picture.pixel(x, 2)[3], 0.0f);
  }
}

TEST(Text, IsWiderWhenLongerAndLeavesInk) {
  const Font font(20);
  EXPECT_GT(font.width("100"), font.width("10"));
  EXPECT_GT(font.width("\xc2\xb0"
                       "C"),
            font.width("C"));
  Picture picture = Picture::blank({60, 30});
  font.draw(picture, {5.0, 22.0}, "8.5", glm::dvec3(1.0));
  double ink = 0.0;
  for (std::size_t i = 3; i < picture.rgba.size(); i += 4) ink += double(picture.rgba[i]);
  EXPECT_GT(ink, 30.0);
}

TEST(Text, NamesAFontThatIsNotThere) {
  setenv("VESTIGE_FONT", "/nowhere/font.ttf", 1);
  EXPECT_EQ(codeOf([] { Font font(12); }), ErrorCode::NotFound);
  setenv("VESTIGE_FONT", "/etc/hostname", 1);
  EXPECT_EQ(codeOf([] { Font font(12); }), ErrorCode::Format);
  unsetenv("VESTIGE_FONT");
}

TEST(Pictures, SurvivePngAndExr) {
  const synthetic::TemporaryFolder folder;
  Picture picture = Picture::blank({7, 5});
  for (int i = 0; i < 35; ++i) {
    const float alpha = float(i % 6) / 5.0f;
    for (std::size_t c = 0; c < 3; ++c) {
      picture.rgba[4 * std::size_t(i) + c] = alpha * float(i) / 35.0f;
    }
    picture.rgba[4 * std::size_t(i) + 3] = alpha;
  }
  for (const auto& [name, tolerance] : {std::pair{"a.exr", 1e-6}, std::pair{"a.png", 8e-3}}) {
    writePicture(folder.path() / name, picture);
    const Picture back = readPicture(folder.path() / name);
    ASSERT_EQ(back.size, picture.size);
    for (std::size_t i = 0; i < picture.rgba.size(); ++i) {
      ASSERT_NEAR(back.rgba[i], picture.rgba[i], tolerance) << name << " " << i;
    }
  }
}

TEST(Pictures, AreRefusedByOtherExtensionsAndWhenMissing) {
  EXPECT_EQ(codeOf([] {
              writePicture("a.jpg", Picture::blank({1, 1}));
            }),
            ErrorCode::InvalidArgument);
  EXPECT_EQ(codeOf([] { readPicture("a.bmp"); }), ErrorCode::InvalidArgument);
  EXPECT_EQ(codeOf([] { readPicture("/nowhere/a.png"); }), ErrorCode::Io);
}

TEST(Fitting, KeepsAConstantPictureConstantAndCentresIt) {
  Picture picture = Picture::blank({30, 20});
  std::fill(picture.rgba.begin(), picture.rgba.end(), 0.5f);
  const Picture larger = fitted(picture, {60, 60});
  EXPECT_NEAR(larger.pixel(30, 30)[0], 0.5, 1e-5);
  EXPECT_NEAR(larger.pixel(0, 12)[3], 0.5, 1e-5);
  EXPECT_EQ(larger.pixel(30, 5)[3], 0.0f);
  const Picture smaller = fitted(picture, {9, 6});
  for (float value : smaller.rgba) EXPECT_NEAR(value, 0.5, 1e-5);
}

TEST(Compositing, OverABackgroundIsOpaque) {
  Picture picture = Picture::blank({1, 1});
  picture.rgba = {0.2f, 0.0f, 0.0f, 0.5f};
  placeOver(picture, glm::dvec3(0.0, 1.0, 0.0));
  EXPECT_NEAR(picture.rgba[0], 0.2, 1e-6);
  EXPECT_NEAR(picture.rgba[1], 0.5, 1e-6);
  EXPECT_EQ(picture.rgba[3], 1.0f);
  EXPECT_EQ(codeOf([&] {
              placeOver(picture, Picture::blank({2, 1}));
            }),
            ErrorCode::InvalidArgument);
}

TEST(TrustClasses, FollowTheirThresholds) {
  const std::vector<float> doubt{0.0f, kDoubtData, 0.05f, kDoubtGuess, 0.2f};
  const std::vector<Trust> trust = trustFromDoubt(doubt);
  EXPECT_EQ(trust, (std::vector<Trust>{Trust::Data, Trust::Data, Trust::Interpolation,
                                       Trust::Interpolation, Trust::Guess}));
  Picture picture = Picture::blank({5, 1});
  std::fill(picture.rgba.begin(), picture.rgba.end(), 1.0f);
  const TrustShares shares = sharesOf(trust, picture);
  EXPECT_NEAR(shares.data, 0.4, 1e-12);
  EXPECT_NEAR(shares.guess, 0.2, 1e-12);
  overlayTrust(picture, trust);
  EXPECT_EQ(picture.rgba[0], 1.0f);
  EXPECT_LT(picture.rgba[4 * 4 + 1], 0.5f);  // magenta has no green
}

TEST(Layers, StandForTheIntervalsNearestToTheirValue) {
  const IntervalPartition partition = IntervalPartition::uniform(0.0, 1.0, 4);
  const std::vector<int> layers = layerOfChannels(partition, {0.2, 0.9});
  EXPECT_EQ(layers[0], 0);
  EXPECT_EQ(layers[1], 0);
  EXPECT_EQ(layers[2], 1);
  EXPECT_EQ(layers[3], 1);
  EXPECT_EQ(layers[std::size_t(partition.below())], 0);
  EXPECT_EQ(layers[std::size_t(partition.above())], 1);
  EXPECT_EQ(layers[std::size_t(partition.noData())], -1);
  EXPECT_EQ(layerOfChannels(partition, {})[0], -1);
}

TEST(Layers, KeepStoredCrossingsAndFillTheMissing) {
  constexpr ImageSize kSize{24, 24};
  const DepthLayers stored = depthLayers(synthetic::depthProxy(kSize, {0.5}));
  const LengthPlanes lengths = lengthPlanes(synthetic::lengthProxy(kSize));
  const std::vector<int> layerOf = layerOfChannels(lengths.partition(), {0.5});
  const LayerPlanes planes = completedLayers(stored, &lengths, layerOf);
  int kept = 0, filled = 0;
  for (std::size_t i = 0; i < kSize.pixels(); ++i) {
    if (std::isfinite(stored.depth[0][i])) {
      EXPECT_EQ(planes.depth[0][i], stored.depth[0][i]);
      ++kept;
    } else if (std::isfinite(planes.depth[0][i])) {
      ++filled;
    }
  }
  EXPECT_GT(kept, 50);
  EXPECT_GT(filled, 50);
}

TEST(Turns, SwingAndComeBackOrGoRound) {
  const std::vector<Look> swing = looksOfTurn(Look{}, 60.0, 40);
  double low = 0.0, high = 0.0;
  for (const Look& look : swing) {
    low = std::min(low, look.rotate.azimuth);
    high = std::max(high, look.rotate.azimuth);
  }
  EXPECT_NEAR(low, -30.0, 1e-6);
  EXPECT_NEAR(high, 30.0, 1e-6);
  const std::vector<Look> round = looksOfTurn(Look{}, 360.0, 4);
  EXPECT_NEAR(round[1].rotate.azimuth, 90.0, 1e-9);
  EXPECT_EQ(codeOf([] { looksOfTurn(Look{}, 10.0, 1); }), ErrorCode::InvalidArgument);
  EXPECT_EQ(codeOf([] { looksOfTurn(Look{}, 0.0, 10); }), ErrorCode::InvalidArgument);
}

TEST(Subprocesses, ReturnWhatTheyPrintAndReportFailure) {
  EXPECT_EQ(Subprocess({"echo", "a b;c"}).finish(), "a b;c\n");
  EXPECT_EQ(codeOf([] { Subprocess({"false"}).finish(); }), ErrorCode::Io);
  EXPECT_EQ(codeOf([] { Subprocess({"no-such-program-vestige"}); }), ErrorCode::NotFound);
}

TEST(Subprocesses, FailWithTheLastLineOfWhatTheySay) {
  try {
    Subprocess({"sh", "-c", "echo banner; echo the reason; echo; exit 3"}).finish();
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()), "sh failed: it said 'the reason'");
  }
}

TEST(Subprocesses, SurviveAReaderThatDies) {
  const std::vector<std::byte> bytes(1 << 22);
  EXPECT_EQ(codeOf([&] {
              Subprocess child({"true"});
              for (int i = 0; i < 16; ++i) child.write(bytes);
            }),
            ErrorCode::Io);
}

TEST(Parallel, CoversEveryIndexOnceAndPassesExceptionsOn) {
  std::vector<int> hits(1000, 0);
  parallelRanges(1000, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) ++hits[std::size_t(i)];
  });
  EXPECT_EQ(std::count(hits.begin(), hits.end(), 1), 1000);
  EXPECT_THROW(parallelRanges(10, [](int, int) { throw Error(ErrorCode::Io, "x"); }), Error);
  parallelRanges(0, [](int, int) { FAIL(); });
}

}  // namespace
}  // namespace vestige
