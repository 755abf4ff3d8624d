// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/inspect/probe_pixel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "explorer/export/export_arrays.h"
#include "explorer/features/field_bundle.h"
#include "explorer/inspect/field_sampler.h"
#include "explorer/inspect/probe.h"
#include "explorer/renderer/renderer_impl.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

using nlohmann::json;

/// Opacity that can be seen in 8 bits.
constexpr double kVisible = 1.0 / 255.0;
constexpr std::size_t kMostSamples = 8192;

json numberOrNull(double value) { return std::isfinite(value) ? json(value) : json(); }
/// Of all values of a field at the step.
json rangeJson(const ProxyHeader& header) {
  return {header.statistics.low, header.statistics.high};
}
json vectorJson(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

/// A pixel's ray and its way through the domain, in planar depths; enters > leaves: it misses.
struct PixelRay {
  Ray ray;
  double enters, leaves;

  glm::dvec3 at(double depth) const {
    return ray.origin + ray.direction * (depth / ray.depthPerLength);
  }
};

/// In the world, where a look stretches it, too; depths are those of the picture.
PixelRay rayOf(const Rendered& rendered, ImageSize size, int x, int y, const Box& domain) {
  const Camera& camera = rendered.camera;
  PixelRay pixel{camera.rayThrough({x + 0.5, y + 0.5}, size), 0.0, 0.0};
  pixel.ray.origin = glm::dvec3(rendered.worldFromScene * glm::dvec4(pixel.ray.origin, 1.0));
  pixel.ray.direction = glm::dvec3(rendered.worldFromScene * glm::dvec4(pixel.ray.direction, 0.0));
  pixel.leaves = pixel.ray.lastDepth;
  const bool ahead = camera.projection != Projection::Orthographic;
  pixel.enters = ahead ? 0.0 : -std::numeric_limits<double>::infinity();
  for (int a = 0; a < 3; ++a) {
    const double o = pixel.ray.origin[a], d = pixel.ray.direction[a] / pixel.ray.depthPerLength;
    if (d == 0.0) {
      if (o < domain.low[a] || o > domain.high[a]) pixel.leaves = -HUGE_VAL;
      continue;
    }
    const double s = (domain.low[a] - o) / d, t = (domain.high[a] - o) / d;
    pixel.enters = std::max(pixel.enters, std::min(s, t));
    pixel.leaves = std::min(pixel.leaves, std::max(s, t));
  }
  return pixel;
}

/// The pixel of a stored view whose ray is this one, if any is.
std::optional<std::array<int, 2>> storedPixel(const ProxyHeader& stored, const PixelRay& pixel) {
  const double middle = glm::dot(stored.domain.center() - pixel.ray.origin, pixel.ray.direction) *
                        pixel.ray.depthPerLength;
  const double half = 0.25 * std::max(stored.domain.diagonal(), 1e-300);
  const double last = std::min(middle + half, 0.999 * pixel.ray.lastDepth);
  const double first = std::min(std::max(middle - half, 1e-3 * half), last - 0.5 * half);
  const glm::dvec3 a = stored.camera.project(pixel.at(first), stored.size);
  const glm::dvec3 b = stored.camera.project(pixel.at(last), stored.size);
  constexpr double kSame = 0.02;  // of a pixel
  if (!(std::hypot(a.x - b.x, a.y - b.y) < kSame)) return std::nullopt;
  const int x = int(std::floor(a.x)), y = int(std::floor(a.y));
  if (x < 0 || y < 0 || x >= stored.size.width || y >= stored.size.height) return std::nullopt;
  return std::array<int, 2>{x, y};
}

/// Values along the ray of one field.
struct Values {
  std::function<double(const glm::dvec3&)> at;
  glm::dmat4 gridFromWorld{1.0};
  std::array<std::vector<double>, 3> nodes;  ///< where its samples stand, in grid coordinates
  std::string note;
};

std::optional<Values> valuesOf(const Archive& archive, long cycle, const std::string& field) {
  if (const ArchiveRow* row = archive.find(cycle, kFieldView, field, kind::kField)) {
    const ProxyImage image = archive.open(*row).image();
    const auto sampler = std::make_shared<const FieldSampler>(fieldSamples(image));
    const FieldGrid& grid = *image.header.grid;
    return Values{[sampler](const glm::dvec3& world) { return sampler->at(world); },
                  glm::dmat4(1.0), sampler->nodes(),
                  fmt::format("stored field, each sample within {:.3g}{}", grid.tolerance,
                              grid.reduction > 1 ? " of a mean" : "")};
  }
  if (StackSource::viewsOf(archive, cycle, field).empty()) return std::nullopt;
  const auto bundle = std::make_shared<const FieldBundle>(archive, cycle, std::vector{field});
  return Values{[bundle](const glm::dvec3& world) { return bundle->sample(world).values[0]; },
                glm::inverse(bundle->worldFromGrid), bundle->places(), bundle->note};
}

/// The planar depths at which the ray's values are asked for: where it passes from cell to cell of
/// the samples' own axes, between which values are smooth, and halfway between.
std::vector<double> stationsOf(const Values& values, const PixelRay& ray) {
  const double way = ray.leaves - ray.enters;
  // A hair inside, where rounding cannot lose the domain's faces.
  std::vector<double> faces{ray.enters + 1e-9 * way, ray.leaves - 1e-9 * way};
  const glm::dvec3 from(values.gridFromWorld * glm::dvec4(ray.at(ray.enters), 1.0));
  const glm::dvec3 to(values.gridFromWorld * glm::dvec4(ray.at(ray.leaves), 1.0));
  for (int a = 0; a < 3; ++a) {
    for (const double node : values.nodes[std::size_t(a)]) {
      const double share = (node - from[a]) / (to[a] - from[a]);
      if (share > 1e-6 && share < 1.0 - 1e-6) faces.push_back(ray.enters + share * way);
    }
  }
  std::sort(faces.begin(), faces.end());
  std::vector<double> stations;
  const std::size_t every = 1 + faces.size() / (kMostSamples / 2);
  for (std::size_t i = 0; i < faces.size(); i += every) {
    if (stations.empty()) {
      stations.push_back(faces[i]);
    } else if (const double before = stations.back(); faces[i] - before > 1e-6 * way) {
      stations.push_back(0.5 * (before + faces[i]));
      stations.push_back(faces[i]);
    }
  }
  if (stations.back() < faces.back() - 1e-6 * way) stations.push_back(faces.back());
  return stations;
}

json sampleJson(const PixelRay& ray, double depth, double value) {
  return {
      {"depth", depth}, {"position", vectorJson(ray.at(depth))}, {"value", numberOrNull(value)}};
}

/// Samples, two a cell, and the first of them that can be seen through what is before it.
json valuesJson(const Values& values, const PixelRay& ray, const OpticsTable::Optics& optics,
                std::optional<double> only) {
  json found{{"source", values.note}, {"samples", json::array()}};
  if (!(ray.leaves >= ray.enters)) return found;
  if (only) {
    found["samples"].push_back(sampleJson(ray, *only, values.at(ray.at(*only))));
    return found;
  }
  double left = 1.0, before = std::numeric_limits<double>::quiet_NaN(), depthBefore = 0.0;
  for (const double depth : stationsOf(values, ray)) {
    const double value = values.at(ray.at(depth));
    found["samples"].push_back(sampleJson(ray, depth, value));
    if (optics && std::isfinite(value) && std::isfinite(before)) {
      const double length = (depth - depthBefore) / ray.ray.depthPerLength;
      left *= std::exp(-optics(0.5 * (before + value)).a * length);
      if (1.0 - left > kVisible && !found.contains("firstVisible"))
        found["firstVisible"] = found["samples"].back();
    }
    before = value;
    depthBefore = depth;
  }
  return found;
}

/// The channels of a proxy's parts at a pixel: a row a channel, a key a part.
json channelsAt(const std::vector<ExportArray>& arrays, std::size_t at, std::size_t pixels) {
  json rows = json::array();
  for (const ExportArray& array : arrays) {
    for (std::size_t block = 0; block < array.blocks; ++block) {
      const std::vector<double> values = array.values(block);
      for (std::size_t c = 0; c < array.channels.size(); ++c) {
        const ExportChannel& channel = array.channels[c];
        const std::string part =
            array.outer.empty() ? array.part : fmt::format("{}{:02}", array.outer, block);
        auto row = std::find_if(rows.begin(), rows.end(),
                                [&](const json& each) { return each["name"] == channel.name; });
        if (row == rows.end()) {
          rows.push_back({{"name", channel.name}});
          row = rows.end() - 1;
          if (channel.low) (*row)["low"] = *channel.low;
          if (channel.high) (*row)["high"] = *channel.high;
        }
        (*row)["parts"][part] = numberOrNull(values[c * pixels + at]);
      }
    }
  }
  return rows;
}

json proxyJson(const ExrFile& file, std::array<int, 2> at, std::optional<double> depth) {
  const ProxyHeader& header = file.header();
  json found{{"proxy", header.kind}, {"view", header.view}, {"field", header.field}, {"pixel", at}};
  if (header.partition) found["range"] = rangeJson(header);
  if (header.customization) found["note"] = "values as the run's customisation made them";
  if (header.kind == kind::kSliced) {
    found["cells"] = toJson(probe(readStack(file), at[0], at[1], depth));
  } else {
    const std::vector<ExportArray> arrays = exportArrays(file);
    for (const ExportArray& array : arrays)
      if (array.error > 0.0) found["within"][array.part] = array.error;
    found["channels"] =
        channelsAt(arrays, std::size_t(at[1]) * std::size_t(header.size.width) + std::size_t(at[0]),
                   header.size.pixels());
  }
  return found;
}

/// The rows of a field's proxies that are pictures, those of `view` first.
std::vector<ArchiveRow> picturesOf(const Archive& archive, long cycle, const std::string& field,
                                   const std::string& view) {
  std::vector<ArchiveRow> rows;
  for (const ArchiveRow& row : archive.rows())
    if (row.cycle == cycle && row.field == field && row.proxy != kind::kField &&
        row.proxy != kind::kLearned)
      rows.push_back(row);
  std::stable_partition(rows.begin(), rows.end(),
                        [&](const ArchiveRow& row) { return row.view == view; });
  return rows;
}

void addProxies(const Archive& archive, const std::vector<ArchiveRow>& rows, const PixelRay& ray,
                std::optional<double> depth, json& probed) {
  std::vector<std::string> answered, other;
  for (const ArchiveRow& row : rows) {
    if (std::find(answered.begin(), answered.end(), row.proxy) != answered.end()) continue;
    const ExrFile file = archive.open(row);
    const auto at = storedPixel(file.header(), ray);
    if (!at) {
      if (std::find(other.begin(), other.end(), row.proxy) == other.end())
        other.push_back(row.proxy);
      continue;
    }
    answered.push_back(row.proxy);
    probed["proxies"].push_back(proxyJson(file, *at, depth));
  }
  for (const std::string& proxy : other)
    if (std::find(answered.begin(), answered.end(), proxy) == answered.end())
      probed["otherRays"].push_back(proxy);
}

/// Of the first proxy of a field that says its intervals, else of any.
ProxyHeader headerOf(const Archive& archive, long cycle, const std::string& field) {
  std::optional<ProxyHeader> header;
  for (const ArchiveRow& row : archive.rows()) {
    if (row.cycle != cycle || row.field != field) continue;
    header = archive.open(row).header();
    if (header->partition) break;
  }
  if (!header)
    throw Error(ErrorCode::NotFound, fmt::format("cycle {} has nothing of '{}'", cycle, field));
  return *header;
}

std::string colorOf(const Picture& picture, int x, int y) {
  Picture one = Picture::blank({1, 1});
  std::copy_n(picture.pixel(x, y), 4, one.rgba.begin());
  const Raster raster = rasterFromPicture(one);
  return fmt::format("#{:02x}{:02x}{:02x}", raster.rgba[0], raster.rgba[1], raster.rgba[2]);
}

}  // namespace

json probePixel(const Archive& archive, const Look& look, const Rendered& rendered, int x, int y,
                std::optional<double> depth) {
  const ImageSize size = rendered.picture.size;
  if (x < 0 || y < 0 || x >= size.width || y >= size.height)
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("pixel {},{} is outside of the picture's {} x {}", x, y, size.width,
                            size.height));
  const long cycle = cycleOf(look, archive);
  const auto classifier = classifierOf(look);
  std::vector<std::string> fields{look.field.empty() ? archive.fields().front() : look.field};
  if (classifier && look.field.empty()) fields = classifier->fields();
  const std::string view = look.view.empty() ? archive.views().front() : look.view;

  const ProxyHeader header = headerOf(archive, cycle, fields.front());
  const PixelRay ray = rayOf(rendered, size, x, y, header.domain);
  if (depth && !(*depth >= ray.enters && *depth <= ray.leaves))
    throw Error(ErrorCode::InvalidArgument,
                fmt::format("depth {} is outside of the ray's way through the domain, {:.6g} .. "
                            "{:.6g}",
                            *depth, ray.enters, ray.leaves));
  const float* linear = rendered.picture.pixel(x, y);
  json probed{{"pixel", {x, y}},
              {"size", {size.width, size.height}},
              {"cycle", cycle},
              {"time", header.time},
              {"color", colorOf(rendered.picture, x, y)},
              {"linear", {linear[0], linear[1], linear[2], linear[3]}},
              {"notes", rendered.notes},
              {"ray",
               {{"origin", vectorJson(ray.ray.origin)},
                {"direction", vectorJson(ray.ray.direction)},
                {"enters", ray.enters <= ray.leaves ? json(ray.enters) : json()},
                {"leaves", ray.enters <= ray.leaves ? json(ray.leaves) : json()}}},
              {"values", json::array()},
              {"proxies", json::array()},
              {"otherRays", json::array()}};
  for (const std::string& field : fields) {
    if (const auto values = valuesOf(archive, cycle, field)) {
      const ProxyHeader own = headerOf(archive, cycle, field);
      OpticsTable::Optics optics;
      const IntervalPartition* partition = own.partition ? &*own.partition : nullptr;
      if (fields.size() == 1) optics = opticsOf(functionOf(look, own, partition), partition);
      json& found = probed["values"].emplace_back(valuesJson(*values, ray, optics, depth));
      found["field"] = field;
      found["units"] = own.units;
      found["range"] = rangeJson(own);
    }
    addProxies(archive, picturesOf(archive, cycle, field, view), ray, depth, probed);
  }
  return probed;
}

}  // namespace vestige
