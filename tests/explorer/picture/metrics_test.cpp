// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/picture/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "proxy/base/error.h"

namespace vestige {
namespace {

std::vector<float> noise(ImageSize size, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<float> unit(0.0f, 1.0f);
  std::vector<float> values(3 * size.pixels());
  for (float& v : values) v = unit(engine);
  return values;
}

/// SSIM by its definition, window by window in double.
double ssimByDefinition(ImageSize size, const std::vector<float>& a, const std::vector<float>& b,
                        PixelRect r) {
  double sum = 0.0;
  int count = 0;
  for (int channel = 0; channel < 3; ++channel)
    for (int cy = r.y + 5; cy < r.y + r.height - 5; ++cy)
      for (int cx = r.x + 5; cx < r.x + r.width - 5; ++cx) {
        double w = 0, ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
        for (int dy = -5; dy <= 5; ++dy)
          for (int dx = -5; dx <= 5; ++dx) {
            const double g = std::exp(-(dx * dx + dy * dy) / (2 * 1.5 * 1.5));
            const std::size_t i = 3 * (std::size_t(cy + dy) * size.width + cx + dx) + channel;
            w += g, ma += g * a[i], mb += g * b[i];
            aa += g * a[i] * a[i], bb += g * b[i] * b[i], ab += g * a[i] * b[i];
          }
        ma /= w, mb /= w;
        const double va = aa / w - ma * ma, vb = bb / w - mb * mb, cov = ab / w - ma * mb;
        sum += (2 * ma * mb + 1e-4) * (2 * cov + 9e-4) /
               ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4));
        ++count;
      }
  return sum / count;
}

TEST(Metrics, EqualPicturesAreInfinitelyAlike) {
  const ImageSize size{40, 30};
  const auto a = noise(size, 1);
  const auto view = RgbView::interleaved(size, a);
  EXPECT_EQ(psnr(view, view), std::numeric_limits<double>::infinity());
  EXPECT_NEAR(ssim(view, view), 1.0, 1e-7);
  EXPECT_NEAR(dssim(view, view), 0.0, 1e-7);
}

TEST(Metrics, PsnrOfAConstantDifferenceIsItsLogarithm) {
  const ImageSize size{17, 9};
  const std::vector<float> a(3 * size.pixels(), 0.25f), b(3 * size.pixels(), 0.5f);
  EXPECT_NEAR(psnr(RgbView::interleaved(size, a), RgbView::interleaved(size, b)),
              -20.0 * std::log10(0.25), 1e-9);
}

TEST(Metrics, PsnrAveragesChannelsAndPixels) {
  const ImageSize size{10, 10};
  std::vector<float> a(300, 0.5f), b = a;
  b[3 * 42 + 1] = 0.75f;
  EXPECT_NEAR(psnr(RgbView::interleaved(size, a), RgbView::interleaved(size, b)),
              -10.0 * std::log10(0.0625 / 300.0), 1e-9);
}

TEST(Metrics, SsimEqualsItsDefinition) {
  const ImageSize size{37, 29};
  const auto a = noise(size, 2);
  for (const double mix : {0.05, 0.3, 1.0}) {
    auto b = noise(size, 3);
    for (std::size_t i = 0; i < b.size(); ++i) b[i] = float((1 - mix) * a[i] + mix * b[i]);
    const auto va = RgbView::interleaved(size, a), vb = RgbView::interleaved(size, b);
    const PixelRect whole{0, 0, 37, 29}, part{4, 7, 20, 15};
    EXPECT_NEAR(ssim(va, vb), ssimByDefinition(size, a, b, whole), 1e-5);
    EXPECT_NEAR(ssim(va, vb, part), ssimByDefinition(size, a, b, part), 1e-5);
    EXPECT_NEAR(dssim(va, vb), 0.5 * (1.0 - ssim(va, vb)), 1e-15);
  }
}

TEST(Metrics, SsimOfConstantPicturesIsTheLuminanceTerm) {
  const ImageSize size{20, 20};
  const std::vector<float> a(3 * size.pixels(), 0.2f), b(3 * size.pixels(), 0.6f);
  EXPECT_NEAR(ssim(RgbView::interleaved(size, a), RgbView::interleaved(size, b)),
              (2 * 0.12 + 1e-4) / (0.04 + 0.36 + 1e-4), 1e-4);
}

TEST(Metrics, AreSymmetricAndFallWithNoise) {
  const ImageSize size{64, 64};
  std::vector<float> a(3 * size.pixels());
  for (std::size_t i = 0; i < a.size(); ++i) a[i] = 0.5f + 0.4f * std::sin(float(i / 3) * 0.11f);
  const auto n = noise(size, 4);
  const auto va = RgbView::interleaved(size, a);
  double lastPsnr = 1e9, lastSsim = 1.0;
  for (const float amount : {0.01f, 0.03f, 0.1f, 0.3f}) {
    auto b = a;
    for (std::size_t i = 0; i < b.size(); ++i) b[i] += amount * (n[i] - 0.5f);
    const auto vb = RgbView::interleaved(size, b);
    EXPECT_LT(psnr(va, vb), lastPsnr);
    EXPECT_LT(ssim(va, vb), lastSsim);
    EXPECT_EQ(psnr(va, vb), psnr(vb, va));
    EXPECT_NEAR(ssim(va, vb), ssim(vb, va), 1e-12);
    lastPsnr = psnr(va, vb);
    lastSsim = ssim(va, vb);
  }
}

TEST(Metrics, LayoutsOfThePixelsDoNotMatter) {
  const ImageSize size{23, 31};
  const auto a = noise(size, 5), b = noise(size, 6);
  std::vector<float> rgba(4 * size.pixels(), 7.0f);
  std::vector<float> plane[3];
  for (std::size_t i = 0; i < size.pixels(); ++i)
    for (int c = 0; c < 3; ++c) {
      rgba[4 * i + c] = b[3 * i + c];
      plane[c].push_back(b[3 * i + c]);
    }
  const auto va = RgbView::interleaved(size, a), vb = RgbView::interleaved(size, b);
  for (const auto& other :
       {RgbView::interleaved(size, rgba, 4), RgbView::planar(size, plane[0], plane[1], plane[2])}) {
    EXPECT_EQ(psnr(va, other), psnr(va, vb));
    EXPECT_EQ(ssim(va, other), ssim(va, vb));
  }
}

TEST(Metrics, OnlyTheRectangleCounts) {
  const ImageSize size{50, 40};
  const auto a = noise(size, 7);
  auto b = a;
  const PixelRect rect{10, 12, 25, 20};
  const auto inside = [&](int x, int y) {
    return x >= rect.x && x < rect.x + rect.width && y >= rect.y && y < rect.y + rect.height;
  };
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      if (!inside(x, y)) b[3 * (y * size.width + x)] = 1.0f - b[3 * (y * size.width + x)];
  const auto va = RgbView::interleaved(size, a), vb = RgbView::interleaved(size, b);
  EXPECT_EQ(psnr(va, vb, rect), std::numeric_limits<double>::infinity());
  EXPECT_NEAR(ssim(va, vb, rect), 1.0, 1e-7);
  EXPECT_LT(ssim(va, vb), 0.95);
}

TEST(Metrics, ComparePicturesSmallerThanTheWindow) {
  for (const ImageSize size : {ImageSize{1, 1}, {2, 1}, {10, 3}, {4, 100}}) {
    const auto a = noise(size, 8), b = noise(size, 9);
    const auto va = RgbView::interleaved(size, a), vb = RgbView::interleaved(size, b);
    EXPECT_NEAR(ssim(va, va), 1.0, 1e-6);
    EXPECT_LT(ssim(va, vb), 1.0);
    EXPECT_GE(ssim(va, vb), -1.0);
  }
}

TEST(Metrics, ClampValuesToThePicturesRange) {
  const ImageSize size{12, 12};
  const std::vector<float> a(432, 1.0f), b(432, 3.0f);
  EXPECT_EQ(psnr(RgbView::interleaved(size, a), RgbView::interleaved(size, b)),
            std::numeric_limits<double>::infinity());
}

template <class Call>
void expectRefused(Call call, const std::string& word) {
  try {
    call();
    ADD_FAILURE() << "was accepted: " << word;
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::InvalidArgument);
    EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << e.what();
  }
}

TEST(Metrics, RefuseWhatCannotBeCompared) {
  std::vector<float> a(300, 0.5f), b(3 * 90, 0.5f);
  const auto va = RgbView::interleaved({10, 10}, a), vb = RgbView::interleaved({9, 10}, b);
  expectRefused([&] { psnr(va, vb); }, "9 x 10");
  expectRefused([&] { ssim(va, vb); }, "9 x 10");
  const int most = std::numeric_limits<int>::max();
  for (const PixelRect r : {PixelRect{0, 0, 0, 5},
                            {0, 0, 5, 0},
                            {-1, 0, 5, 5},
                            {0, 8, 5, 3},
                            {8, 0, 3, 5},
                            {1, 1, most, most},
                            {most, most, 1, 1}}) {
    expectRefused([&] { psnr(va, va, r); }, "rectangle");
    expectRefused([&] { ssim(va, va, r); }, "rectangle");
  }
  expectRefused([&] { RgbView::interleaved({10, 11}, a); }, "300");
  expectRefused([&] { RgbView::planar({10, 10}, a, a, a); }, "300");
  a[3 * 57] = std::numeric_limits<float>::quiet_NaN();
  expectRefused([&] { psnr(va, va); }, "pixel (7, 5)");
  expectRefused([&] { ssim(va, va); }, "pixel (7, 5)");
  EXPECT_NO_THROW(psnr(va, va, PixelRect{0, 0, 5, 10}));
}

TEST(Metrics, ProjectedRectCoversTheBoxAndNotMore) {
  const Box box{{0, 0, 0}, {2, 1, 1}};
  const Camera camera = frameBox(box, {0, 1, 0}, {0, 0, 1}, 2.0);
  const auto rect = projectedRect(camera, box, {210, 105});
  ASSERT_TRUE(rect);
  EXPECT_EQ(*rect, (PixelRect{2, 1, 206, 103}));
  Camera elsewhere = camera;
  elsewhere.position.x += 100.0;
  EXPECT_FALSE(projectedRect(elsewhere, box, {210, 105}));
}

}  // namespace
}  // namespace vestige
