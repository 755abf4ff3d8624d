// SPDX-License-Identifier: BSD-3-Clause
//
// One scene in many units: values and lengths from atoms' to galaxies', in situ and afterwards,
// make the same pictures.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "explorer/export/export_arrays.h"
#include "explorer/inspect/probe_pixel.h"
#include "explorer/renderer/renderer.h"
#include "proxy/gl/device.h"
#include "tests/adaptor/api/simulation.h"

namespace vestige::test {
namespace {

struct Scale {
  std::string name;
  double length = 1.0;               ///< of the domain
  double value = 1.0, offset = 0.0;  ///< value = offset + value * v, v in 1 .. 2
  double tolerance = 0.004;          ///< root of the mean square, linear light
};

std::shared_ptr<gl::Device> device() {
  static const std::shared_ptr<gl::Device> shared = gl::Device::create();
  return shared;
}

constexpr std::array<int, 3> kPoints{16, 14, 12};

/// A step of the scene with every kind of proxy.
std::string archiveOf(const Folder& folder, const Scale& scale) {
  const std::string path = folder / (scale.name + ".cdb");
  const std::string config = R"(
[image]
width = 40
height = 36
proxies = ["attenuation", "length", "depth", "mip", "reference", "layered", "sliced", "field",
           "features", "sliced-features"]
[output]
previews = false
[reduced_field]
tolerance = 1e-3
[[view]]
set = "front"
[[view]]
set = "front"
projection = "multi-perspective"
[[classifier]]
kind = "gaussian"
fields = ["f"]
)";
  // Layers do not go with multi-perspective views.
  const auto variant = [&](bool layered) {
    std::string text = config;
    const auto drop = [&](const std::string& part) { text.erase(text.find(part), part.size()); };
    if (layered) {
      drop("[[view]]\nset = \"front\"\nprojection = \"multi-perspective\"\n");
    } else {
      drop("\"layered\", ");
    }
    return text;
  };
  for (const bool layered : {false, true}) {
    Simulation run(path + (layered ? "" : ".distorted"), variant(layered));
    std::vector<double> values;
    for (int z = 0; z < kPoints[2]; ++z) {
      for (int y = 0; y < kPoints[1]; ++y) {
        for (int x = 0; x < kPoints[0]; ++x) {
          const double v =
              0.5 + 0.5 * std::sin(0.5 * x) * std::cos(0.45 * y) * std::sin(0.2 + 0.3 * z);
          values.push_back(scale.offset + scale.value * (scale.offset == 0.0 ? 1.0 + v : v));
        }
      }
    }
    vestige_grid grid = VESTIGE_GRID_INIT;
    for (std::size_t a = 0; a < 3; ++a) {
      grid.points[a] = kPoints[a];
      grid.spacing[a] = scale.length / 15.0;
      grid.origin[a] = -0.3 * scale.length;
    }
    vestige_block(run.session, 0, &grid);
    vestige_share_field(run.session, 0, "f", VESTIGE_FLOAT64, VESTIGE_POINT, 1, values.data(),
                        nullptr);
    EXPECT_EQ(vestige_execute(run.session, 0, 0.0), VESTIGE_OK) << scale.name << run.error();
  }
  EXPECT_EQ(damageOf(path), "") << scale.name;
  return path;
}

struct Drawing {
  std::string name;
  std::function<void(Look&, const Scale&)> look;
  bool distorted = false;
};

std::vector<Drawing> drawings() {
  const auto of = [](Source source, double azimuth = 0.0, Shading shading = Shading::None) {
    return [=](Look& look, const Scale&) {
      look.source = source;
      look.rotate.azimuth = azimuth;
      look.shading = shading;
    };
  };
  const auto drawn = [](Draw draw) {
    return [=](Look& look, const Scale& scale) {
      look.source = Source::Field;
      look.draw = draw;
      look.rotate.azimuth = 20.0;
      if (draw == Draw::Isosurface) {
        const double v = scale.offset == 0.0 ? 1.6 : 0.6;
        look.isosurfaces = {{scale.offset + scale.value * v, 1.0}};
      }
    };
  };
  return {{"lengths", [](Look& look, const Scale&) { look.via = Via::Length; }},
          {"attenuation", [](Look& look, const Scale&) { look.via = Via::Attenuation; }},
          {"reference", of(Source::Reference)},
          {"largest value", of(Source::Mip)},
          {"lit volume", of(Source::Volume, 0.0, Shading::Phong)},
          {"surfaces", of(Source::Layers, 15.0)},
          {"lit surfaces",
           [](Look& look, const Scale&) {
             look.source = Source::Layers;
             look.rotate.azimuth = 15.0;
             look.shading = Shading::Phong;
             look.ao.on = true;
           }},
          {"layers", of(Source::Layered)},
          {"turned layers", of(Source::Layered, 25.0)},
          {"stack", of(Source::Sliced)},
          {"turned stacks", of(Source::Sliced, 35.0)},
          {"lit stacks", of(Source::Sliced, 35.0, Shading::Phong)},
          {"field", of(Source::Field)},
          {"turned field", of(Source::Field, 30.0)},
          {"lit field",
           [](Look& look, const Scale&) {
             look.source = Source::Field;
             look.rotate.azimuth = 30.0;
             look.shading = Shading::Phong;
             look.ao.on = true;
           }},
          {"isosurfaces", drawn(Draw::Isosurface)},
          {"slice", drawn(Draw::Slice)},
          {"largest of the field", drawn(Draw::Mip)},
          {"clipped field",
           [](Look& look, const Scale& scale) {
             look.source = Source::Field;
             look.clip = Box{glm::dvec3(-0.2 * scale.length), glm::dvec3(0.3 * scale.length)};
             look.referenceLength = 0.02 * scale.length;
           }},
          {"customised field",
           [](Look& look, const Scale& scale) {
             look.source = Source::Field;
             look.customization.emplace();
             look.customization->resolution = 32;
             look.customization->seeds.resize(1);
             look.customization->seeds[0].position = glm::dvec3(0.1 * scale.length);
             look.customization->seeds[0].parameters.opacity = 8.0;
           }},
          {"features", [](Look& look, const Scale&) { look.field = "features"; }},
          {"turned features",
           [](Look& look, const Scale&) {
             look.field = "features";
             look.rotate.azimuth = 30.0;
           }},
          {"virtual rays", of(Source::Virtual, 20.0), true},
          {"turned surfaces of a distorted view", of(Source::Layers, 20.0), true}};
}

/// Of all drawings; the camera's distance to the domain's centre in units of its size.
std::map<std::string, Picture> picturesOf(const Folder& folder, const Scale& scale) {
  const std::string path = archiveOf(folder, scale);
  std::map<std::string, Picture> pictures;
  Renderer plain(device(), std::make_shared<const Archive>(path));
  Renderer distorted(device(), std::make_shared<const Archive>(path + ".distorted"));
  for (const Drawing& drawing : drawings()) {
    Look look;
    look.field = "f";
    if (drawing.distorted) look.view = "front_distorted";
    drawing.look(look, scale);
    try {
      const Rendered made = (drawing.distorted ? distorted : plain).render(look);
      pictures[drawing.name] = made.picture;
      EXPECT_NEAR(made.camera.viewHeight / scale.length, 1.0, 0.6) << "in world units";
      for (const float depth : made.depth) {
        if (std::isfinite(depth)) {
          EXPECT_NEAR(depth / scale.length, 1.4, 1.4) << drawing.name;
          break;
        }
      }
    } catch (const std::exception& error) {
      ADD_FAILURE() << scale.name << ", " << drawing.name << ": " << error.what();
    }
  }
  return pictures;
}

double meanOpacity(const Picture& picture) {
  double sum = 0.0;
  for (std::size_t i = 0; i < picture.rgba.size(); i += 4)
    sum += picture.rgba[i] + picture.rgba[i + 1] + picture.rgba[i + 2];
  return sum / (3.0 * double(picture.size.pixels()));
}

double rootMeanSquare(const Picture& a, const Picture& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    const double difference = double(a.rgba[i]) - double(b.rgba[i]);
    sum += difference * difference;
  }
  return std::sqrt(sum / double(a.rgba.size()));
}

TEST(Scales, TheSameSceneInOtherUnitsIsTheSamePicture) {
  const Folder folder;
  const auto wanted = picturesOf(folder, {"one"});
  for (const auto& [name, picture] : wanted)
    EXPECT_GT(meanOpacity(picture), 0.01) << name << " is not black";
  for (const Scale& scale : std::vector<Scale>{{"stars in cm", 4.5e13},
                                               {"clusters in cm", 3e25},
                                               {"atoms in m", 1e-10},
                                               {"large values", 1.0, 1e300},
                                               {"small values", 1.0, 1e-300},
                                               {"floats' end", 1.0, 1e38},
                                               {"the largest of both", 9e29, 1e300},
                                               {"the smallest of both", 1.1e-30, 1e-300},
                                               {"small on large", 1.0, 0.01, -1e12, 0.03},
                                               {"pressure", 1.0, 0.01, 101325.0}}) {
    SCOPED_TRACE(scale.name);
    const auto made = picturesOf(folder, scale);
    for (const auto& [name, picture] : wanted) {
      const auto found = made.find(name);
      if (found == made.end()) continue;  // said already
      EXPECT_LT(rootMeanSquare(picture, found->second), scale.tolerance) << name;
    }
  }
}

/// All numbers of a probe, by their place in it.
void numbersOf(const nlohmann::json& json, const std::string& place,
               std::map<std::string, double>& out) {
  if (json.is_number()) out[place] = json.get<double>();
  if (!json.is_structured()) return;
  for (const auto& [key, value] : json.items()) numbersOf(value, place + "/" + key, out);
}

TEST(Scales, ProbesAndExportsAreInTheRunsUnits) {
  const Folder folder;
  const auto probed = [&](const Scale& scale, nlohmann::json& probe,
                          std::map<std::string, std::vector<double>>& exported) {
    const auto archive = std::make_shared<const Archive>(archiveOf(folder, scale));
    Look look;
    look.field = "f";
    probe = probePixel(*archive, look, Renderer(device(), archive).render(look), 18, 17);
    for (const ArchiveRow& row : archive->rows())
      if (row.field == "f")
        for (const ExportArray& array : exportArrays(archive->open(row)))
          exported[row.view + row.proxy + array.part] = array.values(0);
  };
  nlohmann::json one;
  std::map<std::string, std::vector<double>> oneExported;
  probed({"one"}, one, oneExported);
  std::map<std::string, double> wanted;
  numbersOf(one, "", wanted);
  EXPECT_GT(wanted.size(), 200u);
  for (const Scale& scale :
       std::vector<Scale>{{"large", 0x1p99, 0x1p990}, {"small", 0x1p-99, 0x1p-990}}) {
    SCOPED_TRACE(scale.name);
    nlohmann::json made;
    std::map<std::string, std::vector<double>> exported;
    probed(scale, made, exported);
    std::map<std::string, double> found;
    numbersOf(made, "", found);
    // Lengths, values, or neither.
    const auto agrees = [&](double a, double b) {
      const double near = 0.02 * std::abs(a) + 0.02;
      if (std::isnan(a) || std::isinf(a)) return !std::isfinite(b);
      return std::abs(b / scale.length - a) < near || std::abs(b / scale.value - a) < near ||
             std::abs(b - a) < near;
    };
    EXPECT_EQ(found.size(), wanted.size());
    for (const auto& [place, number] : wanted) {
      if (!found.contains(place) || place.find("linear") != place.npos) continue;
      EXPECT_TRUE(agrees(number, found[place])) << place << ": " << number << " " << found[place];
    }
    for (const auto& [name, values] : oneExported) {
      ASSERT_EQ(exported[name].size(), values.size()) << name;
      for (std::size_t i = 0; i < values.size(); i += 7)
        ASSERT_TRUE(agrees(values[i], exported[name][i]))
            << name << ": " << values[i] << " " << exported[name][i];
    }
  }
}

TEST(Scales, LengthsBeyondAreRefusedByName) {
  const Folder folder;
  int number = 0;
  for (const auto& [length, said] :
       std::vector<std::pair<double, std::string>>{{1e31, "1e+31"},
                                                   {1e300, "1e+300"},
                                                   {1.7e308, "1.7e+308"},
                                                   {1e-31, "1e-31"},
                                                   {1e-300, "1e-300"}}) {
    Simulation run(folder / std::to_string(number++));
    vestige_grid grid = VESTIGE_GRID_INIT;
    const std::array<double, 2> ends{-0.5 * length, 0.5 * length};
    const std::vector<double> values{1, 2, 3, 4, 5, 6, 7, 8};
    for (std::size_t a = 0; a < 3; ++a) {
      grid.points[a] = 2;
      grid.axes[a] = ends.data();
    }
    vestige_block(run.session, 0, &grid);
    vestige_share_field(run.session, 0, "f", VESTIGE_FLOAT64, VESTIGE_POINT, 1, values.data(),
                        nullptr);
    EXPECT_EQ(vestige_execute(run.session, 0, 0.0), VESTIGE_ERROR_GRID) << said;
    EXPECT_NE(run.error().find("the domain is " + said + " long"), std::string::npos)
        << run.error();
  }
}

}  // namespace
}  // namespace vestige::test
