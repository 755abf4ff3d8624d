// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <utility>

#include "explorer/picture/printable.h"
#include "explorer/program/cli.h"
#include "proxy/base/durable_file.h"
#include "proxy/base/error.h"
#include "proxy/base/json_object.h"
#include "proxy/transfer/colormap.h"

namespace vestige::cli {
namespace {

nlohmann::json jsonOfFile(const std::string& option, const std::string& path) {
  try {
    return parseJson(textOfFile(path));
  } catch (const nlohmann::json::parse_error& error) {
    throw Error(ErrorCode::Config, option + " '" + path + "' is not JSON: " + error.what());
  }
}

ImageSize sizeFromText(const std::string& text) {
  const std::size_t cross = text.find('x');
  const auto side = [&](std::size_t begin, std::size_t end) -> std::optional<int> {
    int value = 0;
    const auto [last, failed] = std::from_chars(text.data() + begin, text.data() + end, value);
    return failed == std::errc() && last == text.data() + end ? std::optional(value) : std::nullopt;
  };
  const auto width = cross == std::string::npos ? std::nullopt : side(0, cross);
  const auto height = width ? side(cross + 1, text.size()) : std::nullopt;
  if (!height)
    throw Error(ErrorCode::Config, "--size '" + text + "' is not WIDTHxHEIGHT, such as 800x600");
  return {*width, *height};
}

/// VALUE[:opacity=O,color=C].
nlohmann::json surfaceFromText(const std::string& text) {
  const auto number = [&](const std::string& piece) {
    return numbersFromText("--isosurface", piece, 1, 1).front();
  };
  const std::size_t colon = text.find(':');
  nlohmann::json surface{{"value", number(text.substr(0, colon))}};
  std::stringstream pieces(colon == std::string::npos ? "" : text.substr(colon + 1));
  for (std::string piece; std::getline(pieces, piece, ',');) {
    const std::size_t equals = piece.find('=');
    const std::string key = piece.substr(0, equals);
    const std::string value = equals == std::string::npos ? "" : piece.substr(equals + 1);
    if (key == "opacity") {
      surface["opacity"] = number(value);
    } else if (key == "color") {
      surface["color"] = value;
    } else {
      throw Error(ErrorCode::Config, "--isosurface '" + text + "': '" + piece +
                                         "' is none of opacity=, color=; such as "
                                         "'300:opacity=0.8,color=#f3ead8'");
    }
  }
  return surface;
}

nlohmann::json featureFromText(const std::string& text) {
  const auto fail = [&](const std::string& why) {
    throw Error(ErrorCode::Config, "--feature '" + text + "': " + why +
                                       "; such as 'NAME:opacity=0.8,color=#ff8800' or 'NAME:off'");
  };
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) fail("no ':' after the name");
  nlohmann::json edit{{"name", text.substr(0, colon)}};
  std::stringstream pieces(text.substr(colon + 1));
  for (std::string piece; std::getline(pieces, piece, ',');) {
    const std::size_t equals = piece.find('=');
    const std::string key = piece.substr(0, equals);
    const std::string value = equals == std::string::npos ? "" : piece.substr(equals + 1);
    if (piece == "on" || piece == "off") {
      edit["enabled"] = piece == "on";
    } else if (key == "opacity") {
      edit["opacity"] = numbersFromText("--feature", value, 1, 1).front();
    } else if (key == "color") {
      edit["color"] = value;
    } else {
      fail("'" + piece + "' is none of opacity=, color=, on, off");
    }
  }
  if (edit.size() == 1) fail("nothing to change");
  return edit;
}

}  // namespace

std::string textOfFile(const std::string& path) {
  const std::vector<std::byte> bytes = readBytes(path, std::size_t(16) << 20);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::vector<double> numbersFromText(const std::string& option, const std::string& text,
                                    std::size_t least, std::size_t most) {
  std::vector<double> numbers;
  std::stringstream pieces(text);
  for (std::string piece; std::getline(pieces, piece, ',');) {
    double number = 0.0;
    const auto [end, error] = std::from_chars(piece.data(), piece.data() + piece.size(), number);
    if (error != std::errc() || end != piece.data() + piece.size() || piece.empty()) {
      throw Error(ErrorCode::Config, option + " '" + text + "': '" + piece + "' is not a number");
    }
    numbers.push_back(number);
  }
  if (numbers.size() < least || numbers.size() > most) {
    throw Error(ErrorCode::Config, option + " '" + text + "' holds " +
                                       std::to_string(numbers.size()) + " numbers, not " +
                                       (least == most ? "" : std::to_string(least) + " to ") +
                                       std::to_string(most));
  }
  return numbers;
}

LookOptions::LookOptions(CLI::App& command) : command_(&command) {
  const std::vector<const CLI::Option*> others = std::as_const(command).get_options();
  command.add_option("--look", lookFile_, "Start from a look (JSON)");
  command.add_option("--save-look", saveLook_, "Write the look of this picture");
  auto* cycle = command.add_option("--step", cycle_, "Cycle of the step (default: the last)");
  command.add_option("--time", time_, "Simulation time; the nearest step is used")->excludes(cycle);
  command.add_option("--field", field_, "Field (default: the first)");
  command.add_option("--view", view_, "Stored view (default: the first)");
  command.add_option("--rotate", rotate_, "Orbit by AZ,EL[,ROLL] degrees");
  command.add_option("--size", size_, "Picture size WxH (default: as stored)");
  auto* frame = command.add_option(
      "--frame", frame_,
      "auto: the stored frame, widened where a turn needs it; stored; fit; orbit: fit from all "
      "azimuths");
  command.add_flag("--fit", fit_, "Fit the domain, or its clip box, into the picture")
      ->excludes(frame);
  command.add_option("--zoom", zoom_, "Enlarge by this factor about the picture's middle");
  command.add_option("--pan", pan_,
                     "Move what is seen by X,Y heights of the picture, right and up");
  command.add_option("--center", center_, "X,Y,Z in the world: the picture's middle, turned about");
  command.add_option("--scale", scale_,
                     "Stretch the axes by X,Y,Z; 1,1,50 exaggerates heights 50 times");
  command.add_option(
      "--source", source_,
      "auto, volume, layers, mip, reference, layered, field, sliced, virtual; of "
      "multi-perspective views layers undistorts surfaces, virtual casts rays through "
      "the intervals, volume shows the picture as stored");
  command.add_option("--draw", draw_, "Of fields and stacks: volume, isosurface, mip, slice");
  command.add_option("--isosurfaces", isosurfaces_,
                     "Surfaces of equal value and their opacities 'v:o,v:o,...'");
  command
      .add_option("--isosurface", surfaces_,
                  "One more: 'VALUE[:opacity=O,color=#rrggbb]', or color=map; may be repeated")
      ->allow_extra_args(false);
  command.add_option("--slice", slice_, "Plane NX,NY,NZ,D: the points with n . x = D");
  command.add_option("--clip", clip_, "Draw only X0,Y0,Z0,X1,Y1,Z1 in world units");
  command.add_option("--opacity", opacity_, "Opacity per reference length 'v:o,v:o,...'");
  command.add_option("--reference-length", referenceLength_, "World length of these opacities");
  command.add_option("--factors", factors_, "One opacity factor an interval '1,0,2,...'");
  command.add_option(
      "--colormap", colormap_,
      "Colour map by name, _r reverses: " + fmt::format("{}", fmt::join(Colormap::names(), ", ")));
  command.add_option("--color-range", colorRange_, "LOW,HIGH of the colour map");
  command.add_option("--classifier", classifierFile_,
                     "Classify by a file: JSON as in looks, or a [[classifier]] of TOML keys as "
                     "JSON; see docs/classification.md");
  command
      .add_option("--feature", features_,
                  "Change a feature 'NAME:opacity=0.8,color=#ff8800', 'NAME:off', 'NAME:on'; may "
                  "be repeated")
      ->allow_extra_args(false);
  command.add_option("--color", color_, "function, or learned: see train");
  command.add_option("--via", via_, "auto, length, attenuation");
  command.add_option("--order", order_, "auto, runs, mean");
  command.add_option("--customize", customize_, "Position-dependent customisation (JSON)");
  command.add_option("--seeds", seeds_, "Draw its seeds: none, value, identity");
  command.add_option("--light", lights_, "Light from AZ,EL[,INTENSITY]; may be repeated")
      ->allow_extra_args(false);
  command.add_option("--shading", shading_, "auto (isosurfaces are lit), none, phong");
  command.add_option("--normals", normals_, "stored, depth");
  command.add_flag("--ao", ao_, "Proxy ambient occlusion");
  command.add_option("--ao-radius", aoRadius_, "Its radius, a fraction of the domain's diagonal");
  command.add_flag("--enhance", enhance_, "Depth-aware enhancement");
  command.add_option("--enhance-lambda", enhanceLambda_, "Its strength");
  command.add_flag("--colorbar", colorbar_, "Colour bar with units");
  command.add_flag("--axes", axes_, "Axes triad");
  command.add_flag("--box", box_, "Outline of the domain");
  command.add_flag("--time-label", timeLabel_, "Time and cycle");
  command.add_option("--background", background_, "black, white, grey, transparent, #rrggbb");
  command.add_flag("--trust", trust_, "Tint what is interpolated or guessed");
  command.add_option("--gl", backend_, "auto, osmesa, egl")->capture_default_str();
  std::vector<CLI::Option*> own;
  for (CLI::Option* option : command.get_options())
    if (std::find(others.begin(), others.end(), option) == others.end()) own.push_back(option);
  groupLookOptions(own);
}

Look LookOptions::look() const {
  const auto given = [&](const char* option) { return command_->count(option) > 0; };
  Look start;
  if (!lookFile_.empty()) {
    const std::string text = textOfFile(lookFile_);
    try {
      start = lookFromText(text);
    } catch (const Error& error) {
      throw Error(error.code(), "--look '" + lookFile_ + "': " + error.what());
    }
  }
  if (given("--step") || given("--time")) {
    start.cycle.reset();
    start.time.reset();
  }
  // The options become keys of the look's JSON, so that one reader judges both.
  nlohmann::json json = toJson(start);
  const auto text = [&](const char* option, const char* key, const std::string& value) {
    if (given(option)) json[key] = value;
  };
  if (given("--step")) json["cycle"] = cycle_;
  if (given("--time")) json["time"] = time_;
  text("--field", "field", field_);
  text("--view", "view", view_);
  text("--source", "source", source_);
  text("--draw", "draw", draw_);
  if (given("--isosurfaces") || given("--isosurface")) {
    json["isosurfaces"] = nlohmann::json::array();
    for (const std::string& surface : surfaces_)
      json["isosurfaces"].push_back(surfaceFromText(surface));
    if (!given("--draw")) json["draw"] = "isosurface";
  }
  if (given("--isosurfaces")) {
    for (const OpacityPoint& point : opacityFromText(isosurfaces_)) {
      json["isosurfaces"].push_back({point.value, point.opacity});
    }
  }
  if (given("--slice")) {
    json["slice"] = numbersFromText("--slice", slice_, 4, 4);
    if (!given("--draw")) json["draw"] = "slice";
  }
  if (given("--clip")) json["clip"] = numbersFromText("--clip", clip_, 6, 6);
  text("--colormap", "colormap", colormap_);
  text("--color", "color", color_);
  text("--via", "via", via_);
  text("--order", "order", order_);
  text("--shading", "shading", shading_);
  text("--normals", "normals", normals_);
  text("--background", "background", background_);
  if (given("--customize")) json["customization"] = jsonOfFile("--customize", customize_);
  if (given("--seeds")) json["annotations"]["seeds"] = seeds_;
  if (given("--rotate")) {
    std::vector<double> angles = numbersFromText("--rotate", rotate_, 2, 3);
    angles.resize(3, 0.0);
    json["rotate"] = angles;
  }
  if (given("--rotate") || given("--frame") || fit_) json.erase("frameFor");
  text("--frame", "frame", frame_);
  if (fit_) json["frame"] = "fit";
  if (given("--zoom")) json["zoom"] = zoom_;
  if (given("--pan")) json["pan"] = numbersFromText("--pan", pan_, 2, 2);
  if (given("--center")) json["center"] = numbersFromText("--center", center_, 3, 3);
  if (given("--scale")) json["scale"] = numbersFromText("--scale", scale_, 3, 3);
  if (given("--size")) {
    const ImageSize size = sizeFromText(size_);
    json["size"] = {size.width, size.height};
  }
  if (given("--opacity")) {
    json["opacity"] = nlohmann::json::array();
    for (const OpacityPoint& point : opacityFromText(opacity_)) {
      json["opacity"].push_back({point.value, point.opacity});
    }
  }
  if (given("--reference-length")) json["referenceLength"] = referenceLength_;
  if (given("--factors")) {
    json["factors"] = numbersFromText("--factors", factors_, 1, IntervalPartition::kMaxIntervals);
  }
  if (given("--classifier")) {
    const std::string file = textOfFile(classifierFile_);
    try {
      json["classifier"] = parseJson(file);
    } catch (const nlohmann::json::parse_error& error) {
      throw Error(ErrorCode::Config,
                  "--classifier '" + classifierFile_ + "' is not JSON: " + error.what());
    }
  }
  for (const std::string& feature : features_) {
    json["features"].push_back(featureFromText(feature));
  }
  if (given("--color-range"))
    json["colorRange"] = numbersFromText("--color-range", colorRange_, 2, 2);
  if (given("--light")) {
    json["lights"] = nlohmann::json::array();
    for (const std::string& light : lights_) {
      const std::vector<double> numbers = numbersFromText("--light", light, 2, 3);
      json["lights"].push_back({{"azimuth", numbers[0]},
                                {"elevation", numbers[1]},
                                {"intensity", numbers.size() > 2 ? numbers[2] : 1.0}});
    }
    // What is asked for shall be seen.
    if (!given("--shading")) json["shading"] = "phong";
  }
  if (ao_ || given("--ao-radius")) json["ao"]["on"] = true;
  if (given("--ao-radius")) json["ao"]["radius"] = aoRadius_;
  if (enhance_ || given("--enhance-lambda")) json["enhance"]["on"] = true;
  if (given("--enhance-lambda")) json["enhance"]["lambda"] = enhanceLambda_;
  if (trust_) json["trust"] = true;
  if (colorbar_) json["annotations"]["colorbar"] = true;
  if (axes_) json["annotations"]["axes"] = true;
  if (box_) json["annotations"]["box"] = true;
  if (timeLabel_) json["annotations"]["time"] = true;

  const Look look = lookFromJson(json);
  if (!saveLook_.empty()) {
    const std::string saved = toJson(look).dump(2) + "\n";
    writeDurably(saveLook_, std::as_bytes(std::span(saved)));
  }
  return look;
}

void printWarnings(const std::vector<Warning>& warnings) {
  for (const Warning& each : warnings)
    std::fprintf(stderr, "vestige-explorer: warning: %s\n", printable(each.text).c_str());
}

ProgressBar::ProgressBar(const char* label) : label_(label), terminal_(isatty(STDERR_FILENO)) {}

ProgressBar::~ProgressBar() {
  if (shown_) std::fputc('\n', stderr);
}

void ProgressBar::show(int done, int total) {
  if (!terminal_ || total <= 0) return;
  constexpr int kWidth = 40;
  const int filled = kWidth * done / total;
  std::string bar(std::size_t(filled), '#');
  bar.resize(kWidth, '.');
  std::fprintf(stderr, "\r%s [%s] %d/%d", label_, bar.c_str(), done, total);
  std::fflush(stderr);
  shown_ = true;
}

}  // namespace vestige::cli
