// SPDX-License-Identifier: BSD-3-Clause
// Learned colours from an archive to a picture.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "explorer/renderer/learned_pass.h"
#include "explorer/renderer/renderer.h"
#include "explorer/training/training.h"
#include "proxy/base/error.h"
#include "tests/explorer/synthetic.h"

namespace vestige {
namespace {

constexpr ImageSize kSize{48, 40};

class LearnedRender : public testing::Test {
 protected:
  void SetUp() override {
    synthetic::writeArchive(path_, kSize, 1);
    device_ = gl::Device::create();
    request_.view = "front";
    request_.field = "density";
    request_.clusters = 8;
  }
  /// Trains and stores.
  ProxyImage train() {
    ProxyImage image = trainColors(*device_, Archive(path_), request_);
    store(image);
    return image;
  }
  void store(const ProxyImage& image) {
    ArchiveWriter(path_, ExistingArchive::Append).addToStep(encodeProxy(image));
  }
  Rendered render(const Look& look) {
    return Renderer(device_, std::make_shared<const Archive>(path_)).render(look);
  }
  void refuses(ErrorCode code, const char* words) {
    try {
      render(look_);
      ADD_FAILURE() << words;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), code);
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }

  synthetic::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.path() / "a.cdb";
  std::shared_ptr<gl::Device> device_;
  TrainingRequest request_;
  Look look_ = [] {
    Look look;
    look.color = Coloring::Learned;
    look.background = std::nullopt;
    return look;
  }();
};

double largestDifference(const Picture& a, const Picture& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i)
    most = std::max(most, std::abs(double(a.rgba[i]) - double(b.rgba[i])));
  return most;
}

TEST_F(LearnedRender, UnlitPicturesTeachTheFunctionsOwnColours) {
  // Unlit colour is Σ a_k c_k, affine in a: learned and recomposed pictures agree at every edit.
  const ProxyImage table = train();
  EXPECT_LT(table.header.learned->error, 2e-3);
  EXPECT_EQ(table.header.learned->from, "length");
  for (const std::vector<double>& factors :
       {std::vector<double>{}, {1.0, 0.2, 1.0, 1.0, 1.0}, {0.0, 1.0, 3.0, 0.5, 1.0}}) {
    look_.factors = factors;
    Look plain = look_;
    plain.color = Coloring::Function;
    const Rendered learned = render(look_), own = render(plain);
    EXPECT_LT(largestDifference(learned.picture, own.picture), 0.02);
    ASSERT_EQ(learned.notes.size(), 1u);
    EXPECT_NE(learned.notes[0].find("uses learned: 8 clusters of length from 1 picture (unlit)"),
              std::string::npos)
        << learned.notes[0];
  }
}

TEST_F(LearnedRender, TheShaderDoesWhatTheTableSays) {
  request_.from = "attenuation";
  ProxyImage image = trainColors(*device_, Archive(path_), request_);
  // Another table than any fit gives: every entry matters.
  LearnedTable table = learnedTable(image);
  for (std::size_t i = 0; i < table.jacobian.size(); ++i)
    table.jacobian[i] += 0.3f * std::sin(float(i));
  for (std::size_t i = 0; i < table.color.size(); ++i) table.color[i] += 0.2f * std::cos(float(i));
  store(learnedImage(image.header, table));
  look_.factors = {1.0, 0.5, 2.0, 1.0, 0.7};
  const Picture picture = render(look_).picture;
  std::vector<std::vector<float>> groups;
  device_->run([&] {
    const Archive archive(path_);
    ViewData view(archive, 0, "front", "density");
    EditPass edit;
    TransferFunction function = *view.header().base;
    function.setFactors(look_.factors);
    groups = edit.readAttenuation(attenuationFrom(edit, view, kind::kAttenuation, function), kSize,
                                  table.channels);
  });
  int shown = 0;
  for (std::size_t i = 0; i < kSize.pixels(); ++i) {
    std::vector<float> a;
    float opacity = 0.0f;
    for (int k = 0; k < table.channels; ++k) {
      a.push_back(groups[std::size_t(k / 4)][4 * i + std::size_t(k % 4)]);
      opacity += a.back();
    }
    EXPECT_NEAR(picture.rgba[4 * i + 3], std::min(opacity, 1.0f), 1e-5) << i;
    const glm::dvec3 color = opacity > 0.0f ? learnedColor(table, a) : glm::dvec3(0.0);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(picture.rgba[4 * i + std::size_t(c)], color[c], 1e-4);
    shown += opacity > 0.0f;
  }
  EXPECT_GT(shown, 500);
}

TEST_F(LearnedRender, EnhancementDarkensAndTrustCallsItAGuess) {
  train();
  const Picture plain = render(look_).picture;
  look_.enhance.on = true;
  const Picture enhanced = render(look_).picture;
  double before = 0.0, after = 0.0;
  for (std::size_t i = 0; i < plain.rgba.size(); i += 4) {
    EXPECT_LE(enhanced.rgba[i], plain.rgba[i]);
    EXPECT_EQ(enhanced.rgba[i + 3], plain.rgba[i + 3]);
    before += plain.rgba[i];
    after += enhanced.rgba[i];
  }
  EXPECT_LT(after, 0.99 * before);
  look_.trust = true;
  EXPECT_GT(render(look_).shares.guess, 0.99);
}

TEST_F(LearnedRender, SaysWhatIsMissing) {
  refuses(ErrorCode::NotFound, "vestige-explorer train");
  ProxyImage image = train();
  image.header.learned->size = {10, 10};
  store(image);
  refuses(ErrorCode::Format, "train again");
  image.header.learned->size = kSize;
  image.header.learned->from = "sliced";
  store(image);
  refuses(ErrorCode::NotFound, "no sliced proxy");
  request_.view = "side";
  EXPECT_THROW(trainColors(*device_, Archive(path_), request_), Error);
}

TEST_F(LearnedRender, FurtherPicturesTeachWhatOneCannot) {
  // Pictures whose colour is not the base function's: the red of what the second look shows.
  ProxyImage reference = synthetic::referenceProxy(kSize);
  ProxyHeader head = reference.header;
  TransferFunction other = *head.base;
  other.setOpacity({{0.0, 0.0}, {0.5, 0.0}, {0.5, 0.3}, {1.0, 0.3}});
  head.looks = {*head.base, other};
  head.shading = "headlight";
  // What the archive gives for each look, times a light that grows with the value: colours of a
  // linear map that a single look may leave open, and all looks must fit.
  std::vector<std::vector<float>> rgb(2), left(2);
  device_->run([&] {
    const Archive archive(path_);
    ViewData view(archive, 0, "front", "density");
    EditPass edit;
    for (std::size_t p = 0; p < 2; ++p) {
      const auto groups =
          edit.readAttenuation(attenuationFrom(edit, view, kind::kLength, head.looks[p]), kSize, 8);
      rgb[p].resize(3 * kSize.pixels());
      left[p].assign(kSize.pixels(), 1.0f);
      for (std::size_t i = 0; i < kSize.pixels(); ++i) {
        for (std::size_t k = 0; k < 8; ++k) {
          const float a = groups[k / 4][4 * i + k % 4];
          left[p][i] -= a;
          rgb[p][i] += a * 0.1f * float(k);
          rgb[p][kSize.pixels() + i] += a * 0.05f;
        }
        left[p][i] = std::clamp(left[p][i], 0.0f, 1.0f);
      }
    }
  });
  const LightPlanes pictures[] = {{rgb[0], left[0]}, {rgb[1], left[1]}};
  store(trainingImage(head, pictures));
  const ProxyImage both = train();
  EXPECT_EQ(both.header.looks.size(), 2u);
  EXPECT_EQ(both.header.shading, "headlight");
  EXPECT_LT(both.header.learned->error, 1e-3);
  request_.pictures = 1;
  EXPECT_EQ(train().header.looks.size(), 1u);
}

}  // namespace
}  // namespace vestige
