// SPDX-License-Identifier: BSD-3-Clause
//
// Integrals of a classifier's weights along rays: exact on linear fields, additive over slabs and
// blocks, and nothing where a field has no data.
#include "adaptor/march/feature_march.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "adaptor/compositing/ray_sorter.h"
#include "proxy/base/error.h"
#include "proxy/format/layout/proxy_layout.h"
#include "tests/adaptor/march/march_fixture.h"

namespace vestige {
namespace {

using Field = std::function<double(glm::dvec3)>;

/// A classifier over two fields in 0..1; the last two primitives are triangular.
std::unique_ptr<Classifier> someClassifier() {
  const auto json = nlohmann::json::parse(R"({"kind": "gaussian", "fields": ["a", "b"],
    "primitives": [{"name": "one", "center": [0.4, 0.5], "width": [0.15, 0.3], "opacity": 0.4},
                   {"name": "two", "center": [0.7, 0.6], "matrix": [5, 2, -1, 4], "opacity": 0.9},
                   {"name": "rim", "center": [0.5, 0.4], "thickness": 0.05},
                   {"name": "off", "center": [0.3, 0.3], "thickness": 0.2, "enabled": false}]})");
  const std::vector<FieldDomain> domains{{0.0, 1.0, 0.5}, {0.0, 1.0, 0.5}};
  return classifierFromJson(json, "")->resolved(domains, 0.1)->normalised(domains);
}

/// Two fields, and their gradient norm, on the nodes of a scene.
struct TwoFields {
  Scene scene;
  Field second, gradient;

  std::vector<FillSlab> fills(const BlockGrid& grid) const {
    std::vector<FillSlab> fills;
    for (const Field* field : {&scene.field, &second, &gradient}) {
      fills.push_back([&grid, field](int z0, int z1, float* out) {
        for (int z = z0; z < z1; ++z)
          for (const double y : grid.nodes[1])
            for (const double x : grid.nodes[0])
              *out++ = float((*field)({x, y, grid.nodes[2][std::size_t(z)]}));
      });
    }
    return fills;
  }
};

/// Waves that leave much of the box empty; with a hole in one of them.
TwoFields wavy(bool hole) {
  TwoFields fields;
  fields.scene = Scene::even({41, 37, 33}, kUnit, [](glm::dvec3 p) {
    return 0.9 * std::max(0.0, waves(p) - 1.5 * glm::length(p - glm::dvec3(0.4, 0.6, 0.5)) + 0.4);
  });
  fields.second = [hole](glm::dvec3 p) {
    if (hole && glm::length(p - glm::dvec3(0.6, 0.4, 0.6)) < 0.15) return kNaN;
    return waves({p.z, p.x, p.y});
  };
  fields.gradient = [](glm::dvec3 p) { return 4.0 + 3.0 * std::sin(5.0 * p.x + p.z); };
  return fields;
}

FeatureRequest requestFor(const Classifier& classifier, const Camera& camera,
                          ImageSize size = {32, 24}) {
  return {camera, size, kUnit, 0.02, &classifier, classifier.optics(0.1)};
}

RayImage marchIn(FeatureMarcher& marcher, const TwoFields& fields, const FeatureRequest& request,
                 const Cuts& cuts, int ghosts) {
  std::optional<RayImage> all;
  RaySorter sorter;
  const bool distorted = request.camera.projection == Projection::MultiPerspective;
  for (const ScenePart& part : partsOf(fields.scene, request.camera, cuts, ghosts)) {
    const BlockGrid grid = part.gridIn(fields.scene);
    marcher.upload(grid, fields.fills(grid));
    RayImage image = marcher.march(request);
    if (distorted) {
      sorter.add(std::move(image));
    } else if (all) {
      compositeUnder(*all, image);
    } else {
      all = std::move(image);
    }
  }
  return distorted ? sorter.take() : std::move(*all);
}

std::vector<std::vector<float>> slabsIn(FeatureMarcher& marcher, const TwoFields& fields,
                                        const FeatureRequest& request,
                                        const std::vector<double>& depths, const Cuts& cuts,
                                        int ghosts) {
  std::vector<std::vector<float>> all;
  for (const ScenePart& part : partsOf(fields.scene, request.camera, cuts, ghosts)) {
    const BlockGrid grid = part.gridIn(fields.scene);
    marcher.upload(grid, fields.fills(grid));
    auto slabs = marcher.marchSlabs(request, depths);
    if (all.empty()) {
      all = std::move(slabs);
      continue;
    }
    for (std::size_t s = 0; s < all.size(); ++s)
      for (std::size_t i = 0; i < all[s].size(); ++i) all[s][i] += slabs[s][i];
  }
  return all;
}

std::vector<double> evenDepths(const Camera& camera, int slabs) {
  const DepthRange range = depthRange(camera, kUnit);
  std::vector<double> depths;
  for (int s = 0; s <= slabs; ++s)
    depths.push_back(std::lerp(range.low, range.high, s / double(slabs)));
  return depths;
}

class FeatureMarch : public March {
 protected:
  FeatureMarcher features{sharedDevice(GetParam())};
  std::unique_ptr<Classifier> classifier = someClassifier();
};

TEST_P(FeatureMarch, LinearFieldsAreIntegratedAsOneSegment) {
  const Field a = [](glm::dvec3 p) { return 0.1 + 0.5 * p.x + 0.2 * p.y - 0.1 * p.z; };
  TwoFields fields;
  // Samples reach beyond the box: at its faces nothing is clamped.
  fields.scene = Scene::even({9, 11, 10}, {{-0.2, -0.2, -0.2}, {1.2, 1.3, 1.2}}, a);
  fields.second = [](glm::dvec3 p) { return 0.8 - 0.3 * p.x + 0.1 * p.y - 0.4 * p.z; };
  fields.gradient = [](glm::dvec3) { return 0.7; };
  for (const Camera& camera : {oblique(kUnit), perspective(kUnit)}) {
    const FeatureRequest request = requestFor(*classifier, camera);
    BlockGrid grid =
        partsOf(fields.scene, camera, fields.scene.whole(), 0).front().gridIn(fields.scene);
    grid.owned = kUnit;
    features.upload(grid, fields.fills(grid));
    const RayImage image = features.march(request);
    std::size_t hits = 0;
    for (std::size_t i = 0; i < image.size.pixels(); ++i) {
      const double length = chord(image, camera, i);
      if (length < 1e-3) continue;
      ++hits;
      const Ray ray = camera.rayThrough({double(i % 32) + 0.5, double(i / 32) + 0.5}, {32, 24});
      const auto at = [&](double depth) {
        const glm::dvec3 p = ray.origin + depth / ray.depthPerLength * ray.direction;
        return FieldSample{{a(p), fields.second(p)}, 0.7};
      };
      std::array<double, 4> weights{};
      classifier->weights(at(image.entry[i]), at(image.exit[i]), weights);
      double tau = 0.0, light = image.transmittance[i];
      for (std::size_t c = 0; c < 4; ++c) {
        ASSERT_NEAR(image.length[c * image.size.pixels() + i], weights[c] * length, 5e-6) << i;
        tau += request.optics[c].extinction * weights[c] * length;
        light += image.attenuation[c * image.size.pixels() + i];
      }
      ASSERT_NEAR(image.transmittance[i], std::exp(-tau), 3e-4);
      ASSERT_NEAR(light, 1.0, 1e-5);
      EXPECT_EQ(image.attenuation[3 * image.size.pixels() + i], 0.0f) << "it is switched off";
      EXPECT_GT(image.length[3 * image.size.pixels() + i], 0.0f) << "but may be switched on";
    }
    EXPECT_GT(hits, 100u);
  }
}

TEST_P(FeatureMarch, TheSplitOfTheDomainDoesNotMatter) {
  const Cuts cuts{std::vector<int>{0, 15, 40}, std::vector<int>{0, 20, 36},
                  std::vector<int>{0, 9, 21, 32}};
  for (const bool hole : {false, true}) {
    const TwoFields fields = wavy(hole);
    for (const Camera& camera : {oblique(kUnit), perspective(kUnit),
                                 frameBoxDistorted(kUnit, {0, 1, 0}, {0, 0, 1}, 1.0)}) {
      const FeatureRequest request = requestFor(*classifier, camera);
      const RayImage whole = marchIn(features, fields, request, fields.scene.whole(), 0);
      const RayImage split = marchIn(features, fields, request, cuts, 2);
      EXPECT_LE(greatestDifference(split.length, whole.length), 2e-5);
      EXPECT_LE(greatestDifference(split.moment, whole.moment), 1e-4);
      EXPECT_LE(greatestDifference(split.transmittance, whole.transmittance), 1e-4);
      EXPECT_LE(greatestDifference(split.attenuation, whole.attenuation), 2e-3)
          << "of a step that a face cuts, features share what each part takes";
      EXPECT_GT(*std::max_element(whole.length.begin(), whole.length.end()), 0.1f);
    }
    const FeatureRequest request = requestFor(*classifier, oblique(kUnit));
    const auto depths = evenDepths(request.camera, 6);
    const auto whole = slabsIn(features, fields, request, depths, fields.scene.whole(), 0);
    const auto split = slabsIn(features, fields, request, depths, cuts, 2);
    for (std::size_t s = 0; s < whole.size(); ++s)
      EXPECT_LE(greatestDifference(split[s], whole[s]), 2e-5) << s;
  }
}

TEST_P(FeatureMarch, SlabsAddUpToTheWholeRay) {
  const TwoFields fields = wavy(true);
  for (const Camera& camera :
       {frameBox(kUnit, {0, 1, 0}, {0, 0, 1}, 32.0 / 24.0), oblique(kUnit)}) {
    const FeatureRequest request = requestFor(*classifier, camera);
    const RayImage whole = marchIn(features, fields, request, fields.scene.whole(), 0);
    for (const int count : {1, 7, 64}) {  // thicker than a step, and thinner
      const auto depths = evenDepths(camera, count);
      const auto slabs = slabsIn(features, fields, request, depths, fields.scene.whole(), 0);
      ASSERT_EQ(slabs.size(), std::size_t(count));
      std::vector<float> sum(whole.length.size());
      for (const auto& slab : slabs)
        for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += slab[i];
      EXPECT_LE(greatestDifference(sum, whole.length), 2e-5) << count;
    }
    for (std::size_t i = 0; i < whole.length.size(); ++i) {
      const std::size_t pixel = i % whole.size.pixels();
      if (whole.length[i] < 1e-4f) continue;
      const double mean = double(whole.moment[i]) / double(whole.length[i]);
      ASSERT_GE(mean, whole.entry[pixel] - 1e-3);
      ASSERT_LE(mean, whole.exit[pixel] + 1e-3);
    }
  }
}

TEST_P(FeatureMarch, WhatIsPassedOverWeighsNothing) {
  for (const bool hole : {false, true}) {
    const TwoFields fields = wavy(hole);
    FeatureRequest request = requestFor(*classifier, oblique(kUnit));
    const auto depths = evenDepths(request.camera, 5);
    const RayImage quick = marchIn(features, fields, request, fields.scene.whole(), 0);
    const auto quickSlabs = slabsIn(features, fields, request, depths, fields.scene.whole(), 0);
    request.skipEmptySpace = false;
    const RayImage slow = marchIn(features, fields, request, fields.scene.whole(), 0);
    const auto slowSlabs = slabsIn(features, fields, request, depths, fields.scene.whole(), 0);
    EXPECT_LE(greatestDifference(quick.length, slow.length), 1e-5);
    EXPECT_LE(greatestDifference(quick.attenuation, slow.attenuation), 1e-4);
    for (std::size_t s = 0; s < slowSlabs.size(); ++s)
      EXPECT_LE(greatestDifference(quickSlabs[s], slowSlabs[s]), 1e-5);
  }
}

TEST_P(FeatureMarch, NothingIsFoundWhereAFieldHasNoData) {
  TwoFields fields = wavy(false);
  fields.second = [](glm::dvec3 p) { return p.x < 0.5 ? 0.5 : kNaN; };
  const Camera camera = frameBox(kUnit, {0, 1, 0}, {0, 0, 1}, 1.0);
  const FeatureRequest request = requestFor(*classifier, camera, {20, 20});
  const RayImage image = marchIn(features, fields, request, fields.scene.whole(), 0);
  float left = 0.0f, right = 0.0f;
  for (std::size_t i = 0; i < image.length.size(); ++i)
    (i % 20 < 10 ? left : right) += image.length[i];
  const bool mirrored = camera.right().x < 0.0;
  EXPECT_EQ(mirrored ? left : right, 0.0f);
  EXPECT_GT(mirrored ? right : left, 1.0f);
}

TEST_P(FeatureMarch, SamplesWithDataWeighHalfwayToThoseWithout) {
  TwoFields fields = wavy(false);
  fields.scene.field = fields.second = [](glm::dvec3) { return 0.45; };
  const Camera camera = frameBox(kUnit, {1, 0, 0}, {0, 0, 1}, 1.0);
  const FeatureRequest request = requestFor(*classifier, camera, {16, 16});
  const RayImage whole = marchIn(features, fields, request, fields.scene.whole(), 0);
  // The last sample with data is at 19 / 40.
  fields.second = [](glm::dvec3 p) { return p.x < 0.49 ? 0.45 : kNaN; };
  const RayImage part = marchIn(features, fields, request, fields.scene.whole(), 0);
  const std::size_t pixel = 8 * 16 + 8;
  ASSERT_GT(whole.length[pixel], 0.1f);
  EXPECT_NEAR(part.length[pixel] / whole.length[pixel], 19.5 / 40.0, 0.5 * request.stepLength);
}

TEST_P(FeatureMarch, WhatMakesNoSenseIsRefused) {
  const TwoFields fields = wavy(false);
  const BlockGrid grid =
      partsOf(fields.scene, oblique(kUnit), fields.scene.whole(), 0).front().gridIn(fields.scene);
  auto fills = fields.fills(grid);
  features.upload(grid, fills);
  const auto refused = [&](const std::string& words, const auto& act) {
    try {
      act();
      ADD_FAILURE() << words;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::InvalidArgument);
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  };
  FeatureRequest request = requestFor(*classifier, oblique(kUnit));
  refused("slabs need an orthographic view", [&] {
    FeatureRequest bad = request;
    bad.camera = perspective(kUnit);
    features.marchSlabs(bad, std::vector<double>{0.0, 1.0});
  });
  refused("depths that rise", [&] { features.marchSlabs(request, std::vector<double>{1.0, 0.0}); });
  refused("4 channels have 3 optics", [&] {
    FeatureRequest bad = request;
    bad.optics.pop_back();
    features.march(bad);
  });
  refused("there is no classifier", [&] {
    FeatureRequest bad = request;
    bad.classifier = nullptr;
    features.march(bad);
  });
  refused("no fields", [&] { features.upload(grid, {}); });
  fills.pop_back();
  features.upload(grid, fills);
  refused("2 fields are uploaded, the classifier needs 3", [&] { features.march(request); });
}

INSTANTIATE_TEST_SUITE_P(Backends, FeatureMarch, testing::Values("osmesa", "egl"),
                         [](const auto& backend) { return backend.param; });

}  // namespace
}  // namespace vestige
