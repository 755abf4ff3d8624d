// SPDX-License-Identifier: BSD-3-Clause
//
// Archives whose attenuation and pictures a run customised by position.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "explorer/inspect/info.h"
#include "explorer/renderer/renderer.h"
#include "explorer/training/training.h"
#include "proxy/base/error.h"
#include "proxy/gl/device.h"
#include "tests/explorer/synthetic.h"

namespace vestige {
namespace {

constexpr ImageSize kSize{48, 40};

std::shared_ptr<gl::Device> device() {
  static const std::shared_ptr<gl::Device> shared = gl::Device::create();
  return shared;
}

Customization someCustomization() {
  Customization customization;
  customization.seeds.resize(2);
  customization.seeds[0].parameters.opacity = 3.0;
  customization.seeds[1].enabled = false;
  return customization;
}

/// An archive of one step with these proxies, the run's customisation on each that takes it.
class CustomizedRun : public ::testing::Test {
 protected:
  void store(std::vector<ProxyImage> images) {
    std::vector<EncodedProxy> proxies;
    for (ProxyImage& image : images) {
      if (image.header.kind != kind::kLength && image.header.kind != kind::kDepth)
        image.header.customization = someCustomization();
      proxies.push_back(encodeProxy(image));
    }
    ArchiveWriter(path_, ExistingArchive::Overwrite).writeStep(proxies);
  }
  Rendered render(const Look& look) const {
    return Renderer(device(), std::make_shared<const Archive>(path_)).render(look);
  }
  void refuses(const Look& look, const std::string& words) const {
    try {
      render(look);
      ADD_FAILURE() << "nothing was refused; wanted " << words;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::NotFound);
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }
  static bool says(const Rendered& rendered, const std::string& text) {
    for (const std::string& note : rendered.notes)
      if (note.find(text) != note.npos) return true;
    return false;
  }
  static Look via(Via way) {
    Look look;
    look.via = way;
    return look;
  }

  synthetic::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.path() / "a.cdb";
};

TEST_F(CustomizedRun, LengthsAnswerAndSayThatTheyAreFreeOfIt) {
  store({synthetic::lengthProxy(kSize), synthetic::attenuationProxy(kSize),
         synthetic::referenceProxy(kSize)});
  const Rendered rendered = render({});
  EXPECT_TRUE(says(rendered, "uses length"));
  EXPECT_TRUE(says(rendered, "lengths are free of that"));
  EXPECT_FALSE(says(render(via(Via::Length)), "lengths are free of that")) << "as it was asked for";
  refuses(via(Via::Attenuation), "customised the attenuation of view 'front' by position");
  refuses(via(Via::Attenuation), "take lengths");
}

TEST_F(CustomizedRun, AttenuationAloneIsNotRecomposed) {
  store({synthetic::attenuationProxy(kSize), synthetic::referenceProxy(kSize)});
  Look look;
  EXPECT_TRUE(says(render(look), "uses reference"));
  EXPECT_TRUE(says(render(look), "the run customised it by position"));
  look.source = Source::Volume;
  refuses(look, "no lengths are stored");
  refuses(via(Via::Attenuation), "no lengths are stored");
}

TEST_F(CustomizedRun, DepthLayersTakeTheLooksOpacityInstead) {
  store({synthetic::attenuationProxy(kSize), synthetic::depthProxy(kSize, {0.3, 0.7})});
  EXPECT_TRUE(says(render({}), "each has the opacity of its value"));
}

TEST_F(CustomizedRun, ColoursAreNotLearnedOfWhatDependsOnThePlace) {
  store({synthetic::lengthProxy(kSize), synthetic::attenuationProxy(kSize),
         synthetic::referenceProxy(kSize)});
  TrainingRequest request;
  request.view = "front";
  request.field = "density";
  const auto train = [&] {
    try {
      trainColors(*device(), Archive(path_), request);
      return std::string();
    } catch (const Error& error) {
      return std::string(error.what());
    }
  };
  EXPECT_NE(train().find("customised the reference picture of view 'front'"), std::string::npos);
}

TEST_F(CustomizedRun, InfoListsItOnceAndGivesItToLooks) {
  store({synthetic::lengthProxy(kSize), synthetic::attenuationProxy(kSize),
         synthetic::referenceProxy(kSize)});
  const nlohmann::json info = archiveInfo(Archive(path_));
  for (const nlohmann::json& answer : info["answers"])
    for (const nlohmann::json& tier : answer["tiers"]) EXPECT_NE(tier["proxy"], "attenuation");
  ASSERT_EQ(info["customizations"].size(), 1u);
  const nlohmann::json& entry = info["customizations"][0];
  EXPECT_EQ(entry["field"], "density");
  EXPECT_EQ(entry["proxies"], (nlohmann::json{"attenuation", "reference"}));
  EXPECT_EQ(entry["seeds"], 1);
  EXPECT_EQ(customizationFromJson(entry["customization"]), someCustomization());
  EXPECT_NE(
      infoText(info).find("customised by position: attenuation, reference of density, 1 seed"),
      std::string::npos)
      << infoText(info);
}

}  // namespace
}  // namespace vestige
