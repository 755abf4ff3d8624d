// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>

#include "explorer/picture/look.h"
#include "proxy/base/error.h"
#include "proxy/base/json_object.h"

namespace vestige {
namespace {

using nlohmann::json;

template <typename Enum>
using Names = std::vector<std::pair<const char*, Enum>>;

const Names<Shading> kShadings{
    {"auto", Shading::Auto}, {"none", Shading::None}, {"phong", Shading::Phong}};
const Names<Frame> kFrames{
    {"auto", Frame::Auto}, {"stored", Frame::Stored}, {"fit", Frame::Fit}, {"orbit", Frame::Orbit}};
const Names<Coloring> kColorings{{"function", Coloring::Function}, {"learned", Coloring::Learned}};
const Names<Via> kVias{
    {"auto", Via::Auto}, {"length", Via::Length}, {"attenuation", Via::Attenuation}};
const Names<Order> kOrders{{"auto", Order::Auto}, {"runs", Order::Runs}, {"mean", Order::Mean}};
const Names<NormalSource> kNormals{{"stored", NormalSource::Stored},
                                   {"depth", NormalSource::Depth}};
const Names<Source> kSources{{"auto", Source::Auto},           {"volume", Source::Volume},
                             {"layers", Source::Layers},       {"mip", Source::Mip},
                             {"reference", Source::Reference}, {"layered", Source::Layered},
                             {"field", Source::Field},         {"sliced", Source::Sliced},
                             {"virtual", Source::Virtual},     {"features", Source::Features}};
const Names<Draw> kDraws{{"volume", Draw::Volume},
                         {"isosurface", Draw::Isosurface},
                         {"mip", Draw::Mip},
                         {"slice", Draw::Slice}};

const Names<Seeds> kSeeds{
    {"none", Seeds::None}, {"value", Seeds::Value}, {"identity", Seeds::Identity}};

template <typename Enum>
const char* nameOf(const Names<Enum>& names, Enum value) {
  for (const auto& [name, enumerator] : names) {
    if (enumerator == value) return name;
  }
  throw Error(ErrorCode::Internal, "a look holds an enumerator without a name");
}

void readFixed(JsonObject& object, const char* key, std::size_t count,
               std::vector<double>& values) {
  object.read(key, values);
  if (!values.empty() && values.size() != count) {
    object.fail(key, "must hold " + std::to_string(count) + " numbers, not " +
                         std::to_string(values.size()));
  }
  if (values.empty() && object.find(key)) object.fail(key, "must not be empty");
}

void readStep(JsonObject& object, Look& look) {
  if (const json* cycle = object.find("cycle")) {
    const bool fits =
        !cycle->is_number_unsigned() ||
        cycle->get<std::uint64_t>() <= std::uint64_t(std::numeric_limits<long>::max());
    if (!cycle->is_number_integer() || !fits)
      object.fail("cycle", "must be an integer of 64 bits, not " + cycle->dump());
    look.cycle = cycle->get<long>();
  }
  if (object.find("time")) {
    double time = 0.0;
    object.read("time", time);
    look.time = time;
  }
  object.read("field", look.field);
  object.read("view", look.view);
  object.readName("source", kSources, look.source);
  std::vector<double> size, rotate;
  readFixed(object, "size", 2, size);
  if (!size.empty()) {
    for (double side : size) {
      if (!(side >= 1.0 && side <= 16384.0) || side != std::floor(side)) {
        object.fail("size", "must be integers in [1, 16384], not " + object.find("size")->dump());
      }
    }
    look.size = ImageSize{int(size[0]), int(size[1])};
  }
  readFixed(object, "rotate", 3, rotate);
  if (!rotate.empty()) look.rotate = {rotate[0], rotate[1], rotate[2]};
}

std::optional<std::vector<OpacityPoint>> readPoints(JsonObject& object, const char* key) {
  const json* points = object.find(key);
  if (!points) return std::nullopt;
  if (!points->is_array()) object.fail(key, "must be a list of [value, opacity] pairs");
  std::vector<OpacityPoint> result;
  for (const json& point : *points) {
    if (!point.is_array() || point.size() != 2 || !point[0].is_number() || !point[1].is_number()) {
      object.fail(key, "holds " + point.dump() + ", not a [value, opacity] pair");
    }
    result.push_back({point[0].get<double>(), point[1].get<double>()});
  }
  return result;
}

/// A list of [value, opacity] and of {"value", "opacity", "color"}.
void readSurfaces(JsonObject& object, Look& look) {
  const json* surfaces = object.find("isosurfaces");
  if (!surfaces) return;
  if (!surfaces->is_array()) object.fail("isosurfaces", "must be a list of surfaces");
  for (std::size_t i = 0; i < surfaces->size(); ++i) {
    const json& entry = (*surfaces)[i];
    SurfaceLook& surface = look.isosurfaces.emplace_back();
    if (entry.is_object()) {
      JsonObject keys(entry, "isosurfaces[" + std::to_string(i) + "]");
      if (!keys.find("value")) keys.fail("value", "is missing");
      keys.read("value", surface.value);
      keys.read("opacity", surface.opacity);
      keys.read("color", surface.color);
      keys.finish();
    } else if (entry.is_array() && entry.size() == 2 && entry[0].is_number() &&
               entry[1].is_number()) {
      surface.value = entry[0].get<double>();
      surface.opacity = entry[1].get<double>();
    } else {
      object.fail("isosurfaces", "holds " + entry.dump() +
                                     ", neither a [value, opacity] pair nor an object with value");
    }
  }
}

void readFraming(JsonObject& object, Look& look) {
  object.readName("frame", kFrames, look.frame);
  if (const json* rotations = object.find("frameFor")) {
    for (const json& entry : rotations->is_array() ? *rotations : json::array({nullptr})) {
      if (!entry.is_array() || entry.size() != 3 ||
          !std::all_of(entry.begin(), entry.end(), [](const json& v) { return v.is_number(); })) {
        object.fail("frameFor", "must be a list of [azimuth, elevation, roll]");
      }
      look.frameFor.push_back({entry[0], entry[1], entry[2]});
    }
  }
  object.read("zoom", look.zoom);
  std::vector<double> pan, center, scale;
  readFixed(object, "pan", 2, pan);
  if (!pan.empty()) look.pan = {pan[0], pan[1]};
  readFixed(object, "center", 3, center);
  if (!center.empty()) look.center = glm::dvec3(center[0], center[1], center[2]);
  readFixed(object, "scale", 3, scale);
  if (!scale.empty()) look.scale = {scale[0], scale[1], scale[2]};
}

void readGrid(JsonObject& object, Look& look) {
  object.readName("draw", kDraws, look.draw);
  readSurfaces(object, look);
  std::vector<double> slice, clip;
  readFixed(object, "slice", 4, slice);
  if (!slice.empty()) look.slice = glm::dvec4(slice[0], slice[1], slice[2], slice[3]);
  readFixed(object, "clip", 6, clip);
  if (!clip.empty()) look.clip = Box{{clip[0], clip[1], clip[2]}, {clip[3], clip[4], clip[5]}};
}

void readFunction(JsonObject& object, Look& look) {
  look.opacity = readPoints(object, "opacity");
  if (object.find("referenceLength")) {
    double length = 0.0;
    object.read("referenceLength", length);
    look.referenceLength = length;
  }
  object.read("colormap", look.colormap);
  std::vector<double> range;
  readFixed(object, "colorRange", 2, range);
  if (!range.empty()) look.colorRange = {range[0], range[1]};
  object.read("factors", look.factors);
  if (const json* customization = object.find("customization"))
    look.customization = customizationFromJson(*customization);
}

void readClassifier(JsonObject& object, Look& look) {
  if (const json* classifier = object.find("classifier")) {
    classifierFromJson(*classifier, "classifier");  // complains of what makes no sense
    look.classifier = classifier->dump();
  }
  for (JsonObject& each : object.list("features")) {
    look.features.push_back(featureEditFrom(each));
    each.finish();
  }
}

void readShading(JsonObject& object, Look& look) {
  object.readName("color", kColorings, look.color);
  object.readName("via", kVias, look.via);
  object.readName("order", kOrders, look.order);
  object.readName("shading", kShadings, look.shading);
  object.readName("normals", kNormals, look.normals);
  if (const json* lights = object.find("lights")) {
    if (!lights->is_array()) object.fail("lights", "must be a list of lights");
    for (std::size_t i = 0; i < lights->size(); ++i) {
      JsonObject entry((*lights)[i], "lights[" + std::to_string(i) + "]");
      Light light;
      entry.read("azimuth", light.azimuth);
      entry.read("elevation", light.elevation);
      entry.read("intensity", light.intensity);
      entry.finish();
      look.lights.push_back(light);
    }
  }
  if (const json* material = object.find("material")) {
    JsonObject entry(*material, "material");
    entry.read("ambient", look.material.ambient);
    entry.read("diffuse", look.material.diffuse);
    entry.read("specular", look.material.specular);
    entry.read("shininess", look.material.shininess);
    entry.finish();
  }
  if (const json* ao = object.find("ao")) {
    JsonObject entry(*ao, "ao");
    entry.read("on", look.ao.on);
    entry.read("strength", look.ao.strength);
    entry.read("radius", look.ao.radius);
    entry.finish();
  }
  if (const json* enhance = object.find("enhance")) {
    JsonObject entry(*enhance, "enhance");
    entry.read("on", look.enhance.on);
    entry.read("lambda", look.enhance.lambda);
    entry.read("gamma", look.enhance.gamma);
    entry.finish();
  }
}

void readPresentation(JsonObject& object, Look& look) {
  object.read("trust", look.trust);
  if (const json* annotations = object.find("annotations")) {
    JsonObject entry(*annotations, "annotations");
    entry.read("colorbar", look.annotations.colorbar);
    entry.read("axes", look.annotations.axes);
    entry.read("box", look.annotations.box);
    entry.read("time", look.annotations.time);
    entry.readName("seeds", kSeeds, look.annotations.seeds);
    entry.finish();
  }
  if (object.find("background")) {
    std::string background;
    object.read("background", background);
    look.background = backgroundFromText(background);
  }
}

json jsonFromFunction(const Look& look) {
  json result = json::object();
  if (look.opacity) {
    result["opacity"] = json::array();
    for (const OpacityPoint& point : *look.opacity) {
      result["opacity"].push_back({point.value, point.opacity});
    }
  }
  if (look.referenceLength) result["referenceLength"] = *look.referenceLength;
  if (!look.colormap.empty()) result["colormap"] = look.colormap;
  if (look.colorRange) result["colorRange"] = {look.colorRange->first, look.colorRange->second};
  if (!look.factors.empty()) result["factors"] = look.factors;
  return result;
}

/// What differs from the stored frame.
void putFraming(const Look& look, json& result) {
  if (look.frame != Frame::Auto) result["frame"] = nameOf(kFrames, look.frame);
  for (const Rotation& rotation : look.frameFor)
    result["frameFor"].push_back({rotation.azimuth, rotation.elevation, rotation.roll});
  if (look.zoom != 1.0) result["zoom"] = look.zoom;
  if (look.pan != glm::dvec2(0.0)) result["pan"] = {look.pan.x, look.pan.y};
  if (look.center) result["center"] = {look.center->x, look.center->y, look.center->z};
  if (look.scale != glm::dvec3(1.0)) result["scale"] = {look.scale.x, look.scale.y, look.scale.z};
}

}  // namespace

json toJson(const Look& look) {
  json result = jsonFromFunction(look);
  if (look.cycle) result["cycle"] = *look.cycle;
  if (look.time) result["time"] = *look.time;
  if (!look.field.empty()) result["field"] = look.field;
  if (!look.view.empty()) result["view"] = look.view;
  if (look.size) result["size"] = {look.size->width, look.size->height};
  result["rotate"] = {look.rotate.azimuth, look.rotate.elevation, look.rotate.roll};
  putFraming(look, result);
  result["source"] = nameOf(kSources, look.source);
  if (look.draw != Draw::Volume) result["draw"] = nameOf(kDraws, look.draw);
  for (const SurfaceLook& surface : look.isosurfaces) {
    json& entry = result["isosurfaces"].emplace_back();
    entry = {{"value", surface.value}, {"opacity", surface.opacity}};
    if (!surface.color.empty()) entry["color"] = surface.color;
  }
  if (look.slice) result["slice"] = {look.slice->x, look.slice->y, look.slice->z, look.slice->w};
  if (look.clip) {
    const auto &low = look.clip->low, &high = look.clip->high;
    result["clip"] = {low.x, low.y, low.z, high.x, high.y, high.z};
  }
  if (!look.classifier.empty()) result["classifier"] = json::parse(look.classifier);
  for (const FeatureEdit& edit : look.features) {
    result["features"].push_back(featureEditJson(edit));
  }
  if (look.customization) result["customization"] = toJson(*look.customization);
  result["color"] = nameOf(kColorings, look.color);
  result["via"] = nameOf(kVias, look.via);
  result["order"] = nameOf(kOrders, look.order);
  result["shading"] = nameOf(kShadings, look.shading);
  result["normals"] = nameOf(kNormals, look.normals);
  result["lights"] = json::array();
  for (const Light& light : look.lights) {
    result["lights"].push_back({{"azimuth", light.azimuth},
                                {"elevation", light.elevation},
                                {"intensity", light.intensity}});
  }
  result["material"] = {{"ambient", look.material.ambient},
                        {"diffuse", look.material.diffuse},
                        {"specular", look.material.specular},
                        {"shininess", look.material.shininess}};
  result["ao"] = {{"on", look.ao.on}, {"strength", look.ao.strength}, {"radius", look.ao.radius}};
  result["enhance"] = {
      {"on", look.enhance.on}, {"lambda", look.enhance.lambda}, {"gamma", look.enhance.gamma}};
  result["trust"] = look.trust;
  result["annotations"] = {{"colorbar", look.annotations.colorbar},
                           {"axes", look.annotations.axes},
                           {"box", look.annotations.box},
                           {"time", look.annotations.time}};
  if (look.annotations.seeds != Seeds::None)
    result["annotations"]["seeds"] = nameOf(kSeeds, look.annotations.seeds);
  result["background"] = textFromBackground(look.background);
  return result;
}

Look lookFromJson(const json& source) {
  Look look;
  JsonObject object(source, "");
  readStep(object, look);
  readFraming(object, look);
  readGrid(object, look);
  readFunction(object, look);
  readClassifier(object, look);
  readShading(object, look);
  readPresentation(object, look);
  object.finish();
  look.validate();
  return look;
}

Look lookFromText(const std::string& text) {
  json parsed;
  try {
    parsed = parseJson(text);
  } catch (const json::parse_error& error) {
    throw Error(ErrorCode::Config, std::string("the look is not JSON: ") + error.what());
  }
  return lookFromJson(parsed);
}

}  // namespace vestige
