// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/march/marcher.h"

#include <algorithm>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "adaptor/common/stopwatch.h"
#include "adaptor/march/layer_march.h"
#include "adaptor/march/march_pass.h"
#include "adaptor/march/ray_planes.h"
#include "adaptor/march/slab_march.h"
#include "adaptor/march/tile_plan.h"
#include "adaptor/volume/block_volume.h"
#include "march_base_glsl.embed.h"
#include "march_field_glsl.embed.h"
#include "march_glsl.embed.h"
#include "proxy/base/error.h"
#include "proxy/gl/functions.h"
#include "proxy/gl/objects.h"
#include "proxy/gl/program.h"

namespace vestige {
namespace {

constexpr int kStretch = 8;  ///< steps between two looks for crossings

/// Layers and slabs are cut along one direction.
void requireCommonPlanes(const MarchRequest& request) {
  if (request.camera.projection == Projection::MultiPerspective) {
    throw Error(ErrorCode::InvalidArgument,
                "layers and slabs cannot be marched for a multi-perspective camera");
  }
}

}  // namespace

struct Marcher::Impl {
  explicit Impl(std::shared_ptr<gl::Device> device_) : device(std::move(device_)) {}
  ~Impl() {
    device->run([this] {
      volume.clear();
      planes.reset();
      programs.clear();
      second.reset();
      slabs.reset();
    });
  }

  gl::Program& program(const MarchRequest& request, const MarchSetup& setup, bool empty);
  void marchBands(std::span<const TilePass> passes, const MarchRequest& request, RayImage& image);
  RayImage march(const MarchRequest& request);

  std::shared_ptr<gl::Device> device;
  BlockVolume volume;
  std::optional<gl::Buffer> planes;
  std::map<std::string, gl::Program> programs;
  std::optional<LayerMarch> second;
  std::optional<SlabMarch> slabs;
  MarchTimes times;
};

gl::Program& Marcher::Impl::program(const MarchRequest& request, const MarchSetup& setup,
                                    bool empty) {
  const int layers = int(request.isovalues.size());
  MarchDefines defines = {{"INTERVALS", std::to_string(request.partition.intervals())},
                          {"LAYERS", std::to_string(layers)},
                          {"STRETCH", std::to_string(kStretch)},
                          {"EACH_STEP(X)", unrolled(kStretch, true)},
                          {"EACH_STEP_BACK(X)", unrolled(kStretch, true, true)},
                          {"EACH_LAYER(X)", unrolled(layers, false)}};
  const auto flag = [&](const char* name, bool on) {
    if (on) defines.push_back({name, ""});
  };
  flag("LENGTH", request.length);
  flag("ATTENUATION", request.attenuation);
  flag("MIP", request.mip);
  flag("REFERENCE", request.reference);
  flag("PHONG", request.reference && request.phong);
  flag("BASE", request.attenuation || request.reference);
  flag("CONVERGING", request.camera.projection == Projection::MultiPerspective);
  flag("EMPTY_TILE", empty);
  addFieldDefines(defines, setup, volume, !empty);

  std::string key;
  for (const auto& [name, value] : defines) key += name + "=" + value + ";";
  const auto found = programs.find(key);
  if (found != programs.end()) return found->second;
  std::string source(embedded::march_field_glsl);
  if (setup.base) source += embedded::march_base_glsl;
  source += embedded::march_glsl;
  return programs.emplace(key, gl::Program({{GL_COMPUTE_SHADER, source}}, defines)).first->second;
}

void Marcher::Impl::marchBands(std::span<const TilePass> passes, const MarchRequest& request,
                               RayImage& image) {
  const gl::Functions& f = gl::functions();
  const auto [width, height] = request.size;
  const std::size_t rowBytes = planeCount(request) * std::size_t(width) * sizeof(float);
  const int rows = TilePlan::bandRows(height, rowBytes);

  if (!planes) planes.emplace();
  f.BindBuffer(GL_SHADER_STORAGE_BUFFER, planes->id());
  f.BufferData(GL_SHADER_STORAGE_BUFFER, GLsizeiptr(rowBytes * std::size_t(rows)), nullptr,
               GL_STREAM_READ);
  f.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, planes->id());
  for (int row = 0; row < height; row += rows) {
    const Stopwatch marching;
    const int count = std::min(rows, height - row);
    f.ClearBufferData(GL_SHADER_STORAGE_BUFFER, GL_R32F, GL_RED, GL_FLOAT, nullptr);
    for (const TilePass& pass : passes) pass.run(row, count);
    f.BindBuffer(GL_SHADER_STORAGE_BUFFER, planes->id());
    f.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    f.Finish();
    times.march += marching.seconds();
    const Stopwatch reading;
    const auto* mapped = static_cast<const float*>(f.MapBufferRange(
        GL_SHADER_STORAGE_BUFFER, 0, GLsizeiptr(rowBytes * std::size_t(count)), GL_MAP_READ_BIT));
    if (!mapped) {
      gl::checkErrors("the read-back of a march");
      throw Error(ErrorCode::Gl, "the read-back of a march: the result could not be mapped");
    }
    takePlanes(mapped, request, row, count, image);
    f.UnmapBuffer(GL_SHADER_STORAGE_BUFFER);
    times.readBack += reading.seconds();
  }
  gl::checkErrors("a march");
}

RayImage Marcher::Impl::march(const MarchRequest& request) {
  const Stopwatch clearing;
  RayImage image = emptyImage(request);
  times.readBack += clearing.seconds();
  const BlockGrid& grid = volume.grid();
  if (grid.empty()) return image;
  const Stopwatch preparing;
  const gl::Functions& f = gl::functions();
  // Gamma of a maximum is read where the base function is.
  const MarchSetup setup(
      request, volume,
      request.attenuation || request.reference || (request.mip && request.custom != nullptr));
  const TilePlan plan(volume.bricks(), setup.bricks, grid, setup.frame, request);

  const MarchTables tables(setup, volume);

  std::vector<TilePass> passes;
  if (!plan.marched.empty()) {
    passes.emplace_back(program(request, setup, false), plan.marched);
    setMarchUniforms(passes.back().program, request, setup, volume);
  }
  if (!plan.empty.empty()) {
    passes.emplace_back(program(request, setup, true), plan.empty);
    const gl::Program& empty = passes.back().program;
    setMarchUniforms(empty, request, setup, volume);
    f.Uniform1i(empty.uniform("backgroundChannel"), plan.background->channel);
    f.Uniform1f(empty.uniform("backgroundHigh"), plan.background->high);
  }
  times.march += preparing.seconds();
  marchBands(passes, request, image);
  return image;
}

Marcher::Marcher(std::shared_ptr<gl::Device> device)
    : impl_(std::make_unique<Impl>(std::move(device))) {}
Marcher::~Marcher() = default;

void Marcher::upload(const BlockGrid& grid, const FillSlab& fill, int threads) {
  MarchTimes& times = impl_->times;
  times.fill = times.upload = 0.0;
  impl_->device->run([&] {
    impl_->volume.upload(grid, fill, impl_->device->info().maxTexture3D, threads, times);
  });
}

RayImage Marcher::march(const MarchRequest& request) {
  checkRequest(request);
  impl_->times.march = impl_->times.readBack = 0.0;
  RayImage image;
  impl_->device->run([&] { image = impl_->march(request); });
  return image;
}

LayerRays Marcher::marchLayers(const MarchRequest& request, const LayerRequest& layers) {
  checkRequest(request);
  requireCommonPlanes(request);
  LayerRays rays;
  const Stopwatch watch;
  impl_->device->run([&] {
    if (!impl_->second) impl_->second.emplace();
    rays = impl_->second->layers(impl_->volume, request, layers);
  });
  impl_->times.march = watch.seconds();
  impl_->times.readBack = 0.0;
  return rays;
}

void Marcher::marchLight(const MarchRequest& request, LightDepth& light) {
  checkRequest(request);
  const Stopwatch watch;
  impl_->device->run([&] {
    if (!impl_->second) impl_->second.emplace();
    impl_->second->addLight(impl_->volume, request, light);
  });
  impl_->times.march = watch.seconds();
  impl_->times.readBack = 0.0;
}

void Marcher::marchSlabs(const MarchRequest& request, std::span<const double> depths,
                         const TakeSlab& take) {
  checkRequest(request);
  requireCommonPlanes(request);
  SlabMarch::Times times;
  impl_->device->run([&] {
    if (!impl_->slabs) impl_->slabs.emplace();
    impl_->slabs->march(impl_->volume, request, depths, take, times);
  });
  impl_->times.march = times.march;
  impl_->times.readBack = times.readBack;
}

const MarchTimes& Marcher::times() const { return impl_->times; }

}  // namespace vestige
