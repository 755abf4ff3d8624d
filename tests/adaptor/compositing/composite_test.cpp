// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "adaptor/compositing/march_types.h"
#include "adaptor/compositing/ray_sorter.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

/// A plausible image of rays between planar depths [near, near + 1], with misses.
RayImage randomImage(std::mt19937& random, float near, int channels = 5, int layers = 2) {
  const auto uniform = [&](double a, double b) {
    return float(std::uniform_real_distribution(a, b)(random));
  };
  RayImage image;
  image.size = {6, 4};
  image.channels = channels;
  const std::size_t pixels = image.size.pixels();
  for (std::size_t i = 0; i < pixels; ++i) {
    const bool miss = uniform(0, 1) < 0.2f;
    image.entry.push_back(miss ? kInfinity : near);
    image.exit.push_back(miss ? -kInfinity : near + 1.0f);
    image.first.push_back(miss ? 255 : std::uint8_t(random() % std::size_t(channels)));
    image.last.push_back(miss ? 255 : std::uint8_t(random() % std::size_t(channels)));
    image.mip.push_back(miss ? std::nanf("") : uniform(-3, 3));
    image.transmittance.push_back(1.0f);
  }
  for (int c = 0; c < channels; ++c) {
    for (std::size_t i = 0; i < pixels; ++i) {
      const bool miss = image.first[i] == 255;
      const float a = miss ? 0.0f : uniform(0, 0.9 / channels);
      image.attenuation.push_back(a);
      image.transmittance[i] -= a;
      image.length.push_back(miss ? 0.0f : uniform(0, 1));
      image.moment.push_back(miss ? 0.0f : uniform(0, 1));
      image.runs.push_back(miss ? 0.0f : 1.0f + float(random() % 3));
    }
  }
  for (std::size_t i = 0; i < layers * pixels; ++i) {
    const bool hit = image.first[i % pixels] != 255 && uniform(0, 1) < 0.5f;
    image.depth.push_back(hit ? uniform(near, near + 1.0) : kInfinity);
  }
  for (std::size_t i = 0; i < 3 * layers * pixels; ++i) image.normal.push_back(uniform(-1, 1));
  for (std::size_t i = 0; i < 3 * pixels; ++i) image.reference.push_back(uniform(0, 1));
  return image;
}

void expectNear(const std::vector<float>& a, const std::vector<float>& b, const char* what) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::isnan(a[i]) && std::isnan(b[i])) continue;
    if (a[i] == b[i]) continue;
    ASSERT_NEAR(a[i], b[i], 2e-6) << what << " " << i;
  }
}

RayImage under(RayImage front, const RayImage& back) {
  compositeUnder(front, back);
  return front;
}

TEST(CompositeUnder, IsAssociative) {
  std::mt19937 random(11);
  for (int trial = 0; trial < 20; ++trial) {
    const RayImage a = randomImage(random, 0), b = randomImage(random, 1),
                   c = randomImage(random, 2);
    const RayImage left = under(under(a, b), c), right = under(a, under(b, c));
    expectNear(left.attenuation, right.attenuation, "attenuation");
    expectNear(left.transmittance, right.transmittance, "transmittance");
    expectNear(left.length, right.length, "length");
    expectNear(left.moment, right.moment, "moment");
    expectNear(left.runs, right.runs, "runs");
    expectNear(left.depth, right.depth, "depth");
    expectNear(left.normal, right.normal, "normal");
    expectNear(left.mip, right.mip, "mip");
    expectNear(left.reference, right.reference, "reference");
    expectNear(left.entry, right.entry, "entry");
    expectNear(left.exit, right.exit, "exit");
    EXPECT_EQ(left.first, right.first);
    EXPECT_EQ(left.last, right.last);
  }
}

TEST(CompositeUnder, KeepsTheBalanceOfLight) {
  std::mt19937 random(12);
  RayImage image = randomImage(random, 0);
  for (int i = 1; i < 5; ++i) compositeUnder(image, randomImage(random, float(i)));
  for (std::size_t p = 0; p < image.size.pixels(); ++p) {
    float sum = image.transmittance[p];
    for (std::size_t c = 0; c < 5; ++c) sum += image.attenuation[c * image.size.pixels() + p];
    EXPECT_NEAR(sum, 1.0f, 1e-5f);
  }
}

TEST(CompositeUnder, JoinsARunThatGoesOnThroughTheSharedFace) {
  std::mt19937 random(13);
  RayImage front = randomImage(random, 0), back = randomImage(random, 1);
  front.entry[0] = 0.0f, front.exit[0] = 1.0f, back.entry[0] = 1.0f, back.exit[0] = 2.0f;
  front.last[0] = back.first[0] = 2;
  const std::size_t at = 2 * front.size.pixels();
  front.runs[at] = 3.0f, back.runs[at] = 1.0f;
  EXPECT_EQ(under(front, back).runs[at], 3.0f);
  back.first[0] = 1;
  EXPECT_EQ(under(front, back).runs[at], 4.0f) << "another channel begins";
  back.first[0] = 2;
  back.entry[0] = 1.5f;
  EXPECT_EQ(under(front, back).runs[at], 4.0f) << "there is a gap between the two";
}

TEST(CompositeUnder, RefusesImagesThatDoNotMatch) {
  std::mt19937 random(14);
  RayImage front = randomImage(random, 0);
  for (int what = 0; what < 3; ++what) {
    RayImage back = randomImage(random, 1, what == 0 ? 6 : 5);
    if (what == 1) back.size = {4, 6};
    if (what == 2) back.mip.clear();
    try {
      compositeUnder(front, back);
      ADD_FAILURE() << "nothing was thrown";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::InvalidArgument);
    }
  }
}

TEST(RaySorter, CompositesEachPixelInItsOwnOrder) {
  std::mt19937 random(16);
  for (int trial = 0; trial < 10; ++trial) {
    // Three images in order; in the other three pixels are dealt out at random.
    const std::vector<RayImage> ordered = {randomImage(random, 0), randomImage(random, 1),
                                           randomImage(random, 2)};
    std::vector<RayImage> dealt = ordered;
    const std::size_t pixels = ordered[0].size.pixels();
    for (std::size_t i = 0; i < pixels; ++i) {
      std::array<std::size_t, 3> to = {0, 1, 2};
      std::shuffle(to.begin(), to.end(), random);
      for (std::size_t k = 0; k < 3; ++k) {
        const auto deal = [&](const auto& from, auto& into) {
          for (std::size_t at = i; at < from.size(); at += pixels) into[at] = from[at];
        };
        const RayImage& a = ordered[k];
        RayImage& b = dealt[to[k]];
        deal(a.entry, b.entry), deal(a.exit, b.exit), deal(a.first, b.first);
        deal(a.last, b.last), deal(a.mip, b.mip), deal(a.transmittance, b.transmittance);
        deal(a.attenuation, b.attenuation), deal(a.length, b.length), deal(a.moment, b.moment);
        deal(a.runs, b.runs), deal(a.depth, b.depth), deal(a.normal, b.normal);
        deal(a.reference, b.reference);
      }
    }
    const RayImage wanted = under(under(ordered[0], ordered[1]), ordered[2]);
    RaySorter sorter;
    for (const RayImage& image : dealt) sorter.add(image);
    const RayImage made = sorter.take();
    expectNear(made.attenuation, wanted.attenuation, "attenuation");
    expectNear(made.transmittance, wanted.transmittance, "transmittance");
    expectNear(made.length, wanted.length, "length");
    expectNear(made.moment, wanted.moment, "moment");
    expectNear(made.runs, wanted.runs, "runs");
    expectNear(made.depth, wanted.depth, "depth");
    expectNear(made.mip, wanted.mip, "mip");
    expectNear(made.entry, wanted.entry, "entry");
    expectNear(made.exit, wanted.exit, "exit");
    for (std::size_t i = 0; i < pixels; ++i) {
      // What a miss holds besides means nothing; these misses have light of their own.
      if (ordered[0].first[i] == 255 || ordered[1].first[i] == 255 || ordered[2].first[i] == 255) {
        continue;
      }
      EXPECT_NEAR(made.reference[i], wanted.reference[i], 2e-6);
      EXPECT_EQ(made.first[i], wanted.first[i]);
      EXPECT_EQ(made.last[i], wanted.last[i]);
    }
  }
}

TEST(RaySorter, RefusesImagesThatDoNotMatchAndNothingAtAll) {
  std::mt19937 random(17);
  const auto refused = [](const auto& action) {
    try {
      action();
    } catch (const Error& e) {
      return e.code() == ErrorCode::InvalidArgument;
    }
    return false;
  };
  RaySorter sorter;
  EXPECT_TRUE(refused([&] { sorter.take(); }));
  sorter.add(randomImage(random, 0));
  EXPECT_TRUE(refused([&] { sorter.add(randomImage(random, 0, 6)); }));
  RayImage turned = randomImage(random, 0);
  turned.size = {4, 6};
  EXPECT_TRUE(refused([&] { sorter.add(turned); }));
  EXPECT_NO_THROW(sorter.take());
  EXPECT_TRUE(refused([&] { sorter.take(); })) << "it is empty afterwards";
}

/// A random subdivision of a box by planes, as by recursive bisection.
void bisect(std::mt19937& random, const Box& box, int times, std::vector<Box>& out) {
  if (times == 0) return out.push_back(box);
  const int axis = int(random() % 3);
  Box low = box, high = box;
  const double t = std::uniform_real_distribution(0.2, 0.8)(random);
  low.high[axis] = high.low[axis] = box.low[axis] + t * (box.high[axis] - box.low[axis]);
  bisect(random, low, times - 1, out);
  bisect(random, high, times - 1, out);
}

/// Where a ray is inside a box, as lengths along it; empty when x >= y.
glm::dvec2 clip(const Ray& ray, const Box& box) {
  glm::dvec2 s{0.0, 1e300};
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (box.low[axis] - ray.origin[axis]) / ray.direction[axis];
    const double b = (box.high[axis] - ray.origin[axis]) / ray.direction[axis];
    s = {std::max(s.x, std::min(a, b)), std::min(s.y, std::max(a, b))};
  }
  return s;
}

TEST(VisibilityOrder, MeetsNearerBoxesFirstOnEveryRay) {
  std::mt19937 random(15);
  const Box domain{{-1, -2, 0}, {1, 1, 4}};
  for (int trial = 0; trial < 40; ++trial) {
    std::vector<Box> boxes;
    bisect(random, domain, 4, boxes);
    std::shuffle(boxes.begin(), boxes.end(), random);
    const auto normal = [&] { return std::normal_distribution()(random); };
    Camera camera = frameBox(domain, {normal(), normal(), normal()}, {0.1, 0.2, 0.9}, 1.0,
                             trial % 2 ? Projection::Perspective : Projection::Orthographic, 0.9);
    if (trial % 4 == 3) camera.position = domain.center() + glm::dvec3(0.11, 0.07, 0.03);  // inside
    const auto order = visibilityOrder(boxes, camera);
    ASSERT_EQ(order.size(), boxes.size());
    for (int i = 0; i < 200; ++i) {
      const auto at = [&] { return std::uniform_real_distribution(0.0, 64.0)(random); };
      const Ray ray = camera.rayThrough({at(), at()}, {64, 64});
      double passed = 0.0;
      for (std::size_t index : order) {
        const glm::dvec2 s = clip(ray, boxes[index]);
        if (s.x >= s.y) continue;
        ASSERT_GE(s.x, passed - 1e-9);
        passed = s.y;
      }
    }
  }
}

TEST(VisibilityOrder, RefusesCamerasWhoseRaysHaveNone) {
  const std::vector<Box> boxes = {{{0, 0, 0}, {1, 1, 1}}};
  EXPECT_THROW(visibilityOrder(boxes, frameBoxDistorted(boxes[0], {0, 1, 0}, {0, 0, 1}, 1.0)),
               Error);
}

TEST(VisibilityOrder, GivesEveryBoxOnceEvenWhenTheyHideOneAnotherInARing) {
  const std::vector<Box> ring = {{{-3, 0, 1}, {3, 1, 2}},
                                 {{1, -3, 0}, {2, 3, 1 - 1e-3}},
                                 {{0, 1 + 1e-3, -3}, {1 - 1e-3, 2, 3}},
                                 {{9, 9, 9}, {10, 10, 10}}};
  Camera camera = frameBox({{-3, -3, -3}, {3, 3, 3}}, {1, 1, 1}, {0, 0, 1}, 1.0);
  auto order = visibilityOrder(ring, camera);
  std::sort(order.begin(), order.end());
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 1, 2, 3}));
  EXPECT_TRUE(visibilityOrder({}, camera).empty());
}

}  // namespace
}  // namespace vestige
