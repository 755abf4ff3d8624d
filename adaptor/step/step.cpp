// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/step/step.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "adaptor/common/adaptor_error.h"
#include "adaptor/common/stopwatch.h"
#include "adaptor/compositing/ray_sorter.h"
#include "adaptor/plan/training_looks.h"
#include "adaptor/step/field_assembly.h"
#include "adaptor/step/preview.h"
#include "adaptor/volume/customization_pass.h"
#include "proxy/format/exr/exr_threads.h"
#include "proxy/format/exr/png_file.h"
#include "proxy/format/layout/analytic_layers_layout.h"
#include "proxy/format/layout/learned_layout.h"
#include "proxy/format/layout/proxy_layout.h"

namespace vestige {
namespace {

ProxyHeader headerFor(const Config& config, const StepFrame& frame, const StepField& field,
                      const View& view) {
  ProxyHeader header = commonHeader(config, frame, view);
  header.field = field.plan.name;
  header.units = field.plan.units;
  header.partition = field.classification.partition;
  header.base = field.classification.base;
  header.statistics = field.statistics;
  return header;
}

/// Of a proxy that the customisation changes; of MIP it does so by gamma alone.
ProxyHeader customized(const Config& config, ProxyHeader header, bool mip = false) {
  if (config.customization && (!mip || config.customization->hasGamma()))
    header.customization = config.customization;
  return header;
}

std::string headlightIf(bool lit) { return lit ? "headlight" : "unlit"; }

/// What the colours of layers hold.
std::string shadingOf(const Config& config) {
  if (config.layerLight) {
    const glm::dvec3 d = glm::normalize(*config.layerLight);
    return fmt::format("shadows of a light along ({}, {}, {}), ambient {}", d.x, d.y, d.z,
                       kShadowAmbient);
  }
  return headlightIf(config.phong);
}

std::vector<EncodedProxy> pack(const Config& config, const ProxyHeader& header,
                               const ViewRays& made, const Classification& classification,
                               int threads) {
  const RayImage& rays = made.rays;
  std::vector<EncodedProxy> proxies;
  const PreviewStyle style{config.background, config.transparentBackground, threads};
  std::vector<Raster> pictures;
  const auto add = [&](const ProxyImage& image) {
    if (config.previews) {
      const bool layered = image.header.kind == kind::kLayered;
      pictures.push_back(
          preview(image.header.kind, layered ? made.layerPicture : rays, classification, style));
    }
    proxies.push_back(encodeProxy(image));
  };
  if (config.attenuation) {
    add(attenuationImage(customized(config, header), rays.attenuation, rays.transmittance));
  }
  if (config.length) {
    add(lengthImage(header, rays.length, rays.moment, rays.runs, rays.first, rays.last));
  }
  if (config.depth && !classification.isovalues.empty()) {
    auto layered = header;
    layered.isovalues = classification.isovalues;
    add(depthImage(layered, rays.depth, rays.normal));
  }
  if (config.mip) add(mipImage(customized(config, header, true), rays.mip));
  if (config.reference) {
    auto drawn = customized(config, header);
    if (config.phong) drawn.shading = headlightIf(true);
    add(referenceImage(drawn, rays.reference, rays.transmittance));
  }
  if (made.layers) {
    auto lit = customized(config, header);
    lit.shading = shadingOf(config);
    add(layeredImage(lit, *made.layers));
  }
  forEachOnExrThreads(int(pictures.size()), [&](int i) {
    proxies[std::size_t(i)].png = encodePng(pictures[std::size_t(i)]);
  });
  return proxies;
}

}  // namespace

StepMarcher::StepMarcher(const Config& config, std::shared_ptr<gl::Device> device)
    : config_(config), device_(device), marcher_(std::move(device)) {}

std::vector<EncodedProxy> StepMarcher::march(const StepFrame& frame, const StepField& field,
                                             int threads, StepTimes& times) {
  uploaded_.reset();
  customize(frame, threads, times);
  std::vector<EncodedProxy> proxies;
  const auto shadows = marchLight(frame, field, threads, times);
  // A run may want nothing but stacks.
  const bool views = config_.attenuation || config_.length || config_.depth || config_.mip ||
                     config_.reference || config_.layered || config_.training;
  for (const auto& view : views ? frame.views : std::vector<View>{}) {
    const ViewRays rays =
        marchView(frame, field, view, shadows ? &*shadows : nullptr, threads, times);
    const Stopwatch watch;
    auto made =
        pack(config_, headerFor(config_, frame, field, view), rays, field.classification, threads);
    std::move(made.begin(), made.end(), std::back_inserter(proxies));
    times.encode += watch.seconds();
    if (config_.training)
      proxies.push_back(trainingPictures(frame, field, view, rays.rays, threads, times));
  }
  if (config_.sliced) marchStacks(frame, field, threads, times, proxies);
  // Last, so that the archive's first view is one that has pictures.
  if (config_.field) proxies.push_back(reducedField(frame, field, threads, times));
  return proxies;
}

void StepMarcher::customize(const StepFrame& frame, int threads, StepTimes& times) {
  const Box domain = frame.blocks->domain();
  if (!config_.customization || (custom_ && custom_->box == domain)) return;
  const Stopwatch watch;
  try {
    // A GPU leaves the solver's cores alone; a software rasteriser would only be slower on them.
    custom_ = std::make_shared<const CustomVolume>(
        device_->info().isSoftware() ? customVolume(*config_.customization, domain, threads)
                                     : customVolume(*device_, *config_.customization, domain));
  } catch (const Error& error) {
    if (error.code() != ErrorCode::InvalidArgument) throw;
    throw AdaptorError(VESTIGE_ERROR_CONFIG, fmt::format("[customization]: {}", error.what()));
  }
  times.march += watch.seconds();
}

EncodedProxy StepMarcher::trainingPictures(const StepFrame& frame, const StepField& field,
                                           const View& view, const RayImage& reference, int threads,
                                           StepTimes& times) {
  const TrainingConfig& training = *config_.training;
  ProxyHeader header = headerFor(config_, frame, field, view);
  header.looks = trainingLooks(field.classification.base, field.classification.partition,
                               training.pictures, training.scale);
  MarchRequest request = requestFor(frame, field, view);
  request.attenuation = request.length = request.mip = false;
  request.isovalues.clear();
  request.reference = true;
  request.phong = training.light.value_or(config_.phong);
  // Colours are learned for what lengths make of a look, and they know no places.
  request.custom.reset();
  header.shading = headlightIf(request.phong);
  std::vector<RayImage> rays;
  for (const TransferFunction& look : header.looks) {
    request.base = look;
    rays.push_back(config_.reference && rays.empty() && !custom_ && request.phong == config_.phong
                       ? reference
                       : marchRays(frame, field, request, threads, times));
  }
  const Stopwatch watch;
  std::vector<LightPlanes> pictures;
  for (const RayImage& each : rays) pictures.push_back({each.reference, each.transmittance});
  std::optional<Raster> picture;
  if (config_.previews) {
    picture = preview(kind::kReference, rays.front(), field.classification,
                      {config_.background, config_.transparentBackground, threads});
  }
  auto proxy =
      encodeProxy(trainingImage(std::move(header), pictures), picture ? &*picture : nullptr);
  times.encode += watch.seconds();
  return proxy;
}

EncodedProxy StepMarcher::reducedField(const StepFrame& frame, const StepField& field, int threads,
                                       StepTimes& times) const {
  const Stopwatch watch;
  FieldSamples samples = assembleField(field.plan, *frame.blocks, field.statistics, threads);
  const double range = samples.high - samples.low;
  const FieldReduction reduction{
      config_.fieldReduction, config_.fieldAbsoluteError.value_or(config_.fieldTolerance * range)};
  times.ingest += watch.seconds();
  const Stopwatch encoding;
  auto proxy = encodeProxy(fieldImage(headerFor(config_, frame, field, frame.views.front()),
                                      std::move(samples), reduction));
  times.encode += encoding.seconds();
  return proxy;
}

void StepMarcher::upload(const StepFrame& frame, const StepField& field, const BlockPart& part,
                         int threads, StepTimes& times) {
  if (uploaded_ == part) return;
  uploaded_.reset();
  const auto reader = readerOf(field.plan, frame.blocks->at(part.block));
  const SampleRange window = samplesOf(*frame.blocks, part, field.plan.location);
  const auto& partition = field.classification.partition;
  marcher_.upload(
      marchGrid(*frame.blocks, part, field.plan.location),
      [&](int z0, int z1, float* out) {
        fillNormalised(reader, partition.low(), partition.high(), window, z0, z1, out, threads);
      },
      threads);
  uploaded_ = part;
  times.ingest += marcher_.times().fill;
  times.upload += marcher_.times().upload;
}

std::optional<LightDepth> StepMarcher::marchLight(const StepFrame& frame, const StepField& field,
                                                  int threads, StepTimes& times) {
  if (!config_.layered || !config_.layerLight) return std::nullopt;
  LightDepth light(frame.blocks->domain(), *config_.layerLight);
  const auto request = requestFor(frame, field, {"light", light.camera});
  for (const BlockPart& part : marchedParts(frame)) {
    upload(frame, field, part, threads, times);
    marcher_.marchLight(request, light);
    times.march += marcher_.times().march;
  }
  return light;
}

RayImage StepMarcher::marchRays(const StepFrame& frame, const StepField& field,
                                const MarchRequest& request, int threads, StepTimes& times) {
  if (request.camera.projection == Projection::MultiPerspective) {
    const auto parts = marchedParts(frame);
    RaySorter sorter;
    double sorting = 0.0;
    for (const BlockPart& part : parts) {
      upload(frame, field, part, threads, times);
      RayImage rays = marcher_.march(request);
      times.march += marcher_.times().march;
      times.readBack += marcher_.times().readBack;
      if (parts.size() == 1) return rays;
      const Stopwatch watch;
      sorter.add(std::move(rays));
      sorting += watch.seconds();
    }
    const Stopwatch watch;
    RayImage all = sorter.take();
    times.march += sorting + watch.seconds();
    return all;
  }
  const auto parts = partsInOrder(frame, request.camera);
  // Front to back, so that no more than two images are ever held.
  std::optional<RayImage> all;
  for (const BlockPart& part : parts) {
    upload(frame, field, part, threads, times);
    RayImage rays = marcher_.march(request);
    times.march += marcher_.times().march;
    times.readBack += marcher_.times().readBack;
    if (!all) {
      all = std::move(rays);
    } else {
      const Stopwatch watch;
      compositeUnder(*all, rays);
      times.march += watch.seconds();
    }
  }
  return std::move(*all);
}

ViewRays StepMarcher::marchView(const StepFrame& frame, const StepField& field, const View& view,
                                const LightDepth* shadows, int threads, StepTimes& times) {
  const auto request = requestFor(frame, field, view);
  RayImage all = marchRays(frame, field, request, threads, times);
  if (!config_.layered) return {std::move(all), std::nullopt, {}};

  // Once more, now that it is known what is left of each ray (method §2).
  LayerGatherer gatherer(config_.layers, all.transmittance);
  for (const BlockPart& part : partsInOrder(frame, view.camera)) {
    upload(frame, field, part, threads, times);
    const LayerRays rays = marcher_.marchLayers(request, gatherer.request(shadows));
    const Stopwatch watch;
    gatherer.add(rays);
    times.march += marcher_.times().march + watch.seconds();
  }
  RayImage picture;
  picture.size = request.size;
  picture.reference = gatherer.light();
  picture.transmittance = all.transmittance;
  auto planes = gatherer.planes(all.exit);
  return {std::move(all), std::move(planes), std::move(picture)};
}

SlicedStack StepMarcher::marchStack(const StepFrame& frame, const StepField& field,
                                    const StackView& stack, int threads, StepTimes& times) {
  const auto parts = partsInOrder(frame, stack.view.camera);
  MarchRequest request = requestFor(frame, field, stack.view);
  request.size = stack.size;
  ProxyHeader header = headerFor(config_, frame, field, stack.view);
  header.size = stack.size;
  header.slabDepths = stack.depths;
  StackBuilder builder(std::move(header), config_.sliced->levels);

  // One part fills a slab at a time. Several are composited first: sparse, in floats.
  std::vector<SlabRays> slabs(parts.size() > 1 ? stack.depths.size() - 1 : 0);
  double buildSeconds = 0.0;
  const auto build = [&](const SlabRays& rays) {
    const Stopwatch watch;
    builder.add(rays);
    buildSeconds += watch.seconds();
  };
  for (const BlockPart& part : parts) {
    upload(frame, field, part, threads, times);
    marcher_.marchSlabs(request, stack.depths, [&](int s, SlabRays rays) {
      if (slabs.empty()) return build(rays);
      SlabRays& slab = slabs[std::size_t(s)];
      if (slab.cells.empty()) {
        slab = std::move(rays);
      } else {
        compositeSlabs(slab, rays);
      }
    });
    times.march += marcher_.times().march;
    times.readBack += marcher_.times().readBack;
  }
  for (SlabRays& slab : slabs) {
    build(slab);
    slab = {};
  }
  times.encode += buildSeconds;
  return builder.take();
}

void StepMarcher::marchStacks(const StepFrame& frame, const StepField& field, int threads,
                              StepTimes& times, std::vector<EncodedProxy>& proxies) {
  PreviewStyle style{config_.background, config_.transparentBackground, threads};
  const bool own = config_.sliced->stacks != "views";
  for (const StackView& view :
       stackViews(*config_.sliced, config_.size, frame.views, *frame.blocks, field.plan.location)) {
    const SlicedStack stack = marchStack(frame, field, view, threads, times);
    style.pixelAspect = view.view.camera.pixelAspect;
    {
      const Stopwatch watch;
      std::optional<Raster> picture;
      if (config_.previews) picture = preview(stack, field.classification, style);
      proxies.push_back(encodeProxy(stack, picture ? &*picture : nullptr));
      times.encode += watch.seconds();
    }
    if (!own || !config_.reference) continue;
    MarchRequest reference = requestFor(frame, field, view.view);
    reference.size = view.size;
    reference.attenuation = reference.length = reference.mip = false;
    reference.isovalues.clear();
    const RayImage rays = marchRays(frame, field, reference, threads, times);
    const Stopwatch watch;
    std::optional<Raster> picture;
    if (config_.previews) picture = preview(kind::kReference, rays, field.classification, style);
    ProxyHeader header = customized(config_, stack.header);
    if (config_.phong) header.shading = headlightIf(true);
    proxies.push_back(
        encodeProxy(referenceImage(std::move(header), rays.reference, rays.transmittance),
                    picture ? &*picture : nullptr));
    times.encode += watch.seconds();
  }
}

MarchRequest StepMarcher::requestFor(const StepFrame& frame, const StepField& field,
                                     const View& view) const {
  const auto& [partition, base, isovalues] = field.classification;
  const Box domain = frame.blocks->domain();
  return {.camera = view.camera,
          .size = config_.size,
          .partition = partition,
          .base = base,
          .domain = domain,
          .stepLength = stepLengthOf(config_, frame),
          .attenuation = config_.attenuation,
          .length = config_.length,
          .mip = config_.mip,
          // Layers need to know what is left of a ray.
          .reference = config_.reference || (config_.layered && !config_.attenuation),
          .phong = config_.phong,
          .isovalues = config_.depth ? isovalues : std::vector<double>{},
          .custom = custom_};
}

}  // namespace vestige
