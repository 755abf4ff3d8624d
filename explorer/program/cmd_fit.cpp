// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "explorer/annotation/annotate.h"
#include "explorer/features/field_bundle.h"
#include "explorer/program/cli.h"
#include "explorer/renderer/renderer.h"
#include "explorer/renderer/stated_error.h"
#include "explorer/stacks/stack_source.h"
#include "proxy/base/durable_file.h"
#include "proxy/base/error.h"
#include "proxy/base/json_object.h"
#include "proxy/classifier/fit.h"
#include "proxy/format/layout/field_layout.h"

namespace vestige::cli {
namespace {

struct Options {
  std::string archive, fields, region, into, picture;
  std::string name = "feature", color = "#ffb000";
  std::vector<std::string> brushes;
  double opacity = 0.5;
  bool full = false;
  std::unique_ptr<LookOptions> look;
};

/// Samples of a brushed region, in the fields' units.
class Brush {
 public:
  explicit Brush(const FieldBundle& bundle) : bundle_(bundle) {}

  /// All samples of the grid in a box.
  void addBox(const Box& box) {
    for (int z = 0; z < bundle_.size.z; ++z) {
      for (int y = 0; y < bundle_.size.y; ++y) {
        for (int x = 0; x < bundle_.size.x; ++x) {
          const glm::dvec3 world(
              bundle_.worldFromGrid *
              glm::dvec4((glm::dvec3(x, y, z) + 0.5) / glm::dvec3(bundle_.size), 1.0));
          // A flat box still holds the samples nearest to it.
          const glm::dvec3 half = 0.5 * spacing();
          const bool inside = glm::all(glm::greaterThanEqual(world, box.low - half)) &&
                              glm::all(glm::lessThanEqual(world, box.high + half));
          if (inside) samples.push_back(bundle_.sample(world));
        }
      }
    }
  }

  /// The points of a plane behind the pixels of a picture within `radius` of (x, y).
  void addDisc(const Rendered& slice, const glm::dvec4& plane, double x, double y, double radius) {
    for (int py = int(std::ceil(y - radius)); py <= int(std::floor(y + radius)); ++py) {
      for (int px = int(std::ceil(x - radius)); px <= int(std::floor(x + radius)); ++px) {
        if (std::hypot(px - x, py - y) > radius) continue;
        const Ray ray = slice.camera.rayThrough({px + 0.5, py + 0.5}, slice.picture.size);
        const glm::dvec3 origin(slice.worldFromScene * glm::dvec4(ray.origin, 1.0));
        const glm::dvec3 way(slice.worldFromScene * glm::dvec4(ray.direction, 0.0));
        const glm::dvec3 normal(plane);
        const double along = (plane.w - glm::dot(normal, origin)) / glm::dot(normal, way);
        if (std::isfinite(along)) samples.push_back(bundle_.sample(origin + along * way));
      }
    }
  }

  std::vector<FieldSample> samples;

 private:
  glm::dvec3 spacing() const {
    glm::dvec3 spacing;
    for (int a = 0; a < 3; ++a) {
      spacing[a] = glm::length(glm::dvec3(bundle_.worldFromGrid[a])) / double(bundle_.size[a]);
    }
    return spacing;
  }

  const FieldBundle& bundle_;
};

std::vector<std::string> namesFrom(const std::string& text) {
  std::vector<std::string> names;
  std::stringstream parts(text);
  for (std::string name; std::getline(parts, name, ',');) names.push_back(name);
  if (names.empty() || names.size() > Classifier::kMaxFields) {
    throw Error(ErrorCode::Config, fmt::format("--fields '{}' holds {} names, not 1 to {}", text,
                                               names.size(), Classifier::kMaxFields));
  }
  return names;
}

nlohmann::json primitiveJson(const Options& options, const FittedPrimitive& fitted,
                             std::size_t fields) {
  nlohmann::json entry{
      {"name", options.name}, {"opacity", options.opacity}, {"color", options.color}};
  for (std::size_t i = 0; i < fields; ++i) entry["center"].push_back(fitted.primitive.center[i]);
  for (std::size_t i = 0; i < fields; ++i) {
    if (!options.full) {
      entry["width"].push_back(1.0 / fitted.primitive.scale[i][i]);
      continue;
    }
    for (std::size_t j = 0; j < fields; ++j)
      entry["matrix"].push_back(fitted.primitive.scale[i][j]);
  }
  return entry;
}

/// The classifier of --into with the primitive added, or replaced where the name is there.
nlohmann::json classifierWith(const Options& options, const std::vector<std::string>& fields,
                              nlohmann::json primitive) {
  nlohmann::json classifier{
      {"kind", "gaussian"}, {"fields", fields}, {"primitives", nlohmann::json::array()}};
  if (!options.into.empty() && std::filesystem::exists(options.into)) {
    const std::string text = textOfFile(options.into);
    try {
      classifier = parseJson(text);
    } catch (const nlohmann::json::parse_error& error) {
      throw Error(ErrorCode::Config,
                  fmt::format("--into '{}' is not JSON: {}", options.into, error.what()));
    }
    const auto there = classifierFromJson(classifier, "", "classifier");
    if (there->kind() != "gaussian" || there->fields() != fields) {
      throw Error(ErrorCode::Config,
                  fmt::format("--into '{}' is a {} classifier of {}; the fit is gaussian, of {}",
                              options.into, there->kind(), fmt::join(there->fields(), ","),
                              fmt::join(fields, ",")));
    }
  }
  auto& primitives = classifier["primitives"];
  const auto same = std::find_if(primitives.begin(), primitives.end(), [&](const auto& each) {
    return each.value("name", "") == options.name;
  });
  if (same != primitives.end()) {
    *same = std::move(primitive);
  } else {
    primitives.push_back(std::move(primitive));
  }
  classifierFromJson(classifier, "", "classifier");
  return classifier;
}

/// What is brushed, drawn: light on dark, so that it shows on any colour.
void drawOutline(Picture& picture, const std::vector<glm::dvec2>& points) {
  const double thin = std::max(1.0, picture.size.height / 400.0);
  for (const auto& [width, ink] : {std::pair{3.0 * thin, 0.0}, std::pair{thin, 1.0}})
    for (std::size_t i = 0; i + 1 < points.size(); ++i)
      drawLine(picture, points[i], points[i + 1], width, glm::dvec3(ink));
}

void drawDisc(Picture& picture, double x, double y, double radius) {
  std::vector<glm::dvec2> circle;
  for (int i = 0; i <= 64; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 64;
    circle.emplace_back(x + 0.5 + std::max(radius, 1.0) * std::cos(angle),
                        y + 0.5 + std::max(radius, 1.0) * std::sin(angle));
  }
  drawOutline(picture, circle);
}

/// The edges of a box of the world.
void drawBox(Rendered& shown, const Box& box) {
  const glm::dmat4 sceneFromWorld = glm::inverse(shown.worldFromScene);
  for (int from = 0; from < 8; ++from)
    for (int axis = 0; axis < 3; ++axis) {
      if (from >> axis & 1) continue;
      const auto at = [&](int corner) {
        const glm::dvec3 scene(sceneFromWorld * glm::dvec4(box.corner(corner), 1.0));
        return glm::dvec2(shown.camera.project(scene, shown.picture.size));
      };
      drawOutline(shown.picture, {at(from), at(from | 1 << axis)});
    }
}

/// The discs of the slice go into the brush; --picture shows them and the region.
void brushPicture(const Options& options, const std::shared_ptr<const Archive>& archive,
                  const std::string& field, const std::optional<Box>& region, Brush& brush) {
  Look look = options.look->look();
  if (!options.brushes.empty() && !look.slice) {
    throw Error(ErrorCode::Config, "--brush paints on a slice: give --slice NX,NY,NZ,D");
  }
  if (look.slice) look.draw = Draw::Slice;
  if (look.field.empty()) look.field = field;
  Renderer renderer(gl::Device::create(options.look->backend()), archive);
  Rendered shown = renderer.render(look);
  printWarnings(shown.warnings);
  for (const std::string& text : options.brushes) {
    const auto disc = numbersFromText("--brush", text, 3, 3);
    if (!(disc[2] >= 0.0 && disc[2] <= 1e4)) {
      throw Error(ErrorCode::Config, fmt::format("--brush '{}': a radius of {}", text, disc[2]));
    }
    brush.addDisc(shown, *look.slice, disc[0], disc[1], disc[2]);
    drawDisc(shown.picture, disc[0], disc[1], disc[2]);
  }
  if (region) drawBox(shown, *region);
  if (!options.picture.empty()) writePicture(options.picture, shown.picture);
}

/// How true the samples of the fields are around these values.
std::vector<SampleError> errorsOf(const Archive& archive, long cycle,
                                  const std::vector<std::string>& fields,
                                  const std::array<double, 4>& values) {
  std::vector<SampleError> errors;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const ArchiveRow* row = archive.find(cycle, kFieldView, fields[i], kind::kField);
    if (!row) {
      const auto views = StackSource::viewsOf(archive, cycle, fields[i]);
      row = archive.find(cycle, views.front(), fields[i], kind::kSliced);
    }
    errors.push_back(sampleError(archive.open(*row).header(), values[i]));
  }
  return errors;
}

FittedPrimitive fitted(const Options& options, const Archive& archive, long cycle,
                       const FieldBundle& bundle, const Brush& brush) try {
  // Once for the place, then as wide as the source tells values apart there.
  const auto center = fitPrimitive(brush.samples, bundle.domains).mean;
  const auto stated = errorsOf(archive, cycle, bundle.fields, center);
  std::vector<double> errors;
  for (const SampleError& each : stated) errors.push_back(each.error);
  const auto fit = fitPrimitive(brush.samples, bundle.domains, options.full, errors);
  for (std::size_t i = 0; i < stated.size(); ++i) {
    if (!fit.widened[i]) continue;
    fmt::print(stderr,
               "note: {} deviates by {:.3g} there, less than is stored of it: the width is {}\n",
               bundle.fields[i], fit.deviation[i], stated[i].why);
  }
  return fit;
} catch (const Error& error) {
  throw Error(ErrorCode::NotFound, fmt::format("nothing to fit in the region: {}", error.what()));
}

void run(const Options& options) {
  const auto archive = std::make_shared<const Archive>(options.archive);
  const Look look = options.look->look();
  const auto fields = namesFrom(options.fields);
  const long cycle = cycleOf(look, *archive);
  const FieldBundle bundle(*archive, cycle, fields);
  Brush brush(bundle);
  std::optional<Box> region;
  if (!options.region.empty()) {
    const auto box = numbersFromText("--region", options.region, 6, 6);
    region = Box{{box[0], box[1], box[2]}, {box[3], box[4], box[5]}};
    brush.addBox(*region);
  }
  if (!region && options.brushes.empty()) {
    throw Error(ErrorCode::Config, "what is to be fitted? Give --region or --slice and --brush");
  }
  if (!options.brushes.empty() || !options.picture.empty())
    brushPicture(options, archive, fields.front(), region, brush);
  const FittedPrimitive fit = fitted(options, *archive, cycle, bundle, brush);
  const auto classifier =
      classifierWith(options, fields, primitiveJson(options, fit, fields.size()));
  const std::string text = classifier.dump(2) + "\n";
  if (options.into.empty()) {
    fmt::print("{}", text);
    return;
  }
  writeDurably(options.into, std::as_bytes(std::span(text)));
  fmt::print("{}: {} fitted to {} samples\n", options.into, options.name, fit.samples);
  for (std::size_t i = 0; i < fields.size(); ++i) {
    fmt::print("  {} {:.6g} +- {:.3g}\n", fields[i], fit.mean[i], fit.deviation[i]);
  }
}

}  // namespace

void addFit(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand(
      "fit", "A Gaussian primitive for what is brushed: by the mean and spread of its samples");
  auto options = std::make_shared<Options>();
  command->add_option("archive", options->archive, "Archive (NAME.cdb) with fields or stacks")
      ->required();
  command->add_option("--fields", options->fields, "The classifier's fields 'a,b', 1 to 4")
      ->required();
  command->add_option("--region", options->region,
                      "X0,Y0,Z0,X1,Y1,Z1 in world units; flat ones take the nearest samples");
  command
      ->add_option("--brush", options->brushes,
                   "X,Y,RADIUS in pixels of the picture that render makes of --slice; repeatable")
      ->allow_extra_args(false);
  command->add_option("--name", options->name, "Of the primitive")->capture_default_str();
  command->add_option("--color-of", options->color, "Its colour, #rrggbb")->capture_default_str();
  command->add_option("--opacity-of", options->opacity, "Its opacity per reference length")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1.0));
  command->add_flag("--full", options->full, "Follow the samples' covariance, not the axes alone");
  command->add_option("--into", options->into,
                      "Classifier file that takes the primitive, new or there; else printed");
  command->add_option(
      "--picture", options->picture,
      "Draw what is brushed on the slice, or the region in the volume, into this file");
  options->look = std::make_unique<LookOptions>(*command);
  command->callback([options] { run(*options); });
}

}  // namespace vestige::cli
