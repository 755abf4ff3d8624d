// SPDX-License-Identifier: BSD-3-Clause
//
// Annotations can be read on any background, before any data, at any size.
#include "explorer/annotation/annotate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "proxy/transfer/transfer_function.h"

namespace vestige {
namespace {

using Background = std::optional<glm::dvec3>;

double luminance(const float* pixel) {
  return 0.2126 * double(pixel[0]) + 0.7152 * double(pixel[1]) + 0.0722 * double(pixel[2]);
}

/// WCAG 2.1.
double contrast(double a, double b) { return (std::max(a, b) + 0.05) / (std::min(a, b) + 0.05); }

Picture filled(ImageSize size, double value, double alpha) {
  Picture picture = Picture::blank(size);
  for (std::size_t i = 0; i < picture.rgba.size(); ++i)
    picture.rgba[i] = float(i % 4 == 3 ? alpha : value * alpha);
  return picture;
}

/// Data from black to white in stripes of a pixel, half as opaque as they can be where the
/// background is transparent.
Picture busy(ImageSize size) {
  Picture picture = filled(size, 0.0, 1.0);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      for (int c = 0; c < 3; ++c) picture.pixel(x, y)[c] = (x / 3 + y / 3) % 2 ? 1.0f : 0.0f;
    }
  }
  return picture;
}

struct Scene {
  TransferFunction function = TransferFunction::ramp(0.0, 1.0, 1.0);
  AnnotationSubject subject;
  Scene() {
    subject.domain = {glm::dvec3(0.0), glm::dvec3(1.0)};
    subject.camera = frameBox(subject.domain, {1, 1, -1}, {0, 0, 1}, 1.0);
    subject.function = &function;
    subject.field = "temperature";
    subject.units = "K";
  }
};

/// The darkest and the brightest part of a column of pixels' means over 3 x 3, left of the colour
/// bar where the tick texts are.
TEST(Annotations, TicksStandOutFromTheirPlateOnAnyBackgroundBeforeAnyData) {
  const Scene scene;
  const ImageSize size{256, 256};
  for (const Background& background : {Background(glm::dvec3(0.0)), Background(glm::dvec3(1.0)),
                                       Background(glm::dvec3(0.5)), Background()}) {
    std::vector<Picture> before;
    for (const double value : {0.0, 0.2, 1.0}) before.push_back(filled(size, value, 1.0));
    before.push_back(busy(size));
    if (!background) before.push_back(Picture::blank(size));
    for (const Picture& data : before) {
      // What is transparent may end up on any page.
      for (const double page : {0.0, 1.0}) {
        Picture picture = data;
        annotate(picture, {.colorbar = true}, scene.subject, background);
        Picture plain = data;
        placeOver(picture, glm::dvec3(page));
        placeOver(plain, glm::dvec3(page));
        // Ink and plate are the two ends of the pixels that the plate has changed, the bar aside.
        const Ink ink = inkOn(background);
        const double inkLight = ink.ink.y;
        double worst = 100.0;
        int plate = 0, letters = 0;
        for (int y = 96; y < 200; ++y) {
          for (int x = 196; x < 230; ++x) {
            const double light = luminance(picture.pixel(x, y));
            if (std::abs(light - luminance(plain.pixel(x, y))) < 1e-4) continue;
            if (std::abs(light - inkLight) < 0.05) {
              ++letters;
              continue;
            }
            ++plate;
          }
        }
        // The plate's own light, before letters: where it is drawn over the data of its corner.
        for (const double under : {0.0, 1.0}) {
          const double seen = ink.plateOpacity * ink.plate.y + (1.0 - ink.plateOpacity) * under;
          worst = std::min(worst, contrast(inkLight, seen));
        }
        EXPECT_GT(worst, 4.5);
        EXPECT_GT(plate, 0);
        EXPECT_GT(letters, 30) << (background ? background->x : -1.0) << ", page " << page;
      }
    }
  }
}

TEST(Annotations, LettersAreLegibleInSmallPicturesAndModestInLargeOnes) {
  EXPECT_GE(letterHeight({256, 256}), 12.0);
  EXPECT_GE(letterHeight({512, 512}), 14.0);
  EXPECT_LE(letterHeight({2048, 2048}), 2048 / 50.0);
  EXPECT_GE(letterHeight({2048, 2048}), 30.0);
  EXPECT_LE(letterHeight({64, 48}), 6.0);
}

TEST(Annotations, LongNamesStayInTheirHalfOfThePicture) {
  Scene scene;
  scene.subject.field = "magnitude_of_the_gradient_of_the_turbulent_kinetic_energy";
  scene.subject.units = "kg m² s⁻³ per unit of something that is long";
  for (const int side : {128, 256, 512}) {
    for (const bool legend : {false, true}) {
      AnnotationSubject subject = scene.subject;
      if (legend) {
        for (int i = 0; i < 100; ++i) subject.legend.push_back({subject.field, glm::dvec3(0.5)});
      }
      const Picture before = filled({side, side}, 0.2, 1.0);
      Picture picture = before;
      annotate(picture, {.colorbar = true}, subject, glm::dvec3(0.0));
      EXPECT_NE(picture.rgba, before.rgba);
      for (int y = 0; y < side; ++y) {
        for (int x = 0; x < 2 * side / 5; ++x)
          ASSERT_EQ(picture.pixel(x, y)[0], before.pixel(x, y)[0]) << x << ", " << y;
      }
    }
  }
}

TEST(Annotations, AreLeftOutOfPicturesThatAreTooSmallForThem) {
  const Scene scene;
  for (const ImageSize size : {ImageSize{1, 1}, {16, 300}, {300, 20}}) {
    Picture picture = filled(size, 0.2, 1.0);
    annotate(picture, {true, true, true, true}, scene.subject, glm::dvec3(0.0));
    EXPECT_EQ(picture.size, size);
  }
}

}  // namespace
}  // namespace vestige
