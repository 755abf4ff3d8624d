// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/marcher.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <glm/gtc/type_ptr.hpp>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "adaptor/march_setup.h"
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

constexpr int kStretch = 8;                      ///< steps between two looks for crossings
constexpr int kTile = 8;                         ///< pixels a side of a workgroup
constexpr std::size_t kStagingBytes = 8u << 20;  ///< of a slab on its way to the texture
constexpr std::size_t kBandBytes = 16u << 20;    ///< of the planes of a band of rows
enum Unit { kVolumeUnit, kBaseUnit, kBaseColorUnit, kNodesUnit };  // kNodesUnit + axis

class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    return std::chrono::duration<double>(now - std::exchange(start_, now)).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

void setFilter(GLenum target, GLint filter) {
  const gl::Functions& f = gl::functions();
  f.TexParameteri(target, GL_TEXTURE_MIN_FILTER, filter);
  f.TexParameteri(target, GL_TEXTURE_MAG_FILTER, filter);
  for (GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R}) {
    f.TexParameteri(target, wrap, GL_CLAMP_TO_EDGE);
  }
}

gl::Texture makeTable(int unit, int width, const std::vector<glm::vec4>& texels) {
  const gl::Functions& f = gl::functions();
  gl::Texture table(GL_TEXTURE_2D);
  table.bind(unit);
  const int height = int(texels.size()) / width;
  f.TexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA32F, width, height);
  setFilter(GL_TEXTURE_2D, GL_NEAREST);
  f.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, GL_RGBA, GL_FLOAT, texels.data());
  return table;
}

/// A table of texels that shaders read by index.
struct BufferTable {
  gl::Buffer buffer;
  gl::Texture texture{GL_TEXTURE_BUFFER};

  BufferTable(int unit, const std::vector<glm::vec4>& texels) {
    const gl::Functions& f = gl::functions();
    f.BindBuffer(GL_TEXTURE_BUFFER, buffer.id());
    f.BufferData(GL_TEXTURE_BUFFER, GLsizeiptr(texels.size() * sizeof(glm::vec4)), texels.data(),
                 GL_STREAM_DRAW);
    texture.bind(unit);
    f.TexBuffer(GL_TEXTURE_BUFFER, GL_RGBA32F, buffer.id());
  }
};

/// "X(0, 1) X(1, 2) …" for the shader's unrolled loops.
std::string unrolled(int count, bool pairs, bool backward = false) {
  std::string text;
  for (int i = 0; i < count; ++i) {
    const int k = backward ? count - 1 - i : i;
    text += "X(" + std::to_string(k) + (pairs ? ", " + std::to_string(k + 1) : "") + ") ";
  }
  return text;
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

bool anyNotFinite(const float* values, std::size_t count) {
  std::uint32_t largest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t bits;
    std::memcpy(&bits, values + i, sizeof bits);
    largest = std::max(largest, bits & 0x7fffffffu);
  }
  return largest >= 0x7f800000u;
}

/// An image in which every ray misses.
RayImage emptyImage(const MarchRequest& request) {
  const std::size_t pixels = request.size.pixels();
  const std::size_t channels = std::size_t(request.partition.channels());
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  RayImage image;
  image.size = request.size;
  image.channels = int(channels);
  image.entry.assign(pixels, kInfinity);
  image.exit.assign(pixels, -kInfinity);
  if (request.length || request.attenuation) {
    image.first.assign(pixels, 255);
    image.last.assign(pixels, 255);
  }
  if (request.length) {
    image.length.resize(channels * pixels);
    image.moment.resize(channels * pixels);
    image.runs.resize(channels * pixels);
  }
  if (request.attenuation) {
    image.attenuation.resize(channels * pixels);
  }
  if (request.attenuation || request.reference) image.transmittance.assign(pixels, 1.0f);
  image.depth.assign(request.isovalues.size() * pixels, kInfinity);
  image.normal.resize(request.isovalues.size() * 3 * pixels);
  if (request.mip) image.mip.assign(pixels, std::numeric_limits<float>::quiet_NaN());
  if (request.reference) image.reference.resize(3 * pixels);
  return image;
}

/// How many planes march.glsl puts for a request.
std::size_t planeCount(const MarchRequest& request) {
  const std::size_t channels = std::size_t(request.partition.channels());
  std::size_t count = 2 + 4 * request.isovalues.size();
  if (request.length || request.attenuation) count += 2;
  if (request.length) count += 3 * channels;
  if (request.attenuation) count += channels;
  if (request.attenuation || request.reference) count += 1;
  if (request.mip) count += 1;
  if (request.reference) count += 3;
  return count;
}

/// Takes the planes of a band of rows apart, in the order in which march.glsl puts them.
class BandReader {
 public:
  BandReader(const float* planes, ImageSize size, int firstRow, int rows)
      : next_(planes),
        first_(std::size_t(firstRow) * std::size_t(size.width)),
        count_(std::size_t(rows) * std::size_t(size.width)),
        pixels_(size.pixels()) {}

  template <typename Convert>
  void take(std::size_t plane, auto& to, const Convert& convert) {
    auto* out = to.data() + plane * pixels_ + first_;
    for (std::size_t i = 0; i < count_; ++i) out[i] = convert(next_[i]);
    next_ += count_;
  }
  void take(std::vector<float>& to) {
    for (std::size_t plane = 0; plane * pixels_ < to.size(); ++plane) {
      std::memcpy(to.data() + plane * pixels_ + first_, next_, count_ * sizeof(float));
      next_ += count_;
    }
  }

 private:
  const float* next_;
  std::size_t first_, count_, pixels_;
};

}  // namespace

struct Marcher::Impl {
  // Hardware filters with weights of eight bits; Mesa's rasteriser in single precision.
  Impl(std::shared_ptr<gl::Device> device_, bool own)
      : device(std::move(device_)),
        ownFilter(own || device->info().renderer.find("llvmpipe") == std::string::npos) {}
  ~Impl() {
    device->run([this] {
      volume.reset();
      planes.reset();
      programs.clear();
    });
  }

  void allocate(const BlockGrid& grid);
  void uploadSlabs(const FillSlab& fill);
  gl::Program& program(const MarchRequest& request, const std::array<MarchAxis, 3>& axes,
                       const BaseTable* base);
  void setUniforms(const gl::Program& program, const MarchRequest& request, const MarchFrame& frame,
                   const std::array<MarchAxis, 3>& axes);
  void readBand(const MarchRequest& request, int firstRow, int rows, RayImage& image);
  void marchBands(const gl::Program& program, const MarchRequest& request, RayImage& image);
  RayImage march(const MarchRequest& request);

  std::shared_ptr<gl::Device> device;
  bool ownFilter;  ///< the shader's, of samples
  BlockGrid grid;
  std::array<int, 3> volumeSize{0, 0, 0};
  bool hasGaps = false;  ///< samples without data in the volume
  std::optional<gl::Texture> volume;
  std::optional<gl::Buffer> planes;
  std::map<std::string, gl::Program> programs;
  Times times;
};

void Marcher::Impl::allocate(const BlockGrid& newGrid) {
  const auto size = newGrid.size();
  const int most = device->info().maxTexture3D;
  if (std::max({size[0], size[1], size[2]}) > most) {
    throw Error(ErrorCode::Gl, "a block of " + std::to_string(size[0]) + " x " +
                                   std::to_string(size[1]) + " x " + std::to_string(size[2]) +
                                   " samples does not fit: OpenGL takes " + std::to_string(most) +
                                   " a side; publish it as several blocks");
  }
  if (volume && size == volumeSize) return;
  const gl::Functions& f = gl::functions();
  volume.reset();
  volumeSize = {0, 0, 0};
  volume.emplace(GL_TEXTURE_3D);
  volume->bind(kVolumeUnit);
  f.TexStorage3D(GL_TEXTURE_3D, 1, GL_R32F, size[0], size[1], size[2]);
  setFilter(GL_TEXTURE_3D, GL_LINEAR);
  try {
    gl::checkErrors("the allocation of a block's texture");
  } catch (...) {
    volume.reset();
    throw;
  }
  volumeSize = size;
}

void Marcher::Impl::uploadSlabs(const FillSlab& fill) {
  const gl::Functions& f = gl::functions();
  const auto [nx, ny, nz] = volumeSize;
  const std::size_t layer = std::size_t(nx) * std::size_t(ny);
  const int depth =
      int(std::clamp<std::size_t>(kStagingBytes / (layer * sizeof(float)), 1, std::size_t(nz)));
  std::vector<float> staging(layer * std::size_t(depth));
  hasGaps = false;
  volume->bind(kVolumeUnit);
  f.PixelStorei(GL_UNPACK_ALIGNMENT, 4);
  for (int z = 0; z < nz; z += depth) {
    const int end = std::min(nz, z + depth);
    Stopwatch watch;
    fill(z, end, staging.data());
    hasGaps = hasGaps || anyNotFinite(staging.data(), layer * std::size_t(end - z));
    times.fill += watch.lap();
    f.TexSubImage3D(GL_TEXTURE_3D, 0, 0, 0, z, nx, ny, end - z, GL_RED, GL_FLOAT, staging.data());
    times.upload += watch.lap();
  }
  gl::checkErrors("the upload of a block");
}

gl::Program& Marcher::Impl::program(const MarchRequest& request,
                                    const std::array<MarchAxis, 3>& axes, const BaseTable* base) {
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
  flag("BASE", base != nullptr);
  flag("PIECES", base != nullptr && base->pieces);
  flag("GAPS", hasGaps);
  flag("AXIS_X", !axes[0].even);
  flag("AXIS_Y", !axes[1].even);
  flag("AXIS_Z", !axes[2].even);
  flag("FILTER", ownFilter);

  std::string key;
  for (const auto& [name, value] : defines) key += name + "=" + value + ";";
  const auto found = programs.find(key);
  if (found != programs.end()) return found->second;
  std::string source(embedded::march_field_glsl);
  if (base != nullptr) source += embedded::march_base_glsl;
  source += embedded::march_glsl;
  return programs.emplace(key, gl::Program({{GL_COMPUTE_SHADER, source}}, defines)).first->second;
}

void Marcher::Impl::setUniforms(const gl::Program& program, const MarchRequest& request,
                                const MarchFrame& frame, const std::array<MarchAxis, 3>& axes) {
  const gl::Functions& f = gl::functions();
  program.use();
  const auto at = [&](const char* name) { return program.uniform(name); };
  const auto vec3 = [&](const char* name, glm::vec3 v) {
    f.Uniform3fv(at(name), 1, glm::value_ptr(v));
  };
  f.Uniform1i(at("volume"), kVolumeUnit);
  f.Uniform3i(at("nodeCount"), volumeSize[0], volumeSize[1], volumeSize[2]);
  glm::vec3 from, textureOrigin, guesses[3];
  const char* const nodeNames[3] = {"nodesX", "nodesY", "nodesZ"};
  for (int i = 0; i < 3; ++i) {
    from[i] = axes[std::size_t(i)].textureFromLocal;
    textureOrigin[i] = axes[std::size_t(i)].textureOrigin;
    guesses[i] = axes[std::size_t(i)].guess;
    f.Uniform1i(at(nodeNames[i]), kNodesUnit + i);
  }
  vec3("textureFromLocal", from);
  vec3("textureOrigin", textureOrigin);
  f.Uniform3fv(at("guesses"), 3, glm::value_ptr(guesses[0]));

  const MarchRays rays(frame, request.camera, request.size);
  f.Uniform1i(at("channels"), request.partition.channels());
  f.Uniform2i(at("size"), request.size.width, request.size.height);
  f.Uniform3fv(at("originAt"), 3, glm::value_ptr(rays.origin[0]));
  f.Uniform3fv(at("directionAt"), 3, glm::value_ptr(rays.direction[0]));
  f.Uniform1f(at("firstDepth"), rays.firstDepth);
  vec3("boxLow", frame.localFromWorld(grid.owned.low));
  vec3("boxHigh", frame.localFromWorld(grid.owned.high));
  vec3("domainHigh", frame.localFromWorld(request.domain.high));
  f.Uniform1f(at("stepDepth"), float(marchStep(request, grid) / frame.scale));
  f.Uniform1f(at("depthOrigin"), float(frame.depthOrigin));
  f.Uniform1f(at("scale"), float(frame.scale));
  const glm::mat3 eye(request.camera.eyeFromWorld());
  f.UniformMatrix3fv(at("eyeFromWorld"), 1, GL_FALSE, glm::value_ptr(eye));

  std::vector<float> isovalues;
  for (double v : request.isovalues) isovalues.push_back(float(request.partition.normalised(v)));
  if (!isovalues.empty()) {
    f.Uniform1fv(at("isovalues"), GLsizei(isovalues.size()), isovalues.data());
  }
}

void Marcher::Impl::readBand(const MarchRequest& request, int firstRow, int rows, RayImage& image) {
  const gl::Functions& f = gl::functions();
  const auto* mapped = static_cast<const float*>(
      f.MapBufferRange(GL_SHADER_STORAGE_BUFFER, 0,
                       GLsizeiptr(planeCount(request) * std::size_t(rows) *
                                  std::size_t(request.size.width) * sizeof(float)),
                       GL_MAP_READ_BIT));
  if (!mapped) {
    gl::checkErrors("the read-back of a march");
    throw Error(ErrorCode::Gl, "the read-back of a march: the result could not be mapped");
  }
  BandReader reader(mapped, request.size, firstRow, rows);
  reader.take(image.entry);
  reader.take(image.exit);
  if (!image.first.empty()) {
    const auto channel = [](float c) { return std::uint8_t(c); };
    reader.take(0, image.first, channel);
    reader.take(0, image.last, channel);
  }
  reader.take(image.length);
  reader.take(image.moment);
  reader.take(image.runs);
  reader.take(image.attenuation);
  reader.take(image.transmittance);
  reader.take(image.depth);
  reader.take(image.normal);
  if (!image.mip.empty()) {
    reader.take(0, image.mip, [&](float v) {
      return std::isinf(v) ? std::numeric_limits<float>::quiet_NaN()
                           : float(request.partition.denormalised(double(v)));
    });
  }
  reader.take(image.reference);
  f.UnmapBuffer(GL_SHADER_STORAGE_BUFFER);
}

void Marcher::Impl::marchBands(const gl::Program& program, const MarchRequest& request,
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
    Stopwatch watch;
    const int count = std::min(rows, height - row);
    f.Uniform2i(program.uniform("band"), row, count);
    f.ClearBufferData(GL_SHADER_STORAGE_BUFFER, GL_R32F, GL_RED, GL_FLOAT, nullptr);
    f.DispatchCompute(GLuint((width + kTile - 1) / kTile), GLuint((count + kTile - 1) / kTile), 1);
    f.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    f.Finish();
    times.march += watch.lap();
    readBand(request, row, count, image);
    times.readBack += watch.lap();
  }
  gl::checkErrors("a march");
}

RayImage Marcher::Impl::march(const MarchRequest& request) {
  Stopwatch watch;
  RayImage image = emptyImage(request);
  times.readBack += watch.lap();
  if (grid.empty()) return image;

  const gl::Functions& f = gl::functions();
  const MarchFrame frame(request.domain, request.camera);
  const std::array<MarchAxis, 3> axes = {MarchAxis(grid.nodes[0], frame.centre.x, frame.scale),
                                         MarchAxis(grid.nodes[1], frame.centre.y, frame.scale),
                                         MarchAxis(grid.nodes[2], frame.centre.z, frame.scale)};
  std::optional<BaseTable> base;
  if (request.attenuation || request.reference) {
    base.emplace(request.base, request.partition, frame.scale);
  }
  gl::Program& program = this->program(request, axes, base ? &*base : nullptr);
  setUniforms(program, request, frame, axes);

  std::vector<gl::Texture> tables;
  for (int i = 0; i < 3; ++i) {
    const MarchAxis& axis = axes[std::size_t(i)];
    if (!axis.even) tables.push_back(makeTable(kNodesUnit + i, axis.width, axis.texels));
  }
  std::vector<BufferTable> baseTables;
  if (base) {
    baseTables.emplace_back(kBaseUnit, base->cells);
    baseTables.emplace_back(kBaseColorUnit, base->colors);
    f.Uniform1i(program.uniform("base"), kBaseUnit);
    f.Uniform1i(program.uniform("baseColor"), kBaseColorUnit);
    f.Uniform2f(program.uniform("baseCells"), base->cellsPerValue, base->cellOfZero);
    f.Uniform1f(program.uniform("baseLast"), base->lastCell);
    f.Uniform1f(program.uniform("baseColorRate"), base->colorRate);
  }
  const auto edges = channelEdges(request.partition, base ? &*base : nullptr);
  f.Uniform2fv(program.uniform("edges"), GLsizei(edges.size()), glm::value_ptr(edges[0]));
  volume->bind(kVolumeUnit);
  times.march += watch.lap();
  marchBands(program, request, image);
  return image;
}

Marcher::Marcher(std::shared_ptr<gl::Device> device, bool ownFilter)
    : impl_(std::make_unique<Impl>(std::move(device), ownFilter)) {}
Marcher::~Marcher() = default;

void Marcher::upload(const BlockGrid& grid, const FillSlab& fill) {
  impl_->times.fill = impl_->times.upload = 0.0;
  impl_->grid = BlockGrid{};
  if (!grid.empty()) {
    impl_->device->run([&] {
      Stopwatch watch;
      impl_->allocate(grid);
      impl_->times.upload += watch.lap();
      impl_->uploadSlabs(fill);
    });
  }
  impl_->grid = grid;
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
