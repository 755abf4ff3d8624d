// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/export/export_arrays.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <memory>

#include "explorer/export/export_meanings.h"
#include "proxy/format/image/storage_scale.h"
#include "proxy/format/layout/feature_layout.h"
#include "proxy/format/layout/field_layout.h"
#include "proxy/format/layout/learned_layout.h"
#include "proxy/format/layout/sliced_stack.h"

namespace vestige {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

/// Where pixels look: the one place that knows how pictures' axes are written.
void setPictureAxes(const ProxyHeader& header, ExportArray& array) {
  const Camera& camera = header.camera;
  const bool slopes = camera.projection == Projection::Perspective;
  const auto across = [&](double x, double y) {
    const Ray ray = camera.rayThrough({x, y}, header.size);
    return slopes ? ray.direction / glm::dot(ray.direction, camera.forward)
                  : ray.origin - camera.position;
  };
  array.axes.assign(2, {});
  for (int x = 0; x < header.size.width; ++x)
    array.axes[0].push_back(glm::dot(across(x + 0.5, 0.5 * header.size.height), camera.right()));
  for (int y = 0; y < header.size.height; ++y)
    array.axes[1].push_back(glm::dot(across(0.5 * header.size.width, y + 0.5), camera.up));
  array.axesMeaning = slopes
                          ? "x, y: middles of pixels right of and above the camera's axis, world "
                            "length per planar depth"
                          : "x, y: middles of pixels right of and above the camera's position "
                            "on its plane, world length";
}

ExportArray pictureArray(const ProxyHeader& header, std::string part) {
  ExportArray array;
  array.part = std::move(part);
  array.size = header.size;
  setPictureAxes(header, array);
  return array;
}

/// Planes of depths get one of their distortion Z/κ beside them in multi-perspective views
/// [Tikhonova 2010, eq. 2], which is not stored because it follows.
void addDistortion(const ProxyHeader& header, ProxyPart& part) {
  if (header.camera.projection != Projection::MultiPerspective) return;
  const std::size_t stored = part.channels.size();
  for (std::size_t i = 0; i < stored; ++i) {
    if (part.channels[i].name != "Z" && part.name != "depth") continue;
    Channel distortion = part.channels[i];
    distortion.name = "distortion_" + distortion.name;
    for (float& v : distortion.values) v = float(double(v) / header.camera.convergence);
    part.channels.push_back(std::move(distortion));
  }
}

/// A stored number as it is meant.
double meant(const std::string& part, double stored) {
  if (part == "ends") return stored - 1.0;
  if (part == "depth" || part == "boundaries") return stored == 0.0 ? kNothing : stored;
  return std::isinf(stored) ? kNothing : stored;
}

ExportArray arrayOf(const ProxyHeader& header, ProxyPart part) {
  addDistortion(header, part);
  ExportArray array = pictureArray(header, part.name);
  array.error = part.error;
  for (const Channel& channel : part.channels)
    array.channels.push_back(exportChannel(header, part.name, channel.name));
  // Memory holds MIP as it is stored (scaleOfPart).
  const StorageScale scale =
      header.kind == kind::kMip ? StorageScale{part.unit, part.zero} : StorageScale{};
  array.isDouble = !scale.identity();
  array.values = [held = std::make_shared<const ProxyPart>(std::move(part)), scale](std::size_t) {
    std::vector<double> values;
    for (const Channel& channel : held->channels)
      for (const float stored : channel.values)
        values.push_back(meant(held->name, double(stored)) * scale.unit + scale.zero);
    return values;
  };
  return array;
}

ExportArray fieldArray(const ExrFile& file) {
  const auto field = std::make_shared<const FieldSamples>(fieldSamples(file.image()));
  const ProxyHeader& header = file.header();
  ExportArray array;
  array.outer = "z";
  array.blocks = std::size_t(field->axes[2].count);
  array.size = {field->axes[0].count, field->axes[1].count};
  array.isDouble = array.oneChannel = true;
  array.error = header.grid->tolerance;
  array.channels = {
      {"value",
       fmt::format("{} at the samples; NaN = no data",
                   header.grid->reduction > 1
                       ? fmt::format("mean of {}^3 of the run's values", header.grid->reduction)
                       : "value"),
       header.units,
       {},
       {}}};
  for (const FieldAxis& axis : field->axes) {
    auto& nodes = array.axes.emplace_back();
    for (int i = 0; i < axis.count; ++i) nodes.push_back(axis.at(i));
  }
  array.axesMeaning = "x, y, z: world coordinates of the samples";
  array.values = [field](std::size_t z) {
    const std::size_t plane = std::size_t(field->axes[0].count) * std::size_t(field->axes[1].count);
    std::vector<double> values(plane);
    for (std::size_t i = 0; i < plane; ++i) {
      const double share = double(field->values[z * plane + i]);
      // lerp() is made for numbers.
      values[i] = std::isnan(share) ? kNothing : std::lerp(field->low, field->high, share);
    }
    return values;
  };
  return array;
}

/// World lengths of each channel in each slab.
ExportArray stackLengths(const std::shared_ptr<const SlicedStack>& stack) {
  const ProxyHeader& header = stack->header;
  const IntervalPartition& partition = *header.partition;
  ExportArray array = pictureArray(header, "lengths");
  array.outer = "slab";
  array.blocks = stack->slabs.size();
  array.slabDepths = header.slabDepths;
  for (int k = 0; k < partition.channels(); ++k)
    array.channels.push_back(
        intervalChannel(partition, k, "length of the ray in the slab with", kWorldLength));
  const auto chords = std::make_shared<const SlabChords>(header);
  array.values = [stack, chords](std::size_t s) {
    const IntervalPartition& ranks = *stack->header.partition;
    const std::size_t pixels = stack->header.size.pixels();
    std::vector<double> values(std::size_t(ranks.channels()) * pixels, 0.0);
    const StackSlab& slab = stack->slabs[s];
    for (std::size_t i = 0; i < pixels; ++i) {
      const StackCell& cell = slab.cells[i];
      const double perLevel = chords->chord(int(s), i) / stack->levels;
      const auto levels = slab.levelsOf(cell);
      for (std::size_t r = 0; r < levels.size(); ++r)
        values[std::size_t(ranks.channelAt(cell.lowest + int(r))) * pixels + i] =
            levels[r] * perLevel;
      values[std::size_t(ranks.noData()) * pixels + i] = cell.noData * perLevel;
    }
    return values;
  };
  return array;
}

/// The channels in which rays pass the faces between slabs.
ExportArray stackFaces(const std::shared_ptr<const SlicedStack>& stack) {
  ExportArray array = pictureArray(stack->header, "faces");
  array.slabDepths = stack->header.slabDepths;
  for (std::size_t s = 0; s < stack->faces.size(); ++s)
    array.channels.push_back(
        {fmt::format("f{:02}", s),
         fmt::format("channel of lengths, counted from 0, in which the ray passes planar depth {}, "
                     "or {} the domain {}; -1 = it does neither",
                     stack->header.slabDepths[s], s + 1 < stack->faces.size() ? "enters" : "leaves",
                     s + 1 < stack->faces.size() ? "behind it" : "in front of it"),
         kNumber,
         {},
         {}});
  array.values = [stack](std::size_t) {
    std::vector<double> values;
    for (const auto& face : stack->faces)
      for (const std::uint8_t rank : face)
        values.push_back(rank == SlicedStack::kOutside
                             ? -1.0
                             : double(stack->header.partition->channelAt(rank)));
    return values;
  };
  return array;
}

/// The mean planar depths of the lowest and the highest values of each slab where the ray turns.
ExportArray stackTurns(const std::shared_ptr<const SlicedStack>& stack) {
  ExportArray array = pictureArray(stack->header, "turns");
  array.outer = "slab";
  array.blocks = stack->slabs.size();
  array.slabDepths = stack->header.slabDepths;
  for (const char* name : {"lowest", "highest"})
    array.channels.push_back(
        {name,
         fmt::format("mean planar depth of the {} channel in the slab, if the ray turns there; "
                     "NaN = it does not",
                     name),
         kWorldLength,
         {},
         {}});
  array.values = [stack](std::size_t s) {
    const auto& depths = stack->header.slabDepths;
    const std::vector<StackCell>& cells = stack->slabs[s].cells;
    std::vector<double> values;
    for (const bool high : {false, true})
      for (const StackCell& cell : cells) {
        const int turn = high ? cell.high() : cell.low();
        values.push_back(
            turn == 0 ? kNothing
                      : std::lerp(depths[s], depths[s + 1], (turn - 0.5) / SlicedStack::kTurns));
      }
    return values;
  };
  return array;
}

ExportArray featureStackArray(const ExrFile& file) {
  const auto stack = std::make_shared<const FeatureStack>(readFeatureStack(file));
  ExportArray array = pictureArray(stack->header, "integrals");
  array.outer = "slab";
  array.blocks = stack->slabs.size();
  array.slabDepths = stack->header.slabDepths;
  for (const std::string& name : featuresOf(stack->header).classifier->channels())
    array.channels.push_back(exportChannel(stack->header, "integral", name));
  array.values = [stack](std::size_t s) {
    return std::vector<double>(stack->slabs[s].begin(), stack->slabs[s].end());
  };
  return array;
}

ExportArray learnedArray(const ExrFile& file) {
  const auto table = std::make_shared<const LearnedTable>(learnedTable(file.image()));
  const IntervalPartition& partition = *file.header().partition;
  ExportArray array;
  array.part = "table";
  array.outer = "cluster";
  array.blocks = std::size_t(table->clusters);
  array.pictures = false;
  array.size = {1, 1};
  for (int k = 0; k < table->channels; ++k)
    array.channels.push_back(
        intervalChannel(partition, k, "centroid: fraction of light taken by", kNumber));
  const std::array<const char*, 3> colors{"red", "green", "blue"};
  for (const char* color : colors)
    for (int k = 0; k < table->channels; ++k) {
      ExportChannel channel = intervalChannel(
          partition, k, fmt::format("derivative of {} by the fraction taken by", color), kNumber);
      channel.name = std::string(color) + "_by_" + channel.name;
      array.channels.push_back(std::move(channel));
    }
  for (const char* color : colors)
    array.channels.push_back(
        {color, "linear light at the centroid, premultiplied", kNumber, {}, {}});
  array.values = [table](std::size_t i) {
    const auto n = std::size_t(table->channels);
    std::vector<double> row;
    const auto add = [&](const std::vector<float>& from, std::size_t count) {
      row.insert(row.end(), from.begin() + std::ptrdiff_t(i * count),
                 from.begin() + std::ptrdiff_t((i + 1) * count));
    };
    add(table->centroid, n);
    add(table->jacobian, 3 * n);
    add(table->color, 3);
    return row;
  };
  return array;
}

}  // namespace

std::vector<std::size_t> ExportArray::shape() const {
  std::vector<std::size_t> shape;
  if (!outer.empty()) shape.push_back(blocks);
  if (!oneChannel) shape.push_back(channels.size());
  if (pictures) shape.insert(shape.end(), {std::size_t(size.height), std::size_t(size.width)});
  return shape;
}

std::vector<std::string> ExportArray::dimensions() const {
  std::vector<std::string> names;
  if (!outer.empty()) names.push_back(outer);
  if (!oneChannel) names.push_back("channel");
  if (pictures) names.insert(names.end(), {"y", "x"});
  return names;
}

std::vector<ExportArray> exportArrays(const ExrFile& file) {
  const std::string& kind = file.header().kind;
  std::vector<ExportArray> arrays;
  if (kind == kind::kField) {
    arrays.push_back(fieldArray(file));
  } else if (kind == kind::kSliced) {
    const auto stack = std::make_shared<const SlicedStack>(readStack(file));
    arrays = {stackLengths(stack), stackFaces(stack), stackTurns(stack)};
  } else if (kind == kind::kSlicedFeatures) {
    arrays.push_back(featureStackArray(file));
  } else if (kind == kind::kLearned) {
    arrays.push_back(learnedArray(file));
  } else {
    for (const std::string& name : file.partNames())
      arrays.push_back(arrayOf(file.header(), file.part(name)));
  }
  return arrays;
}

}  // namespace vestige
