// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/config/config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <numbers>
#include <set>

#include "adaptor/config/config_reader.h"
#include "adaptor/config/customization_config.h"
#include "proxy/base/error.h"
#include "proxy/base/nearest_word.h"
#include "proxy/camera/view_set.h"
#include "proxy/format/layout/analytic_layers_layout.h"
#include "proxy/format/layout/field_layout.h"
#include "proxy/format/layout/learned_layout.h"
#include "proxy/format/layout/sliced_stack.h"
#include "proxy/transfer/colormap.h"
#include "proxy/transfer/interval_partition.h"

namespace vestige {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;

void readOutput(ConfigReader reader, Config& config) {
  reader.read("path", config.output);
  if (config.output.empty()) reader.fail("path", "the archive needs a name");
  config.existing = ExistingArchive(reader.readChoice("existing", {"refuse", "append", "overwrite"},
                                                      std::size_t(config.existing)));
  reader.read("previews", config.previews);
  reader.read("note", config.note);
  reader.read("owner", config.owner);
  if (reader.isString("background")) {
    reader.readChoice("background", {"transparent"}, 0);
    config.transparentBackground = true;
  } else if (const auto rgb = reader.readNumbers("background", 3); !rgb.empty()) {
    if (std::any_of(rgb.begin(), rgb.end(), [](double c) { return c < 0.0 || c > 1.0; })) {
      reader.fail("background", "red, green, blue are in 0..1");
    }
    config.background = {rgb[0], rgb[1], rgb[2]};
  }
  reader.rejectUnknownKeys();
}

void readGl(ConfigReader reader, Config& config) {
  static const std::vector<std::string> backends{"auto", "osmesa", "egl"};
  config.glBackend = backends[reader.readChoice("backend", backends, 0)];
  reader.readInteger("threads", 0, 1024, config.threads);
  reader.rejectUnknownKeys();
}

void readImage(ConfigReader reader, Config& config) {
  reader.readInteger("width", 1, 16384, config.size.width);
  reader.readInteger("height", 1, 16384, config.size.height);
  config.fixed.size = reader.has("width") || reader.has("height");
  config.fixed.proxies = reader.has("proxies");
  reader.read("phong", config.phong);
  reader.readPositive("step_length", config.stepLength, true);
  reader.readPositive("reference_length", config.referenceLength, true);
  bool sliced = false, training = false, slicedFeatures = false;
  const auto proxies = reader.readStrings("proxies");
  if (reader.has("proxies")) {
    const std::vector<std::pair<std::string, bool*>> kinds{{"attenuation", &config.attenuation},
                                                           {"length", &config.length},
                                                           {"depth", &config.depth},
                                                           {"mip", &config.mip},
                                                           {"reference", &config.reference},
                                                           {"training", &training},
                                                           {"layered", &config.layered},
                                                           {"sliced", &sliced},
                                                           {"field", &config.field},
                                                           {"features", &config.features},
                                                           {"sliced-features", &slicedFeatures}};
    for (const auto& [name, wanted] : kinds) *wanted = false;
    for (const auto& proxy : proxies) {
      const auto kind = std::find_if(kinds.begin(), kinds.end(),
                                     [&](const auto& entry) { return entry.first == proxy; });
      if (kind == kinds.end()) {
        std::vector<std::string> known;
        for (const auto& [name, wanted] : kinds) known.emplace_back(name);
        reader.fail("proxies", fmt::format("\"{}\" is none of \"{}\"{}", proxy,
                                           fmt::join(known, "\", \""), didYouMean(proxy, known)));
      }
      *kind->second = true;
    }
    if (proxies.empty()) reader.fail("proxies", "at least one is needed");
    if (sliced) config.sliced.emplace();
    if (slicedFeatures) config.slicedFeatures.emplace();
    if (training) config.training.emplace();
  }
  reader.rejectUnknownKeys();
}

void readLayered(ConfigReader reader, Config& config) {
  reader.readInteger("layers", 1, kMostLayers, config.layers);
  config.fixed.layers = reader.has("layers");
  if (const auto light = reader.readNumbers("light", 3); !light.empty()) {
    config.layerLight = glm::dvec3(light[0], light[1], light[2]);
    if (!(glm::length(*config.layerLight) > 0.0)) reader.fail("light", "has no direction");
  }
  if (!config.layered) {
    reader.fail("layers", "[image] proxies does not name \"layered\"");
  }
  reader.rejectUnknownKeys();
}

void readTraining(ConfigReader reader, Config& config) {
  if (!config.training) reader.fail("pictures", "[image] proxies does not name \"training\"");
  TrainingConfig& training = *config.training;
  reader.readInteger("pictures", 1, kMostTrainingPictures, training.pictures);
  reader.readNumber("scale", training.scale);
  if (!(training.scale >= 0.0 && training.scale <= 1.0)) {
    reader.fail("scale", fmt::format("{} is not in 0..1", training.scale));
  }
  if (bool light = false; reader.has("light")) {
    reader.read("light", light);
    training.light = light;
  }
  reader.rejectUnknownKeys();
}

void readSliced(ConfigReader reader, Config& config) {
  if (!config.sliced && !config.slicedFeatures) {
    reader.fail("stacks", "[image] proxies names neither \"sliced\" nor \"sliced-features\"");
  }
  SlicedConfig sliced;
  reader.read("stacks", sliced.stacks);
  if (sliced.stacks != "views") {
    try {
      viewSet(sliced.stacks, Box{{0, 0, 0}, {1, 1, 1}}, 1.0);
    } catch (const Error& error) {
      reader.fail("stacks", fmt::format("{}; or \"views\"", error.what()));
    }
  }
  reader.readInteger("pixels", 1, 4096, sliced.pixels);
  reader.readInteger("slabs", 1, SlicedStack::kMostSlabs, sliced.slabs);
  reader.readInteger("levels", 16, 128, sliced.levels);
  if (!SlicedStack::allowsLevels(sliced.levels)) {
    reader.fail("levels", fmt::format("{} is none of 16, 32, 64, 128", sliced.levels));
  }
  if (!config.sliced && reader.has("levels")) {
    reader.fail("levels", "are of \"sliced\", which [image] proxies does not name");
  }
  for (auto* made : {&config.sliced, &config.slicedFeatures}) {
    if (*made) *made = sliced;
  }
  config.fixed.stacks = reader.has("stacks");
  config.fixed.pixels = reader.has("pixels");
  config.fixed.slabs = reader.has("slabs");
  config.fixed.levels = reader.has("levels");
  reader.rejectUnknownKeys();
}

void readReducedField(ConfigReader reader, Config& config) {
  reader.readInteger("reduction", 1, 16, config.fieldReduction);
  reader.readPositive("tolerance", config.fieldTolerance);
  if (config.fieldTolerance >= 1.0) {
    reader.fail("tolerance",
                fmt::format("{} is no share of the field's range below 1", config.fieldTolerance));
  }
  if (double error = 0.0; reader.has("absolute_tolerance")) {
    reader.readPositive("absolute_tolerance", error);
    if (reader.has("tolerance")) reader.fail("absolute_tolerance", "tolerance is given as well");
    config.fieldAbsoluteError = error;
  }
  if (!config.field) reader.fail("tolerance", "[image] proxies does not name \"field\"");
  config.fixed.reduction = reader.has("reduction");
  config.fixed.tolerance = reader.has("tolerance") || reader.has("absolute_tolerance");
  reader.rejectUnknownKeys();
}

void readBudget(ConfigReader reader, BudgetConfig& budget) {
  reader.readBytes("bytes_per_step", budget.bytesPerStep);
  if (double share = 0.0; reader.has("time_share")) {
    reader.readPositive("time_share", share);
    if (share > 1.0) reader.fail("time_share", fmt::format("{} is more than 1", share));
    budget.timeShare = share;
  }
  if (!budget.any()) reader.fail("bytes_per_step", "neither this nor time_share is given");
  reader.rejectUnknownKeys();
}

void readTrigger(ConfigReader reader, TriggerConfig& trigger) {
  constexpr long kMost = 1'000'000'000'000;
  reader.readInteger("every_cycles", 1L, kMost, trigger.everyCycles);
  reader.readPositive("every_time", trigger.everyTime);
  if (auto inner = reader.table("change")) {
    auto& change = trigger.change.emplace();
    inner->read("field", change.field);
    if (change.field.empty()) inner->fail("field", "which field's statistics?");
    change.measure = TriggerConfig::Measure(
        inner->readChoice("measure", {"mean", "deviation", "low", "high", "histogram"}, 0));
    inner->readPositive("threshold", change.threshold);
    if (!inner->has("threshold")) inner->fail("threshold", "how much change?");
    inner->readInteger("every_cycles", 1L, kMost, change.everyCycles);
    inner->rejectUnknownKeys();
  }
  reader.rejectUnknownKeys();
}

std::optional<glm::dvec3> readPoint(ConfigReader& reader, const std::string& key) {
  const auto numbers = reader.readNumbers(key, 3);
  if (numbers.empty()) return std::nullopt;
  return glm::dvec3(numbers[0], numbers[1], numbers[2]);
}

bool isPlainName(const std::string& name) {
  return !name.empty() &&
         name.find_first_not_of(
             "abcdefghijklmnopqrstuvwxyz"
             "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
             "0123456789_+-.") == std::string::npos &&
         name.front() != '.';
}

ViewConfig readView(ConfigReader reader) {
  ViewConfig view;
  reader.read("set", view.set);
  reader.read("name", view.name);
  view.projection = Projection(
      reader.readChoice("projection", {"orthographic", "perspective", "multi-perspective"}, 0));
  if (reader.has("convergence")) {
    reader.readPositive("convergence", view.convergence);
    if (view.projection != Projection::MultiPerspective) {
      reader.fail("convergence", "is for projection = \"multi-perspective\"");
    }
    if (view.convergence < Camera::kLeastConvergence ||
        view.convergence > Camera::kMostConvergence) {
      reader.fail("convergence", fmt::format("{} is not in {} .. {}", view.convergence,
                                             Camera::kLeastConvergence, Camera::kMostConvergence));
    }
  }
  if (double degrees = 0.0; reader.has("field_of_view")) {
    reader.readPositive("field_of_view", degrees);
    if (degrees >= 180.0) reader.fail("field_of_view", fmt::format("{} is not < 180", degrees));
    view.fieldOfView = degrees * kRadians;
  }
  view.position = readPoint(reader, "position");
  view.target = readPoint(reader, "target");
  view.direction = readPoint(reader, "direction");
  view.up = readPoint(reader, "up");
  reader.readNumber("height", view.height);
  reader.readNumber("near", view.nearDepth);
  reader.readNumber("far", view.farDepth);
  reader.rejectUnknownKeys();

  if (view.height && !(*view.height > 0.0)) {
    reader.fail("height", fmt::format("{} is not positive", *view.height));
  }
  if (!view.set.empty()) {
    for (const char* key :
         {"name", "position", "target", "direction", "up", "height", "near", "far"}) {
      if (reader.has(key)) reader.fail(key, "set already says where the cameras stand");
    }
    return view;
  }
  if (view.name.empty()) reader.fail("name", "a view needs a set or a name");
  if (!isPlainName(view.name)) {
    reader.fail("name", fmt::format("\"{}\" has other characters than letters, digits and _+-.",
                                    view.name));
  }
  if (view.direction && view.target) reader.fail("direction", "target already says it");
  if (!view.direction && !view.target) reader.fail("direction", "give direction or target");
  if (view.target && !view.position) reader.fail("target", "needs a position");
  if (view.direction && glm::length(*view.direction) == 0.0) {
    reader.fail("direction", "has no length");
  }
  if (view.target && *view.target == *view.position) reader.fail("target", "equals position");
  const auto forward = view.direction ? *view.direction : *view.target - *view.position;
  const auto up = view.up.value_or(glm::dvec3(0, 0, 1));
  if (view.up &&
      glm::length(glm::cross(forward, up)) <= 1e-9 * glm::length(forward) * glm::length(up)) {
    reader.fail("up", "is parallel to the direction of view");
  }
  if (view.projection == Projection::Perspective && view.height) {
    reader.fail("height", "is for orthographic cameras; give field_of_view");
  }
  return view;
}

/// The views that a [[view]] stands for: names that differ, and no more of them than a step can
/// make.
void countViews(const ConfigReader& reader, const Config& config, std::set<std::string>& names) {
  const auto& view = config.views.back();
  const char* key = view.set.empty() ? "name" : "set";
  std::vector<std::string> added{view.name};
  if (!view.set.empty()) {
    try {
      added.clear();
      for (auto& each : viewSet(view.set, Box{{0, 0, 0}, {1, 1, 1}}, 1.0, view.projection)) {
        added.push_back(std::move(each.name));
      }
    } catch (const Error& error) {
      reader.fail(key, error.what());
    }
  }
  for (auto& name : added) {
    if (!names.insert(name).second) {
      reader.fail(key, fmt::format("the view \"{}\" is given twice", name));
    }
  }
  const auto pixels = std::uint64_t(names.size()) * config.size.pixels();
  if (names.size() > std::size_t(Config::kMostViews) || pixels > Config::kMostPixels) {
    reader.fail(key, fmt::format("makes it {} views of {} x {}, {} pixels; at most {} views and {} "
                                 "pixels are marched in a step",
                                 names.size(), config.size.width, config.size.height, pixels,
                                 Config::kMostViews, Config::kMostPixels));
  }
}

void readDerivation(ConfigReader& reader, FieldConfig& field) {
  if (reader.has("component")) {
    int component = 0;
    reader.readInteger("component", 0, 63, component);
    field.component = component;
  }
  reader.read("magnitude", field.magnitude);
  reader.read("gradient", field.gradient);
  if (field.component && field.magnitude) reader.fail("magnitude", "component is given as well");
}

void readPartition(ConfigReader& reader, FieldConfig& field) {
  if (reader.isString("range")) {
    field.range = FieldConfig::Range(reader.readChoice("range", {"first-step", "each-step"}, 0));
  } else if (const auto range = reader.readNumbers("range", 2); !range.empty()) {
    if (!(range[0] <= range[1])) {
      reader.fail("range", fmt::format("[{}, {}] is upside down", range[0], range[1]));
    }
    field.range = FieldConfig::Range::Fixed;
    field.low = range[0];
    field.high = range[1];
  }
  reader.readInteger("intervals", 1, IntervalPartition::kMaxIntervals, field.intervals);
  field.bounds = reader.readNumbers("bounds");
  reader.read("quantiles", field.quantiles);
  if (!field.bounds.empty()) {
    for (const char* key : {"range", "intervals", "quantiles"}) {
      if (reader.has(key)) reader.fail(key, "bounds already say it");
    }
    try {
      IntervalPartition::fromBounds(field.bounds);
    } catch (const Error& error) {
      reader.fail("bounds", error.what());
    }
  }
  if (field.quantiles && field.range == FieldConfig::Range::Fixed) {
    reader.fail("quantiles", "take the range of the data: \"first-step\" or \"each-step\"");
  }
}

void readLook(ConfigReader& reader, FieldConfig& field) {
  for (const auto& [value, opacity] : reader.readPairs("opacity")) {
    if (opacity < 0.0 || opacity > 1.0) {
      reader.fail("opacity", fmt::format("{} at {} is not in 0..1", opacity, value));
    }
    if (!field.opacity.empty() && value < field.opacity.back().value) {
      reader.fail("opacity",
                  fmt::format("value {} comes after {}", value, field.opacity.back().value));
    }
    field.opacity.push_back({value, opacity});
  }
  reader.read("colormap", field.colormap);
  try {
    Colormap::named(field.colormap);
  } catch (const Error& error) {
    reader.fail("colormap", error.what());
  }
  if (const auto range = reader.readNumbers("color_range", 2); !range.empty()) {
    if (!(range[0] < range[1])) reader.fail("color_range", "low is not below high");
    field.colorRange = {range[0], range[1]};
  }
}

void readIsovalues(ConfigReader& reader, FieldConfig& field) {
  using Rule = FieldConfig::Isovalues;
  if (reader.isString("isovalues")) {
    field.isovalueRule =
        Rule(reader.readChoice("isovalues", {"auto", "peaks", "bounds", "even"}, 0));
  } else if (reader.has("isovalues")) {
    field.isovalues = reader.readNumbers("isovalues");
    field.isovalueRule = Rule::Explicit;
    if (field.isovalues.size() > 64) reader.fail("isovalues", "more than 64");
    if (std::set<double>(field.isovalues.begin(), field.isovalues.end()).size() !=
        field.isovalues.size()) {
      reader.fail("isovalues", "one is given twice");
    }
  }
  reader.readInteger("isovalue_count", 1, 64, field.isovalueCount);
  if (reader.has("isovalue_count") && field.isovalueRule != Rule::Even &&
      field.isovalueRule != Rule::Automatic) {
    reader.fail("isovalue_count", "is for isovalues = \"even\" or \"auto\"");
  }
}

/// The norm of several fields' gradients, which has no source of its own.
void readGradientNorm(ConfigReader& reader, FieldConfig& field) {
  field.gradientNorm = reader.readStrings("gradient_norm");
  if (field.gradientNorm.empty()) reader.fail("gradient_norm", "of which fields?");
  for (const char* key : {"source", "component", "magnitude", "gradient", "no_data"}) {
    if (reader.has(key)) reader.fail(key, "gradient_norm already says what the field is made of");
  }
  if (field.name.empty()) field.name = "gradient_norm";
}

FieldConfig readField(ConfigReader reader) {
  FieldConfig field;
  reader.read("source", field.source);
  reader.read("name", field.name);
  if (reader.has("gradient_norm")) {
    readGradientNorm(reader, field);
  } else {
    if (field.source.empty()) field.source = field.name;
    if (field.source.empty()) reader.fail("source", "which published field?");
  }
  if (reader.has("name") && !isPlainName(field.name)) {
    reader.fail("name", fmt::format("\"{}\" has other characters than letters, digits and _+-.",
                                    field.name));
  }
  reader.read("units", field.units);
  readDerivation(reader, field);
  for (const auto& [low, high] : reader.readRanges("no_data")) field.noData.push_back({low, high});
  readPartition(reader, field);
  readLook(reader, field);
  readIsovalues(reader, field);
  reader.rejectUnknownKeys();
  return field;
}

/// All [[classifier]]; without [image] proxies they are what is made, beside the usual of
/// [[field]].
void readClassifiers(ConfigReader& root, Config& config) {
  std::set<std::string> names;
  for (const FieldConfig& field : config.fields) names.insert(field.name);
  for (const auto& reader : root.tables("classifier")) {
    config.classifiers.push_back(readClassifier(reader));
    const std::string& name = config.classifiers.back().name;
    if (!isPlainName(name)) {
      reader.fail("name",
                  fmt::format("\"{}\" has other characters than letters, digits and _+-.", name));
    }
    if (!names.insert(name).second) {
      reader.fail("name",
                  fmt::format("\"{}\" is the name of a field or of another classifier", name));
    }
  }
  const bool wanted = config.features || config.slicedFeatures;
  if (config.classifiers.empty()) {
    if (wanted) root.fail("image", "proxies names features, but there is no [[classifier]]");
    return;
  }
  if (config.fixed.proxies) {
    if (!wanted) {
      root.fail("classifier", "[image] proxies names neither \"features\" nor \"sliced-features\"");
    }
    return;
  }
  config.features = true;
  if (!config.fields.empty()) return;
  config.attenuation = config.length = config.depth = config.mip = config.reference = false;
}

/// Of what [image] proxies names something must depend on it.
void readCustomizationInto(ConfigReader& root, Config& config) {
  const auto reader = root.table("customization");
  if (!reader) return;
  Customization customization = readCustomization(*reader);
  const bool seen = config.attenuation || config.reference || config.layered ||
                    (config.mip && (customization.hasGamma() || customization.isNeutral()));
  if (!seen) {
    root.fail("customization",
              "is seen in \"attenuation\", \"reference\", \"layered\" and, where there is a "
              "gamma, \"mip\": none of these is made");
  }
  if (!customization.isNeutral()) config.customization = std::move(customization);
}

}  // namespace

Config configFromText(const std::string& text, const std::string& origin) {
  Config config;
  const ConfigDocument document(text, origin);
  ConfigReader root = document.root();
  root.read("dry_run", config.dryRun);
  if (auto reader = root.table("output")) readOutput(*reader, config);
  if (auto reader = root.table("gl")) readGl(*reader, config);
  if (auto reader = root.table("image")) readImage(*reader, config);
  if (auto reader = root.table("layered")) readLayered(*reader, config);
  if (auto reader = root.table("training")) readTraining(*reader, config);
  if (auto reader = root.table("sliced")) readSliced(*reader, config);
  if (auto reader = root.table("reduced_field")) readReducedField(*reader, config);
  if (auto reader = root.table("budget")) readBudget(*reader, config.budget);
  if (auto reader = root.table("trigger")) {
    readTrigger(*reader, config.trigger);
    config.fixed.cadence = true;
  }
  std::set<std::string> viewNames;
  for (auto& reader : root.tables("view")) {
    config.views.push_back(readView(reader));
    countViews(reader, config, viewNames);
  }
  const auto anyView = [&](Projection projection) {
    return std::any_of(config.views.begin(), config.views.end(),
                       [=](const ViewConfig& view) { return view.projection == projection; });
  };
  const auto& stacked = config.sliced ? config.sliced : config.slicedFeatures;
  if (stacked && stacked->stacks == "views") {
    for (const auto& [projection, name] :
         {std::pair(Projection::Perspective, "perspective"),
          std::pair(Projection::MultiPerspective, "multi-perspective")}) {
      if (!anyView(projection)) continue;
      root.fail("sliced",
                fmt::format("stacks = \"views\" needs orthographic views: one is {}", name));
    }
  }
  if (config.layered && anyView(Projection::MultiPerspective)) {
    root.fail("view",
              "\"layered\" proxies are walked along straight lines of pixels, which a "
              "multi-perspective view does not have: leave one of the two out");
  }
  if (config.field && viewNames.contains(kFieldView)) {
    root.fail("view", fmt::format("the name \"{}\" is that of stored fields", kFieldView));
  }
  for (auto& reader : root.tables("field")) config.fields.push_back(readField(reader));
  readClassifiers(root, config);
  readCustomizationInto(root, config);
  root.rejectUnknownKeys();
  return config;
}

std::string readTextFile(const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (!file) {
    const int reason = errno;
    throw Error(reason == ENOENT ? ErrorCode::NotFound : ErrorCode::Io,
                fmt::format("cannot read '{}': {}", path, std::strerror(reason)));
  }
  std::string text;
  char buffer[65536];
  std::size_t got = 0;
  while ((got = std::fread(buffer, 1, sizeof buffer, file)) > 0) text.append(buffer, got);
  const bool failed = std::ferror(file) != 0;
  std::fclose(file);
  if (failed) throw Error(ErrorCode::Io, fmt::format("cannot read '{}'", path));
  return text;
}

}  // namespace vestige
