// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/volume/grid_painter.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "explorer/picture/trust.h"
#include "explorer/volume/surface_palette.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

VolumeMode modeOf(Draw draw) {
  switch (draw) {
    case Draw::Isosurface:
      return VolumeMode::Isosurface;
    case Draw::Mip:
      return VolumeMode::Maximum;
    case Draw::Slice:
      return VolumeMode::Slice;
    default:
      return VolumeMode::Compositing;
  }
}

/// Between rays through every other pixel, where cells are several pixels wide.
constexpr double kTolerance = 1.0 / 256.0;
/// Light behind which nothing is seen: half a step of 8 bits.
constexpr double kOpaque = 1.0 / 512.0;

}  // namespace

OpticsTable::Optics opticsOf(const TransferFunction& function, const IntervalPartition* partition) {
  return [function, partition](double value) {
    double extinction = function.extinction(value);
    if (partition && !function.factors().empty()) {
      const int channel = partition->channelOf(value);
      if (channel < partition->intervals()) extinction *= function.factors()[std::size_t(channel)];
    }
    return glm::dvec4(function.color(value) * extinction, extinction);
  };
}

namespace {

/// Colours where only they are shown.
OpticsTable tableOf(const LookGrid& grid, const Look& look, const TransferFunction& function,
                    const IntervalPartition* partition) {
  const auto flat = [function](double value) { return glm::dvec4(function.color(value), 1.0); };
  const OpticsTable::Optics optics =
      look.draw != Draw::Volume ? OpticsTable::Optics(flat) : opticsOf(function, partition);
  return {optics, grid.valueZero, grid.valueZero + grid.valueUnit};
}

}  // namespace

void GridPainter::forget() {
  tableKey_.clear();
  occlusionKey_.clear();
  table_.reset();
  occlusion_.reset();
}

void GridPainter::prepareCustom(const LookGrid& grid, const Look& look,
                                const TransferFunction& function,
                                const IntervalPartition* partition, const Box& domain) {
  custom_.reset();
  customTables_.clear();
  if (!look.customization || look.customization->isNeutral()) return;
  if (!customTextures_ || !customTextures_->is(*look.customization, domain))
    customTextures_.emplace(*look.customization, domain);
  const std::vector<BlendFunction> functions = look.customization->functions();
  customTables_.reserve(functions.size());
  custom_.emplace().textures = &*customTextures_;
  for (const BlendFunction& blend : functions) {
    TransferFunction other = blend.over(function);
    other.setFactors(function.factors());
    customTables_.push_back(tableOf(grid, look, other, partition));
    custom_->blends.push_back(&customTables_.back());
  }
  custom_->worldFromScene = stretch_.worldFromScene();
  custom_->low = partition ? partition->low() : grid.valueZero;
  custom_->high = partition ? partition->high() : grid.valueZero + grid.valueUnit;
}

void GridPainter::prepareScalar(LookGrid& grid, const Look& look, const TransferFunction& function,
                                const IntervalPartition* partition, VolumeSetup& setup) {
  if (look.draw == Draw::Isosurface) {
    setup.isosurfaces = surfacesOf(look, function);
    VolumePass::findBricks(grid, setup.isosurfaces);
    tableKey_.clear();  // the bricks are the surfaces' now
    table_.reset();
    return;
  }
  const bool colors = look.draw != Draw::Volume;
  std::string key = (colors ? "colors " : "optics ") + toJson(function).dump();
  // Factors and shifts show nothing that was not to be seen without them.
  if (custom_ && custom_->textures->hasValues()) key += toJson(*look.customization).dump();
  if (!table_ || key != tableKey_) {
    table_.emplace(tableOf(grid, look, function, partition));
    VolumePass::findBricks(grid, *table_, custom_ ? &*custom_ : nullptr);
    tableKey_ = key;
    step_.reset();
    occlusion_.reset();
  }
  setup.table = &*table_;
}

void GridPainter::place(LookGrid& grid, const Stretch& stretch) {
  if (!worldFromGrid_) worldFromGrid_ = grid.worldFromGrid;
  grid.worldFromGrid = stretch.sceneFromWorld() * *worldFromGrid_;
  if (stretch == stretch_) return;
  stretch_ = stretch;
  grid.gradient.reset();
  occlusion_.reset();
}

VolumeView GridPainter::draw(LookGrid& grid, const Look& look, const TransferFunction& function,
                             const IntervalPartition* partition, const Box& domain,
                             const Camera& camera, ImageSize size) {
  const bool scalar = grid.content == GridContent::Scalar;
  if (!scalar && (look.draw == Draw::Isosurface || look.draw == Draw::Mip)) {
    throw Error(ErrorCode::Config,
                "look key 'draw': isosurfaces and MIP need values, this source holds optics");
  }
  place(grid, Stretch(look.scale, domain));
  const Box scene = stretch_.box(domain);
  VolumeSetup setup;
  setup.camera = camera;
  setup.size = size;
  setup.mode = modeOf(look.draw);
  if (look.clip) setup.clip = stretch_.box(*look.clip);
  if (look.slice) setup.plane = stretch_.plane(*look.slice);
  if (look.draw == Draw::Slice && !look.slice) {
    // Through the middle, across the longest look.
    setup.plane = glm::dvec4(camera.forward, glm::dot(camera.forward, domain.center()));
  }
  setup.sliceThickness = function.referenceLength();
  if (scalar) {
    prepareCustom(grid, look, function, partition, domain);
    prepareScalar(grid, look, function, partition, setup);
    if (custom_) setup.custom = &*custom_;
  } else if (look.isCustomized()) {
    throw Error(ErrorCode::Config,
                "look key 'customization' needs values, this source holds optics");
  }
  const LightSetup light = lightSetup(look, camera, camera, domain);
  if (scalar && setup.mode == VolumeMode::Compositing) {
    // Factors and shifts change smoothly and bend nothing.
    const bool bends = custom_ && custom_->textures->hasValues();
    if (!step_) step_ = pass_.longestStep(grid, *setup.table, scene, bends ? &*custom_ : nullptr);
    // Light falls on the middle of a step: a long one would miss folds of what it passes.
    setup.step = light.shade ? std::min(*step_, 1.0) : *step_;
    setup.tolerance = kTolerance;
    setup.opaque = kOpaque;
  }
  setup.light = &light;
  if (light.shade && look.draw == Draw::Volume && !grid.gradient) pass_.findGradients(grid);
  if (look.ao.on && (look.draw == Draw::Volume || (look.draw == Draw::Isosurface && !scalar))) {
    const std::string key = std::to_string(light.aoRadiusWorld);
    if (!occlusion_ || key != occlusionKey_) {
      occlusion_ = pass_.occlusion(grid, light.aoRadiusWorld, setup.table);
      occlusionKey_ = key;
    }
    setup.occlusion = &*occlusion_;
  }
  VolumeView view = pass_.render(grid, setup);
  if (look.trust && grid.wrong) view.doubt = doubtOf(grid, setup, view.picture);
  return view;
}

std::vector<float> GridPainter::doubtOf(const LookGrid& grid, VolumeSetup setup,
                                        const Picture& likely) {
  // What is hidden may come out.
  setup.skip = false;
  std::vector<float> doubt(likely.size.pixels(), 0.0f);
  for (const double way : {-1.0, 1.0}) {
    setup.doubt = way;
    raiseDoubt(doubt, likely, pass_.render(grid, setup).picture);
  }
  return doubt;
}

}  // namespace vestige
