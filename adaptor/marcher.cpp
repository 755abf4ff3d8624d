// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/marcher.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "adaptor/block_volume.h"
#include "adaptor/march_setup.h"
#include "adaptor/ray_planes.h"
#include "adaptor/stopwatch.h"
#include "adaptor/tile_plan.h"
#include "march_base_glsl.embed.h"
#include "march_field_glsl.embed.h"
#include "march_glsl.embed.h"
#include "proxy/error.h"
#include "proxy/gl/functions.h"
#include "proxy/gl/objects.h"
#include "proxy/gl/program.h"

namespace vestige {
namespace {

using Defines = std::vector<std::pair<std::string, std::string>>;

constexpr int kStretch = 8;  ///< steps between two looks for crossings
constexpr int kTile = TilePlan::kTile;
constexpr std::size_t kBandBytes = 16u << 20;  ///< of the planes of a band of rows

/// "X(0, 1) X(1, 2) …" for the shader's unrolled loops.
std::string unrolled(int count, bool pairs, bool backward = false) {
  std::string text;
  for (int i = 0; i < count; ++i) {
    const int k = backward ? count - 1 - i : i;
    text += "X(" + std::to_string(k) + (pairs ? ", " + std::to_string(k + 1) : "") + ") ";
  }
  return text;
}

/// Where hardly any brick can be passed over, looking costs more than it saves.
bool worthSkipping(const std::vector<glm::vec4>& bricks) {
  const auto skippable = std::count_if(bricks.begin(), bricks.end(),
                                       [](const glm::vec4& brick) { return brick.x >= 0.0f; });
  return std::size_t(skippable) * 50 > bricks.size();
}

void checkRequest(const MarchRequest& request) {
  request.camera.validate();
  if (request.size.width < 1 || request.size.height < 1) {
    throw Error(ErrorCode::InvalidArgument, "a picture of " + std::to_string(request.size.width) +
                                                " x " + std::to_string(request.size.height) +
                                                " pixels cannot be marched");
  }
  for (double isovalue : request.isovalues) {
    if (!std::isfinite(isovalue)) {
      throw Error(ErrorCode::InvalidArgument,
                  "the isovalue " + std::to_string(isovalue) + " is not finite");
    }
  }
}

}  // namespace

/// What a request comes to in one block.
struct Marcher::Setup {
  MarchFrame frame;
  std::array<MarchAxis, 3> axes;
  std::optional<BaseTable> base;
  std::vector<glm::vec2> edges;
  std::vector<glm::vec4> bricks;
  bool skips;

  Setup(const MarchRequest& request, const BlockVolume& volume)
      : frame(request.domain, request.camera),
        axes{MarchAxis(volume.grid().nodes[0], frame.centre.x, frame.scale, request.domain.low.x),
             MarchAxis(volume.grid().nodes[1], frame.centre.y, frame.scale, request.domain.low.y),
             MarchAxis(volume.grid().nodes[2], frame.centre.z, frame.scale, request.domain.low.z)} {
    if (request.attenuation || request.reference) {
      base.emplace(request.base, request.partition, frame.scale);
    }
    const BaseTable* table = base ? &*base : nullptr;
    edges = channelEdges(request.partition, table);
    bricks = volume.bricks().texels(edges, table);
    if (!request.passOver) {
      for (glm::vec4& brick : bricks) brick.x = -1.0f;
    }
    skips = worthSkipping(bricks);
  }
};

/// Tiles and the program that is run on them.
struct Marcher::Pass {
  const gl::Program& program;
  const std::vector<glm::vec4>& tiles;
  gl::Buffer buffer;

  Pass(const gl::Program& program_, const std::vector<glm::vec4>& tiles_)
      : program(program_), tiles(tiles_) {
    const gl::Functions& f = gl::functions();
    f.BindBuffer(GL_SHADER_STORAGE_BUFFER, buffer.id());
    f.BufferData(GL_SHADER_STORAGE_BUFFER, GLsizeiptr(tiles.size() * sizeof(glm::vec4)),
                 tiles.data(), GL_STREAM_DRAW);
  }

  /// Runs it on the tiles whose first row of pixels is in [first, first + count).
  void run(int first, int count) const {
    const auto from = [&](int row) {
      return std::partition_point(tiles.begin(), tiles.end(),
                                  [&](const glm::vec4& t) { return t.y * kTile < float(row); });
    };
    const auto begin = from(first), end = from(first + count);
    if (begin == end) return;
    const gl::Functions& f = gl::functions();
    program.use();
    f.Uniform2i(program.uniform("band"), first, count);
    f.Uniform1i(program.uniform("firstTile"), int(begin - tiles.begin()));
    f.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, buffer.id());
    f.DispatchCompute(GLuint(end - begin), 1, 1);
  }
};

struct Marcher::Impl {
  explicit Impl(std::shared_ptr<gl::Device> device_) : device(std::move(device_)) {}
  ~Impl() {
    device->run([this] {
      volume.clear();
      planes.reset();
      programs.clear();
    });
  }

  gl::Program& program(const MarchRequest& request, const Setup& setup, bool quiet);
  void setUniforms(const gl::Program& program, const MarchRequest& request, const Setup& setup);
  void marchBands(std::span<const Pass> passes, const MarchRequest& request, RayImage& image);
  RayImage march(const MarchRequest& request);

  std::shared_ptr<gl::Device> device;
  BlockVolume volume;
  std::optional<gl::Buffer> planes;
  std::map<std::string, gl::Program> programs;
  Times times;
};

gl::Program& Marcher::Impl::program(const MarchRequest& request, const Setup& setup, bool quiet) {
  const int layers = int(request.isovalues.size());
  Defines defines = {{"INTERVALS", std::to_string(request.partition.intervals())},
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
  flag("BASE", setup.base.has_value());
  flag("PIECES", setup.base && setup.base->pieces);
  flag("GAPS", volume.hasGaps());
  flag("QUIET", quiet);
  if (setup.skips && !quiet) defines.push_back({"SKIP", std::to_string(BrickGrid::kCells)});
  flag("AXIS_X", !setup.axes[0].even);
  flag("AXIS_Y", !setup.axes[1].even);
  flag("AXIS_Z", !setup.axes[2].even);

  std::string key;
  for (const auto& [name, value] : defines) key += name + "=" + value + ";";
  const auto found = programs.find(key);
  if (found != programs.end()) return found->second;
  std::string source(embedded::march_field_glsl);
  if (setup.base) source += embedded::march_base_glsl;
  source += embedded::march_glsl;
  return programs.emplace(key, gl::Program({{GL_COMPUTE_SHADER, source}}, defines)).first->second;
}

void Marcher::Impl::setUniforms(const gl::Program& program, const MarchRequest& request,
                                const Setup& setup) {
  const auto& [frame, axes, base, edges, bricks, skips] = setup;
  const gl::Functions& f = gl::functions();
  program.use();
  const auto at = [&](const char* name) { return program.uniform(name); };
  const auto vec3 = [&](const char* name, glm::vec3 v) {
    f.Uniform3fv(at(name), 1, glm::value_ptr(v));
  };
  f.Uniform1i(at("volume"), kVolumeUnit);
  const auto nodeCount = volume.grid().size();
  f.Uniform3i(at("nodeCount"), nodeCount[0], nodeCount[1], nodeCount[2]);
  glm::vec3 nodesFromLocal, nodesOrigin, firstNode, guesses[3];
  glm::vec3 brickLow, brickWidth;
  const char* const nodeNames[3] = {"nodesX", "nodesY", "nodesZ"};
  for (int i = 0; i < 3; ++i) {
    nodesFromLocal[i] = axes[std::size_t(i)].nodesFromLocal;
    nodesOrigin[i] = axes[std::size_t(i)].nodesOrigin;
    firstNode[i] = axes[std::size_t(i)].firstNode;
    guesses[i] = axes[std::size_t(i)].guess;
    f.Uniform1i(at(nodeNames[i]), kNodesUnit + i);
    brickLow[i] = axes[std::size_t(i)].nodeAt(0);
    brickWidth[i] = axes[std::size_t(i)].nodeAt(BrickGrid::kCells) - brickLow[i];
  }
  const auto brickCount = volume.bricks().size();
  f.Uniform1i(at("bricks"), kBricksUnit);
  f.Uniform3i(at("lastBrick"), brickCount[0] - 1, brickCount[1] - 1, brickCount[2] - 1);
  vec3("brickLow", brickLow);
  vec3("brickWidth", brickWidth);
  vec3("nodesFromLocal", nodesFromLocal);
  vec3("nodesOrigin", nodesOrigin);
  vec3("firstNode", firstNode);
  vec3("lastNode", firstNode + glm::vec3(nodeCount[0] - 1, nodeCount[1] - 1, nodeCount[2] - 1));
  const glm::vec2 texelSize(1.0f / float(nodeCount[0]), 1.0f / float(nodeCount[1]));
  const glm::vec2 cornerOrigin = (1.0f - glm::vec2(firstNode)) * texelSize;
  f.Uniform2f(at("texelSize"), texelSize.x, texelSize.y);
  f.Uniform2f(at("cornerOrigin"), cornerOrigin.x, cornerOrigin.y);
  f.Uniform3fv(at("guesses"), 3, glm::value_ptr(guesses[0]));

  const MarchRays rays(frame, request.camera, request.size);
  f.Uniform2i(at("size"), request.size.width, request.size.height);
  f.Uniform3fv(at("originAt"), 3, glm::value_ptr(rays.origin[0]));
  f.Uniform3fv(at("directionAt"), 3, glm::value_ptr(rays.direction[0]));
  f.Uniform1f(at("firstDepth"), rays.firstDepth);
  vec3("boxLow", frame.localFromWorld(volume.grid().owned.low));
  vec3("boxHigh", frame.localFromWorld(volume.grid().owned.high));
  vec3("domainHigh", frame.localFromWorld(request.domain.high));
  f.Uniform1f(at("stepDepth"), float(marchStep(request, volume.grid()) / frame.scale));
  f.Uniform1f(at("depthOrigin"), float(frame.depthOrigin));
  f.Uniform1f(at("scale"), float(frame.scale));
  const glm::mat3 eye(request.camera.eyeFromWorld());
  f.UniformMatrix3fv(at("eyeFromWorld"), 1, GL_FALSE, glm::value_ptr(eye));

  std::vector<float> isovalues;
  for (double v : request.isovalues) isovalues.push_back(float(request.partition.normalised(v)));
  if (!isovalues.empty()) {
    f.Uniform1fv(at("isovalues"), GLsizei(isovalues.size()), isovalues.data());
  }
  f.Uniform2fv(at("edges"), GLsizei(edges.size()), glm::value_ptr(edges[0]));
  if (base) {
    f.Uniform1i(at("base"), kBaseUnit);
    f.Uniform1i(at("baseColor"), kBaseColorUnit);
    f.Uniform2f(at("baseCells"), base->cellsPerValue, base->cellOfZero);
    f.Uniform1f(at("baseLast"), base->lastCell);
    f.Uniform1f(at("baseColorRate"), base->colorRate);
  }
}

void Marcher::Impl::marchBands(std::span<const Pass> passes, const MarchRequest& request,
                               RayImage& image) {
  const gl::Functions& f = gl::functions();
  const auto [width, height] = request.size;
  const std::size_t rowBytes = planeCount(request) * std::size_t(width) * sizeof(float);
  const int fitting = int(std::max<std::size_t>(1, kBandBytes / rowBytes / kTile)) * kTile;
  const int rows = std::min(fitting, (height + kTile - 1) / kTile * kTile);

  if (!planes) planes.emplace();
  f.BindBuffer(GL_SHADER_STORAGE_BUFFER, planes->id());
  f.BufferData(GL_SHADER_STORAGE_BUFFER, GLsizeiptr(rowBytes * std::size_t(rows)), nullptr,
               GL_STREAM_READ);
  f.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, planes->id());
  for (int row = 0; row < height; row += rows) {
    const Stopwatch marching;
    const int count = std::min(rows, height - row);
    f.ClearBufferData(GL_SHADER_STORAGE_BUFFER, GL_R32F, GL_RED, GL_FLOAT, nullptr);
    for (const Pass& pass : passes) pass.run(row, count);
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
  const Setup setup(request, volume);
  const TilePlan plan(volume.bricks(), setup.bricks, grid, setup.frame, request);

  std::vector<gl::Texture> tables;
  for (int i = 0; i < 3; ++i) {
    const MarchAxis& axis = setup.axes[std::size_t(i)];
    if (!axis.even) tables.push_back(makeTable(kNodesUnit + i, axis.width, axis.texels));
  }
  std::vector<BufferTable> baseTables;
  if (setup.base) {
    baseTables.emplace_back(kBaseUnit, setup.base->cells);
    baseTables.emplace_back(kBaseColorUnit, setup.base->colors);
  }
  std::optional<BrickTexture> brickTexture;
  if (setup.skips) brickTexture.emplace(volume.bricks(), setup.bricks);
  volume.bind();

  std::vector<Pass> passes;
  if (!plan.marched.empty()) {
    passes.emplace_back(program(request, setup, false), plan.marched);
    setUniforms(passes.back().program, request, setup);
  }
  if (!plan.quiet.empty()) {
    passes.emplace_back(program(request, setup, true), plan.quiet);
    const gl::Program& quiet = passes.back().program;
    setUniforms(quiet, request, setup);
    f.Uniform1i(quiet.uniform("backgroundChannel"), plan.background->channel);
    f.Uniform1f(quiet.uniform("backgroundHigh"), plan.background->high);
  }
  times.march += preparing.seconds();
  marchBands(passes, request, image);
  return image;
}

Marcher::Marcher(std::shared_ptr<gl::Device> device)
    : impl_(std::make_unique<Impl>(std::move(device))) {}
Marcher::~Marcher() = default;

void Marcher::upload(const BlockGrid& grid, const FillSlab& fill, int threads) {
  Times& times = impl_->times;
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

const Marcher::Times& Marcher::times() const { return impl_->times; }

}  // namespace vestige
