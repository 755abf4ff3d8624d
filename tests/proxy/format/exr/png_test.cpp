// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/base/durable_file.h"
#include "proxy/format/exr/png_file.h"
#include "tests/proxy/archive/archive_fixture.h"

namespace vestige::test {
namespace {

TEST(Png, PicturesSurviveBitForBitWithAndWithoutAlpha) {
  Folder folder;
  for (ImageSize size : {ImageSize{1, 1}, ImageSize{7, 3}, ImageSize{300, 200}})
    for (bool opaque : {true, false}) {
      Raster raster = someRaster(size);
      if (!opaque) raster.rgba[3] = 17;
      writePng(folder / "a.png", raster);
      Raster back = readPng(folder / "a.png");
      EXPECT_TRUE(back.size == size);
      EXPECT_EQ(back.rgba, raster.rgba);
      EXPECT_EQ(encodePng(raster), encodePng(back));
    }
}

TEST(Png, APictureThatIsNoneIsRefused) {
  expectError(ErrorCode::InvalidArgument, "0 x 4", [] { encodePng({{0, 4}, {}}); });
  expectError(ErrorCode::InvalidArgument, "3 bytes", [] { encodePng({{2, 2}, {1, 2, 3}}); });
  expectError(ErrorCode::InvalidArgument, "40000", [] { encodePng({{40000, 1}, {}}); });
  Folder folder;
  overwrite(folder / "a.png", "GIF89a, really");
  expectError(ErrorCode::Format, "does not begin like one", [&] { readPng(folder / "a.png"); });
}

TEST(Png, WritingIntoNowhereIsAnIoError) {
  Folder folder;
  expectError(ErrorCode::Io, "no/such", [&] { writePng(folder / "no/such/a.png", someRaster()); });
}

}  // namespace
}  // namespace vestige::test
