// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/march/slab_march.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "adaptor/common/stopwatch.h"
#include "adaptor/march/tile_plan.h"
#include "march_field_glsl.embed.h"
#include "march_glsl.embed.h"
#include "proxy/base/error.h"
#include "proxy/format/layout/proxy_layout.h"
#include "proxy/gl/functions.h"

namespace vestige {
namespace {

constexpr int kSlabStretch = 4;  ///< steps between two looks for crossings: slabs are short
constexpr int kNoRank = 128;     ///< march.glsl
constexpr int kCellPlanes = 4;   ///< ends; lowest and highest; two moments

std::size_t slabPlanes(const MarchRequest& request) {
  return std::size_t(kCellPlanes + request.partition.channels());
}

/// Appends the cells of a band of rows, as march.glsl stored them in planes of `count` pixels.
void takeCells(const float* planes, std::size_t count, int noDataRank, SlabRays& rays) {
  for (std::size_t i = 0; i < count; ++i) {
    SlabCell& cell = rays.cells.emplace_back();
    cell.begin = std::uint32_t(rays.lengths.size());
    if (planes[i] < 0.0f) continue;
    const int ends = int(planes[i]), ranks = int(planes[count + i]);
    const auto lengthAt = [&](int rank) {
      return planes[std::size_t(kCellPlanes + rank) * count + i];
    };
    cell.first = std::uint8_t(ends % kNoRank);
    cell.last = std::uint8_t(ends / kNoRank % kNoRank);
    if (ends / kNoRank / kNoRank > 0) cell.noData = lengthAt(noDataRank);
    const int lowest = ranks % kNoRank, highest = ranks / kNoRank;
    if (lowest > highest) continue;
    cell.lowest = std::uint8_t(lowest);
    cell.highest = std::uint8_t(highest);
    cell.lowMoment = planes[2 * count + i];
    cell.highMoment = planes[3 * count + i];
    for (int rank = lowest; rank <= highest; ++rank) rays.lengths.push_back(lengthAt(rank));
  }
}

/// The distance of nodes along the rays, where an axis-aligned view has a node under every pixel;
/// so that rays may read nodes alone, between which the field is linear along them.
std::optional<double> spacingAlongNodes(const MarchRequest& request, const MarchSetup& setup,
                                        const BlockGrid& grid) {
  constexpr double kNear = 0.01;  ///< of a node's distance, how far off a ray may be
  const Camera& camera = request.camera;
  if (camera.projection != Projection::Orthographic) return {};
  const auto corner = [&](double x, double y) {
    return camera.unproject({x, y, 0.0}, request.size);
  };
  const glm::dvec3 first = corner(0.5, 0.5);
  const glm::dvec3 last = corner(request.size.width - 0.5, request.size.height - 0.5);
  std::optional<double> spacing;
  for (int axis = 0; axis < 3; ++axis) {
    const auto& nodes = grid.nodes[std::size_t(axis)];
    if (!setup.axes[std::size_t(axis)].even || nodes.size() < 2) return {};
    const double between = (nodes.back() - nodes.front()) / double(nodes.size() - 1);
    if (std::abs(camera.forward[axis]) > 1.0 - 1e-12) {
      spacing = between;
      continue;
    }
    // The outermost pixels stand on nodes, ...
    for (const double at : {first[axis], last[axis]}) {
      const double node = (at - nodes.front()) / between;
      if (std::abs(node - std::nearbyint(node)) > kNear) return {};
    }
    // ... and so do those in between, if a pixel is as wide as a cell.
    const bool across = std::abs(camera.right()[axis]) > 0.5;
    const int steps = (across ? request.size.width : request.size.height) - 1;
    const double pitch = std::abs(last[axis] - first[axis]) / std::max(steps, 1);
    if (steps > 0 && std::abs(pitch / between - 1.0) * steps > 2.0 * kNear) return {};
  }
  return spacing;
}

/// Counts depth from the first node at or behind the domain's nearest face, so that samples are
/// nodes.
void anchorOnNodes(MarchFrame& frame, const MarchRequest& request, const BlockGrid& grid) {
  const glm::dvec3 node{grid.nodes[0].front(), grid.nodes[1].front(), grid.nodes[2].front()};
  const Camera& camera = request.camera;
  const double depth = glm::dot(node - camera.position, camera.forward);
  const double steps = (depth - frame.depthOrigin) / request.stepLength;
  frame.depthOrigin += (steps - std::floor(steps + 1e-6)) * request.stepLength;
}

}  // namespace

/// The programs of a slab and the tiles that they are run on. Tiles in whose depths nothing but the
/// background lies in the slab are empty.
struct SlabMarch::Passes {
  std::vector<glm::vec4> marched, empty;
  std::vector<TilePass> passes;
  std::vector<const gl::Program*> programs;

  Passes(const TilePlan& plan, glm::vec2 slab) : empty(plan.empty) {
    for (const glm::vec4& tile : plan.marched)
      (plan.background && (tile.w < slab.x || tile.z > slab.y) ? empty : marched).push_back(tile);
    // TilePass wants them by rows.
    std::stable_sort(empty.begin(), empty.end(),
                     [](const glm::vec4& a, const glm::vec4& b) { return a.y < b.y; });
  }
};

const gl::Program& SlabMarch::program(const MarchRequest& request, const MarchSetup& setup,
                                      const BlockVolume& volume, bool empty, bool direct) {
  MarchDefines defines = {{"INTERVALS", std::to_string(request.partition.intervals())},
                          {"LAYERS", "0"},
                          {"STRETCH", std::to_string(kSlabStretch)},
                          {"EACH_STEP(X)", unrolled(kSlabStretch, true)},
                          {"EACH_STEP_BACK(X)", unrolled(kSlabStretch, true, true)},
                          {"EACH_LAYER(X)", ""},
                          {"SLAB", ""}};
  if (empty) defines.push_back({"EMPTY_TILE", ""});
  if (direct) defines.push_back({"DIRECT", ""});
  addFieldDefines(defines, setup, volume, !empty);
  std::string key;
  for (const auto& [name, value] : defines) key += name + "=" + value + ";";
  const auto found = programs_.find(key);
  if (found != programs_.end()) return found->second;
  const std::string source =
      std::string(embedded::march_field_glsl) + std::string(embedded::march_glsl);
  return programs_.emplace(key, gl::Program({{GL_COMPUTE_SHADER, source}}, defines)).first->second;
}

SlabRays SlabMarch::readSlab(const Passes& passes, const MarchRequest& request, glm::vec2 slab,
                             Times& times) {
  const gl::Functions& f = gl::functions();
  const auto [width, height] = request.size;
  const std::size_t rowBytes = slabPlanes(request) * std::size_t(width) * sizeof(float);
  const int rows = TilePlan::bandRows(height, rowBytes);
  const auto bytes = GLsizeiptr(rowBytes * std::size_t(rows));
  SlabRays rays;
  rays.cells.reserve(request.size.pixels());
  for (int row = 0; row < height; row += rows) {
    const Stopwatch marching;
    const int count = std::min(rows, height - row);
    if (!planes_) planes_.emplace();
    f.BindBuffer(GL_SHADER_STORAGE_BUFFER, planes_->id());
    f.BufferData(GL_SHADER_STORAGE_BUFFER, bytes, nullptr, GL_STREAM_READ);
    f.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, planes_->id());
    for (std::size_t i = 0; i < passes.passes.size(); ++i) {
      passes.programs[i]->use();
      f.Uniform2f(passes.programs[i]->uniform("slab"), slab.x, slab.y);
      passes.passes[i].run(row, count);
    }
    f.BindBuffer(GL_SHADER_STORAGE_BUFFER, planes_->id());
    f.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    f.Finish();
    times.march += marching.seconds();
    const Stopwatch reading;
    const auto* mapped = static_cast<const float*>(
        f.MapBufferRange(GL_SHADER_STORAGE_BUFFER, 0, bytes, GL_MAP_READ_BIT));
    if (!mapped) {
      gl::checkErrors("the read-back of a slab");
      throw Error(ErrorCode::Gl, "the read-back of a slab: the result could not be mapped");
    }
    takeCells(mapped, std::size_t(width) * std::size_t(count), request.partition.noData(), rays);
    f.UnmapBuffer(GL_SHADER_STORAGE_BUFFER);
    times.readBack += reading.seconds();
  }
  gl::checkErrors("the march of a slab");
  return rays;
}

void SlabMarch::march(const BlockVolume& volume, const MarchRequest& request,
                      std::span<const double> depths, const TakeSlab& take, Times& times) {
  MarchRequest lengths = request;
  lengths.attenuation = lengths.length = lengths.mip = lengths.reference = false;
  lengths.isovalues.clear();
  const int slabs = int(depths.size()) - 1;
  const BlockGrid& grid = volume.grid();
  const auto missed = [&] {
    SlabRays rays;
    rays.cells.resize(request.size.pixels());
    return rays;
  };
  if (grid.empty()) {
    for (int s = 0; s < slabs; ++s) take(s, missed());
    return;
  }
  const Stopwatch preparing;
  MarchSetup setup(lengths, volume, false);
  const auto spacing = spacingAlongNodes(lengths, setup, grid);
  if (spacing) {
    lengths.stepLength = *spacing;
    anchorOnNodes(setup.frame, lengths, grid);
  }
  const TilePlan plan(volume.bricks(), setup.bricks, grid, setup.frame, lengths);
  const MarchTables tables(setup, volume);
  const gl::Program* marched = &program(lengths, setup, volume, false, spacing.has_value());
  setMarchUniforms(*marched, lengths, setup, volume);
  const gl::Program* empty = nullptr;
  if (plan.background) {
    empty = &program(lengths, setup, volume, true, spacing.has_value());
    setMarchUniforms(*empty, lengths, setup, volume);
    const gl::Functions& f = gl::functions();
    f.Uniform1i(empty->uniform("backgroundChannel"), plan.background->channel);
    f.Uniform1f(empty->uniform("backgroundHigh"), plan.background->high);
  }
  times.march += preparing.seconds();

  const DepthRange owned = depthRange(request.camera, grid.owned);
  for (int s = 0; s < slabs; ++s) {
    const double from = depths[std::size_t(s)], to = depths[std::size_t(s) + 1];
    if (to <= owned.low || from >= owned.high) {
      take(s, missed());
      continue;
    }
    const auto local = [&](double depth) {
      return float((depth - setup.frame.depthOrigin) / setup.frame.scale);
    };
    const glm::vec2 slab(local(from), local(to));
    Passes passes(plan, slab);
    if (!passes.marched.empty()) {
      passes.passes.emplace_back(*marched, passes.marched);
      passes.programs.push_back(marched);
    }
    if (!passes.empty.empty()) {
      passes.passes.emplace_back(*empty, passes.empty);
      passes.programs.push_back(empty);
    }
    take(s, readSlab(passes, lengths, slab, times));
  }
}

}  // namespace vestige
