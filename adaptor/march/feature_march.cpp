// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/march/feature_march.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/gtc/type_ptr.hpp>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "adaptor/common/stopwatch.h"
#include "adaptor/march/march_pass.h"
#include "adaptor/march/tile_plan.h"
#include "adaptor/volume/block_volume.h"
#include "adaptor/volume/feature_bricks.h"
#include "feature_march_glsl.embed.h"
#include "march_field_glsl.embed.h"
#include "proxy/base/error.h"
#include "proxy/format/layout/feature_layout.h"
#include "proxy/gl/functions.h"

namespace vestige {
namespace {

constexpr int kFlatPlanes = 3;  ///< entry, exit, 1 - T

/// Texture units of the fields, after those of the march.
constexpr int kFieldsUnit = kNodesUnit + 3;

MarchRequest marchRequestOf(const FeatureRequest& request) {
  MarchRequest march{.camera = request.camera,
                     .size = request.size,
                     .partition = IntervalPartition::uniform(0.0, 1.0, 1),
                     .base = TransferFunction::ramp(0.0, 1.0, 1.0),
                     .domain = request.domain,
                     .stepLength = request.stepLength};
  march.attenuation = march.length = false;
  return march;
}

void checkFeatures(const FeatureRequest& request, std::size_t volumes) {
  const auto refuse = [](const std::string& reason) {
    throw Error(ErrorCode::InvalidArgument, "a march of features: " + reason);
  };
  if (!request.classifier) refuse("there is no classifier");
  const Classifier& classifier = *request.classifier;
  const std::size_t channels = classifier.channels().size();
  if (channels == 0) {
    refuse("a classifier of kind '" + std::string(classifier.kind()) + "' has no weights");
  }
  if (request.optics.size() != channels) {
    refuse(std::to_string(channels) + " channels have " + std::to_string(request.optics.size()) +
           " optics");
  }
  const std::size_t needed = classifier.fields().size() + (classifier.needsGradient() ? 1 : 0);
  if (volumes != 0 && volumes != needed) {
    refuse(std::to_string(volumes) + " fields are uploaded, the classifier needs " +
           std::to_string(needed));
  }
}

}  // namespace

struct FeatureMarcher::Impl {
  explicit Impl(std::shared_ptr<gl::Device> device_) : device(std::move(device_)) {}
  ~Impl() {
    device->run([this] {
      volumes.clear();
      planes.reset();
      programs.clear();
    });
  }

  using TakeBand = std::function<void(const float* planes, int firstRow, int rows)>;
  /// Marches and hands out the planes of each band of rows.
  void run(const FeatureRequest& request, std::span<const double> depths, const TakeBand& take);
  const gl::Program& program(const FeatureRequest& request, const MarchSetup& setup, int slabs);
  void setUniforms(const gl::Program& program, const FeatureRequest& request,
                   const MarchFrame& frame, std::span<const double> depths) const;
  void marchBands(const TilePass& pass, ImageSize size, std::size_t planeCount,
                  const TakeBand& take);

  std::shared_ptr<gl::Device> device;
  std::vector<BlockVolume> volumes;  ///< of the fields, then of the gradient norm
  std::optional<gl::Buffer> planes;
  std::map<std::string, gl::Program> programs;
  MarchTimes times;
};

const gl::Program& FeatureMarcher::Impl::program(const FeatureRequest& request,
                                                 const MarchSetup& setup, int slabs) {
  const Classifier& classifier = *request.classifier;
  MarchDefines defines = {{"FIELDS", std::to_string(classifier.fields().size())},
                          {"VOLUMES", std::to_string(volumes.size())},
                          {"CHANNELS", std::to_string(classifier.channels().size())},
                          {"PARAMETERS", std::to_string(classifier.parameters().size())}};
  if (classifier.needsGradient()) defines.push_back({"GRADIENT", ""});
  if (slabs > 0) defines.push_back({"SLABS", std::to_string(slabs)});
  if (request.camera.projection == Projection::MultiPerspective) {
    defines.push_back({"CONVERGING", ""});
  }
  addFieldDefines(defines, setup, volumes.front(), true);
  const auto gaps = [](const BlockVolume& volume) { return volume.hasGaps(); };
  if (!gaps(volumes.front()) && std::any_of(volumes.begin(), volumes.end(), gaps)) {
    defines.push_back({"GAPS", ""});
  }
  std::string key(classifier.kind());
  for (const auto& [name, value] : defines) key += ";" + name + "=" + value;
  const auto found = programs.find(key);
  if (found != programs.end()) return found->second;
  std::string source(embedded::march_field_glsl);
  source += "\nuniform vec4 parameters[PARAMETERS];\n";
  source += classifier.glsl();
  source += embedded::feature_march_glsl;
  return programs.emplace(key, gl::Program({{GL_COMPUTE_SHADER, source}}, defines)).first->second;
}

void FeatureMarcher::Impl::setUniforms(const gl::Program& program, const FeatureRequest& request,
                                       const MarchFrame& frame,
                                       std::span<const double> depths) const {
  const gl::Functions& f = gl::functions();
  const auto numbers = [&](const char* name, const std::vector<float>& values) {
    f.Uniform1fv(program.uniform(name), GLsizei(values.size()), values.data());
  };
  const std::vector<glm::vec4> parameters = request.classifier->parameters();
  f.Uniform4fv(program.uniform("parameters"), GLsizei(parameters.size()),
               glm::value_ptr(parameters.front()));
  std::vector<float> extinction, rate, faces;
  for (const ChannelOptics& optics : request.optics) {
    extinction.push_back(float(optics.extinction));
    rate.push_back(float(attenuationRate(optics)));
  }
  for (const double depth : depths) {
    faces.push_back(float((depth - frame.depthOrigin) / frame.scale));
  }
  numbers("extinction", extinction);
  numbers("rate", rate);
  if (!faces.empty()) numbers("faces", faces);
  std::vector<GLint> units;
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    units.push_back(kFieldsUnit + int(i));
    volumes[i].bind(units.back());
  }
  f.Uniform1iv(program.uniform("volumes"), GLsizei(units.size()), units.data());
}

void FeatureMarcher::Impl::marchBands(const TilePass& pass, ImageSize size, std::size_t planeCount,
                                      const TakeBand& take) {
  const gl::Functions& f = gl::functions();
  const std::size_t rowBytes = planeCount * std::size_t(size.width) * sizeof(float);
  const int rows = TilePlan::bandRows(size.height, rowBytes);
  if (!planes) planes.emplace();
  f.BindBuffer(GL_SHADER_STORAGE_BUFFER, planes->id());
  f.BufferData(GL_SHADER_STORAGE_BUFFER, GLsizeiptr(rowBytes * std::size_t(rows)), nullptr,
               GL_STREAM_READ);
  f.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, planes->id());
  for (int row = 0; row < size.height; row += rows) {
    const Stopwatch marching;
    const int count = std::min(rows, size.height - row);
    f.BindBuffer(GL_SHADER_STORAGE_BUFFER, planes->id());
    f.ClearBufferData(GL_SHADER_STORAGE_BUFFER, GL_R32F, GL_RED, GL_FLOAT, nullptr);
    pass.run(row, count);
    f.BindBuffer(GL_SHADER_STORAGE_BUFFER, planes->id());
    f.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    f.Finish();
    times.march += marching.seconds();
    const Stopwatch reading;
    const auto* mapped = static_cast<const float*>(f.MapBufferRange(
        GL_SHADER_STORAGE_BUFFER, 0, GLsizeiptr(rowBytes * std::size_t(count)), GL_MAP_READ_BIT));
    if (!mapped) {
      gl::checkErrors("the read-back of features");
      throw Error(ErrorCode::Gl, "the read-back of features: the result could not be mapped");
    }
    take(mapped, row, count);
    f.UnmapBuffer(GL_SHADER_STORAGE_BUFFER);
    times.readBack += reading.seconds();
  }
  gl::checkErrors("a march of features");
}

void FeatureMarcher::Impl::run(const FeatureRequest& request, std::span<const double> depths,
                               const TakeBand& take) {
  if (volumes.empty() || volumes.front().grid().empty()) return;
  const Stopwatch preparing;
  const BlockVolume& first = volumes.front();
  const MarchRequest march = marchRequestOf(request);
  MarchSetup setup(march, first, false);
  std::vector<const BrickGrid*> bricks;
  for (const BlockVolume& volume : volumes) bricks.push_back(&volume.bricks());
  std::vector<glm::vec4> apart(setup.bricks.size(), glm::vec4(-1.0f, 0.0f, 0.0f, 0.0f));
  setup.bricks = apart;
  if (request.skipEmptySpace) {
    setup.bricks = vanishingBricks(*request.classifier, bricks, false);
    apart = vanishingBricks(*request.classifier, bricks, true);
  }
  const auto vanishing = std::count_if(setup.bricks.begin(), setup.bricks.end(),
                                       [](const glm::vec4& brick) { return brick.x >= 0.0f; });
  setup.skips = std::size_t(vanishing) * 50 > setup.bricks.size();
  const TilePlan plan(first.bricks(), apart, first.grid(), setup.frame, march);
  if (plan.marched.empty()) return;
  const MarchTables tables(setup, first);
  const int slabs = std::max(0, int(depths.size()) - 1);
  const std::size_t channels = request.classifier->channels().size();
  const TilePass pass(program(request, setup, slabs), plan.marched);
  setMarchUniforms(pass.program, march, setup, first);
  setUniforms(pass.program, request, setup.frame, depths);
  times.march += preparing.seconds();
  const std::size_t count = slabs > 0 ? std::size_t(slabs) * channels : kFlatPlanes + 3 * channels;
  marchBands(pass, request.size, count, take);
}

FeatureMarcher::FeatureMarcher(std::shared_ptr<gl::Device> device)
    : impl_(std::make_unique<Impl>(std::move(device))) {}
FeatureMarcher::~FeatureMarcher() = default;

void FeatureMarcher::upload(const BlockGrid& grid, std::span<const FillSlab> fields, int threads) {
  MarchTimes& times = impl_->times;
  times.fill = times.upload = 0.0;
  if (fields.empty()) throw Error(ErrorCode::InvalidArgument, "a march of features: no fields");
  impl_->device->run([&] {
    impl_->volumes.resize(fields.size());
    try {
      for (std::size_t i = 0; i < fields.size(); ++i) {
        impl_->volumes[i].upload(grid, fields[i], impl_->device->info().maxTexture3D, threads,
                                 times);
      }
    } catch (...) {
      impl_->volumes.clear();
      throw;
    }
  });
}

RayImage FeatureMarcher::march(const FeatureRequest& request) {
  checkFeatures(request, impl_->volumes.size());
  checkRequest(marchRequestOf(request));
  impl_->times.march = impl_->times.readBack = 0.0;
  const std::size_t pixels = request.size.pixels();
  const std::size_t channels = request.classifier->channels().size();
  RayImage image;
  image.size = request.size;
  image.channels = int(channels);
  image.entry.assign(pixels, kInfinity);
  image.exit.assign(pixels, -kInfinity);
  image.transmittance.assign(pixels, 1.0f);
  for (auto* planes : {&image.length, &image.moment, &image.attenuation}) {
    planes->resize(channels * pixels);
  }
  impl_->device->run([&] {
    impl_->run(request, {}, [&](const float* from, int firstRow, int rows) {
      const std::size_t count = std::size_t(rows) * std::size_t(request.size.width);
      const std::size_t first = std::size_t(firstRow) * std::size_t(request.size.width);
      for (std::size_t i = 0; i < count; ++i) {
        // Rays of tiles that were not marched have neither.
        if (from[i] == 0.0f && from[count + i] == 0.0f) continue;
        image.entry[first + i] = from[i];
        image.exit[first + i] = from[count + i];
        image.transmittance[first + i] = 1.0f - from[2 * count + i];
      }
      from += kFlatPlanes * count;
      for (auto* planes : {&image.length, &image.moment, &image.attenuation}) {
        for (std::size_t c = 0; c < channels; ++c, from += count) {
          std::copy_n(from, count, planes->begin() + std::ptrdiff_t(c * pixels + first));
        }
      }
    });
  });
  return image;
}

std::vector<std::vector<float>> FeatureMarcher::marchSlabs(const FeatureRequest& request,
                                                           std::span<const double> depths) {
  checkFeatures(request, impl_->volumes.size());
  checkRequest(marchRequestOf(request));
  if (request.camera.projection != Projection::Orthographic || depths.size() < 2 ||
      !std::is_sorted(depths.begin(), depths.end(), std::less_equal<>())) {
    throw Error(ErrorCode::InvalidArgument,
                "a march of features: slabs need an orthographic view and depths that rise");
  }
  impl_->times.march = impl_->times.readBack = 0.0;
  const std::size_t pixels = request.size.pixels(), slabs = depths.size() - 1;
  const std::size_t channels = request.classifier->channels().size();
  std::vector<std::vector<float>> made(slabs, std::vector<float>(channels * pixels));
  impl_->device->run([&] {
    impl_->run(request, depths, [&](const float* from, int firstRow, int rows) {
      const std::size_t count = std::size_t(rows) * std::size_t(request.size.width);
      const std::size_t first = std::size_t(firstRow) * std::size_t(request.size.width);
      for (auto& slab : made) {
        for (std::size_t c = 0; c < channels; ++c, from += count) {
          std::copy_n(from, count, slab.begin() + std::ptrdiff_t(c * pixels + first));
        }
      }
    });
  });
  return made;
}

const MarchTimes& FeatureMarcher::times() const { return impl_->times; }

}  // namespace vestige
