// SPDX-License-Identifier: BSD-3-Clause
#include "proxy/format/exr/exr_header.h"

#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfVecAttribute.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "proxy/base/error.h"
#include "proxy/format/exr/exr_scan.h"
#include "proxy/base/json_object.h"
#include "proxy/format/image/learned_origin.h"

namespace vestige {
namespace {

using nlohmann::json;

[[noreturn]] void refuse(const std::string& reason) { throw Error(ErrorCode::Format, reason); }

// --- writing -------------------------------------------------------------------------------------

double finite(const char* what, double value) {
  if (!std::isfinite(value))
    throw Error(ErrorCode::InvalidArgument, fmt::format("{} of a proxy is {}", what, value));
  return value;
}

class AttributeWriter {
 public:
  explicit AttributeWriter(Imf::Header& header) : header_(header) {}
  /// An empty text is an absent attribute.
  void text(const char* name, const std::string& value) {
    if (!value.empty()) header_.insert(name, Imf::StringAttribute(value));
  }
  void number(const char* name, double value) {
    header_.insert(name, Imf::DoubleAttribute(finite(name, value)));
  }
  void vector(const char* name, glm::dvec3 v) {
    for (int i = 0; i < 3; ++i) finite(name, v[i]);
    header_.insert(name, Imf::V3dAttribute(Imath::V3d(v.x, v.y, v.z)));
  }
  void integer(const char* name, int value) { header_.insert(name, Imf::IntAttribute(value)); }
  void numbers(const char* name, std::span<const double> values) {
    json list = json::array();
    for (double v : values) list.push_back(finite(name, v));
    text(name, list.dump());
  }

 private:
  Imf::Header& header_;
};

/// glm stores columns and multiplies column vectors, Imath stores rows and multiplies row vectors:
/// the same sixteen numbers in the same places.
Imath::M44f rowVectorMatrix(const glm::dmat4& m) {
  Imath::M44f out;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) out.x[i][j] = float(m[i][j]);
  return out;
}

struct ProjectionName {
  Projection projection;
  const char* name;
};
constexpr ProjectionName kProjections[] = {{Projection::Orthographic, "orthographic"},
                                           {Projection::Perspective, "perspective"},
                                           {Projection::MultiPerspective, "multi-perspective"}};

void setCamera(Imf::Header& header, AttributeWriter& write, const Camera& camera, ImageSize size) {
  for (const auto& [projection, name] : kProjections)
    if (projection == camera.projection) write.text("vestige:projection", name);
  write.vector("vestige:position", camera.position);
  write.vector("vestige:forward", camera.forward);
  write.vector("vestige:up", camera.up);
  write.number("vestige:viewHeight", camera.viewHeight);
  write.number("vestige:pixelAspect", camera.pixelAspect);
  write.number("vestige:fieldOfView", camera.fieldOfView);
  write.number("vestige:nearDepth", camera.nearDepth);
  write.number("vestige:farDepth", camera.farDepth);
  Imf::addWorldToCamera(header, rowVectorMatrix(camera.eyeFromWorld()));
  if (camera.projection == Projection::MultiPerspective)
    write.number("vestige:convergence", camera.convergence);
  else  // no matrix makes a multi-perspective picture
    Imf::addWorldToNDC(header, rowVectorMatrix(camera.clipFromWorld(size.aspect())));
}

/// JSON has no infinity and no NaN; a field's moments may overflow into either.
json withSpelledNonFinites(json object) {
  for (auto& value : object)
    if (value.is_number_float() && !std::isfinite(value.get<double>()))
      value = fmt::format("{}", value.get<double>());
  return object;
}

json withNonFiniteNumbers(json object) {
  for (auto& value : object) {
    if (!value.is_string()) continue;
    const std::string text = value.get<std::string>();
    double sign = text.starts_with('-') ? -1.0 : 1.0;
    if (text.ends_with("inf")) value = sign * HUGE_VAL;
    if (text.ends_with("nan")) value = std::copysign(std::nan(""), sign);
  }
  return object;
}

void requireFinite(const json& value) {
  if (value.is_structured())
    for (const auto& inner : value) requireFinite(inner);
  else if (value.is_number_float())
    finite("a transfer function, classifier or customisation", value.get<double>());
}

/// What a reader would refuse must not be written.
void requireReadable(const ProxyHeader& proxy) {
  proxy.camera.validate();
  if (proxy.customization) {
    requireFinite(toJson(*proxy.customization));
    proxy.customization->points(proxy.domain);
  }
  try {
    statisticsFromJson(toJson(proxy.statistics));
  } catch (const Error& e) {
    throw Error(ErrorCode::InvalidArgument, e.what());
  }
}

/// Shortest text that reads back as the same float; locale-free.
std::string textOf(float value) { return fmt::format("{}", value); }

// --- reading -------------------------------------------------------------------------------------

class AttributeReader {
 public:
  explicit AttributeReader(const Imf::Header& header) : header_(header) {}
  std::string text(const char* name) const {
    auto* a = find<Imf::StringAttribute>(name);
    return a ? a->value() : std::string();
  }
  std::string neededText(const char* name) const {
    auto* a = find<Imf::StringAttribute>(name);
    if (!a) missing(name);
    return a->value();
  }
  bool has(const char* name) const { return header_.find(name) != header_.end(); }
  double number(const char* name) const {
    auto* a = find<Imf::DoubleAttribute>(name);
    if (!a) missing(name);
    if (!std::isfinite(a->value())) refuse(fmt::format("attribute '{}' is {}", name, a->value()));
    return a->value();
  }
  int integer(const char* name) const {
    auto* a = find<Imf::IntAttribute>(name);
    if (!a) missing(name);
    return a->value();
  }
  glm::dvec3 vector(const char* name) const {
    auto* a = find<Imf::V3dAttribute>(name);
    if (!a) missing(name);
    const glm::dvec3 v(a->value().x, a->value().y, a->value().z);
    for (int i = 0; i < 3; ++i)
      if (!std::isfinite(v[i])) refuse(fmt::format("attribute '{}' has {}", name, v[i]));
    return v;
  }
  std::vector<double> numbers(const char* name) const {
    std::string text = this->text(name);
    if (text.empty()) return {};
    return parseJson(text).get<std::vector<double>>();
  }

 private:
  template <typename Attribute>
  const Attribute* find(const char* name) const {
    return header_.findTypedAttribute<Attribute>(name);
  }
  [[noreturn]] static void missing(const char* name) {
    refuse(fmt::format("attribute '{}' is missing or of another type", name));
  }
  const Imf::Header& header_;
};

Camera cameraFrom(const AttributeReader& read) {
  Camera camera;
  const std::string projection = read.neededText("vestige:projection");
  const auto* known = std::find_if(std::begin(kProjections), std::end(kProjections),
                                   [&](const ProjectionName& p) { return projection == p.name; });
  if (known == std::end(kProjections))
    refuse("attribute 'vestige:projection' is '" + projection + "'");
  camera.projection = known->projection;
  if (camera.projection == Projection::MultiPerspective)
    camera.convergence = read.number("vestige:convergence");
  camera.position = read.vector("vestige:position");
  camera.forward = read.vector("vestige:forward");
  camera.up = read.vector("vestige:up");
  camera.viewHeight = read.number("vestige:viewHeight");
  camera.pixelAspect = read.has("vestige:pixelAspect") ? read.number("vestige:pixelAspect") : 1.0;
  camera.fieldOfView = read.number("vestige:fieldOfView");
  camera.nearDepth = read.number("vestige:nearDepth");
  camera.farDepth = read.number("vestige:farDepth");
  camera.validate();
  return camera;
}

std::vector<TransferFunction> looksFrom(const json& list) {
  if (!list.is_array() || list.size() > std::size_t(kMostTrainingPictures))
    refuse(fmt::format("attribute 'vestige:looks' is no list of at most {} functions",
                       kMostTrainingPictures));
  std::vector<TransferFunction> looks;
  for (const json& look : list) looks.push_back(transferFunctionFromJson(look));
  return looks;
}

template <typename Number>
Number numberFrom(std::string_view text, const char* attribute) {
  Number value{};
  auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || text.empty())
    refuse(fmt::format("attribute '{}' has '{}' where a number belongs", attribute, text));
  return value;
}

/// The words of a space-separated list of KEY<separator>VALUE, in order.
std::vector<std::pair<std::string, std::string>> pairsFrom(const std::string& text, char separator,
                                                           const char* attribute) {
  std::vector<std::pair<std::string, std::string>> pairs;
  if (std::count(text.begin(), text.end(), ' ') >= ExrLimits::kChannels)
    refuse(fmt::format("attribute '{}' lists more than {} channels", attribute,
                       int(ExrLimits::kChannels)));
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = std::min(text.find(' ', at), text.size());
    std::string word = text.substr(at, end - at);
    std::size_t cut = word.rfind(separator);
    if (cut == std::string::npos || cut == 0 || cut + 1 == word.size())
      refuse(fmt::format("attribute '{}' has the word '{}'", attribute, word));
    pairs.emplace_back(word.substr(0, cut), word.substr(cut + 1));
    at = end + 1;
  }
  return pairs;
}

}  // namespace

void setProxyAttributes(Imf::Header& header, const ProxyHeader& proxy) {
  requireReadable(proxy);
  AttributeWriter write(header);
  write.integer("vestige:schema", kSchemaVersion);
  write.text("vestige:kind", proxy.kind);
  write.text("vestige:field", proxy.field);
  write.text("vestige:units", proxy.units);
  write.number("vestige:time", proxy.time);
  write.text("vestige:cycle", std::to_string(proxy.cycle));
  write.text("vestige:view", proxy.view);
  setCamera(header, write, proxy.camera, proxy.size);
  write.vector("vestige:domainLow", proxy.domain.low);
  write.vector("vestige:domainHigh", proxy.domain.high);
  if (proxy.partition) write.numbers("vestige:bounds", proxy.partition->bounds());
  if (proxy.base) {
    json base = toJson(*proxy.base);
    requireFinite(base);
    write.text("vestige:baseTransferFunction", base.dump());
  }
  if (proxy.customization) write.text("vestige:customization", toJson(*proxy.customization).dump());
  if (!proxy.isovalues.empty()) write.numbers("vestige:isovalues", proxy.isovalues);
  if (!proxy.slabDepths.empty()) write.numbers("vestige:slabDepths", proxy.slabDepths);
  if (proxy.grid) write.text("vestige:grid", toJson(*proxy.grid).dump());
  write.text("vestige:shading", proxy.shading);
  if (!proxy.looks.empty()) {
    json looks = json::array();
    for (const TransferFunction& look : proxy.looks) looks.push_back(toJson(look));
    requireFinite(looks);
    write.text("vestige:looks", looks.dump());
  }
  if (proxy.learned) {
    finite("the error of learned colours", proxy.learned->error);
    write.text("vestige:learned", toJson(*proxy.learned).dump());
  }
  if (proxy.features) {
    const json features = toJson(*proxy.features);
    requireFinite(features);
    write.text("vestige:classifier", features.dump());
  }
  write.text("vestige:statistics", withSpelledNonFinites(toJson(proxy.statistics)).dump());
  write.text("vestige:provenance", proxy.provenance);
  write.text("comments", proxy.note);
  write.text("owner", proxy.owner);
}

void setPartAttributes(Imf::Header& header, const PartLayout& layout) {
  AttributeWriter write(header);
  write.number("vestige:unit", layout.unit);
  write.number("vestige:zero", layout.zero);
  write.number("vestige:error", layout.error);
  std::string channels, constants, fills;
  auto add = [](std::string& list, const std::string& word) {
    if (!list.empty()) list += ' ';
    list += word;
  };
  for (const ChannelLayout& c : layout.channels) {
    add(channels, c.name + (c.storage == ChannelStorage::Half ? ":half" : ":float"));
    if (c.constant)
      add(constants, c.name + "=" + textOf(c.fill));
    else if (c.fill != 0.0f)
      add(fills, c.name + "=" + textOf(c.fill));
  }
  write.text("vestige:channels", channels);
  write.text("vestige:constantChannels", constants);
  write.text("vestige:fill", fills);
}

ProxyHeader proxyHeaderFrom(const Imf::Header& header) try {
  AttributeReader read(header);
  int schema = read.integer("vestige:schema");
  if (schema < 1 || schema > kSchemaVersion)
    refuse(fmt::format("its schema version is {}, this program reads 1 to {}", schema,
                       kSchemaVersion));
  ProxyHeader proxy;
  proxy.kind = read.neededText("vestige:kind");
  proxy.field = read.neededText("vestige:field");
  proxy.units = read.text("vestige:units");
  proxy.time = read.number("vestige:time");
  proxy.cycle = numberFrom<long>(read.neededText("vestige:cycle"), "vestige:cycle");
  proxy.view = read.neededText("vestige:view");
  proxy.camera = cameraFrom(read);
  const Imath::Box2i& window = header.displayWindow();
  proxy.size = {window.max.x - window.min.x + 1, window.max.y - window.min.y + 1};
  proxy.domain = {read.vector("vestige:domainLow"), read.vector("vestige:domainHigh")};
  for (int i = 0; i < 3; ++i)
    if (!(proxy.domain.low[i] <= proxy.domain.high[i]))
      refuse(fmt::format("its domain is {} .. {} along axis {}", proxy.domain.low[i],
                         proxy.domain.high[i], i));
  if (std::vector<double> bounds = read.numbers("vestige:bounds"); !bounds.empty())
    proxy.partition = IntervalPartition::fromBounds(std::move(bounds));
  if (std::string base = read.text("vestige:baseTransferFunction"); !base.empty())
    proxy.base = transferFunctionFromJson(parseJson(base));
  if (std::string custom = read.text("vestige:customization"); !custom.empty()) {
    proxy.customization =
        customizationFromJson(parseJson(custom), "vestige:customization", "attribute");
    proxy.customization->points(proxy.domain);  // throws for a seed elsewhere
  }
  proxy.isovalues = read.numbers("vestige:isovalues");
  proxy.slabDepths = read.numbers("vestige:slabDepths");
  if (proxy.slabDepths.size() > std::size_t(ExrLimits::kParts))
    refuse(fmt::format("it has {} depths of slabs", proxy.slabDepths.size()));
  if (std::string grid = read.text("vestige:grid"); !grid.empty())
    proxy.grid = fieldGridFromJson(parseJson(grid));
  proxy.shading = read.text("vestige:shading");
  if (std::string looks = read.text("vestige:looks"); !looks.empty())
    proxy.looks = looksFrom(parseJson(looks));
  if (std::string learned = read.text("vestige:learned"); !learned.empty())
    proxy.learned = learnedOriginFromJson(parseJson(learned));
  if (std::string features = read.text("vestige:classifier"); !features.empty())
    proxy.features = featureOriginFromJson(parseJson(features));
  if (proxy.isovalues.size() > std::size_t(ExrLimits::kParts))
    refuse(fmt::format("it has {} isovalues", proxy.isovalues.size()));
  proxy.statistics =
      statisticsFromJson(withNonFiniteNumbers(parseJson(read.neededText("vestige:statistics"))));
  proxy.provenance = read.text("vestige:provenance");
  proxy.note = read.text("comments");
  proxy.owner = read.text("owner");
  return proxy;
} catch (const json::exception& e) {
  refuse(e.what());
} catch (const Error& e) {
  refuse(e.what());
}

PartLayout partLayoutFrom(const Imf::Header& header) {
  AttributeReader read(header);
  PartLayout layout;
  layout.name = header.hasName() ? header.name() : std::string();
  if (layout.name.empty()) refuse("a part has no name");
  layout.unit = read.number("vestige:unit");
  layout.zero = read.number("vestige:zero");
  layout.error = read.number("vestige:error");
  if (!(layout.unit > 0.0)) refuse(fmt::format("attribute 'vestige:unit' is {}", layout.unit));
  std::set<std::string> names;
  for (auto& [name, storage] :
       pairsFrom(read.neededText("vestige:channels"), ':', "vestige:channels")) {
    if (storage != "half" && storage != "float")
      refuse(fmt::format("channel '{}' is stored as '{}'", name, storage));
    if (!names.insert(name).second) refuse(fmt::format("channel '{}' comes twice", name));
    layout.channels.push_back(
        {name, storage == "half" ? ChannelStorage::Half : ChannelStorage::Float});
  }
  auto setFills = [&](const char* attribute, bool constant) {
    for (auto& [name, value] : pairsFrom(read.text(attribute), '=', attribute)) {
      auto it = std::find_if(layout.channels.begin(), layout.channels.end(),
                             [&, &n = name](const ChannelLayout& c) { return c.name == n; });
      if (it == layout.channels.end())
        refuse(fmt::format("attribute '{}' names an unknown channel '{}'", attribute, name));
      it->fill = numberFrom<float>(value, attribute);
      it->constant = constant;
    }
  };
  setFills("vestige:fill", false);
  setFills("vestige:constantChannels", true);
  return layout;
}

}  // namespace vestige
