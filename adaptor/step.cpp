// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/step.h"

#include <algorithm>
#include <optional>

#include "adaptor/adaptor_error.h"
#include "adaptor/preview.h"
#include "adaptor/stopwatch.h"
#include "proxy/exr_threads.h"
#include "proxy/png_file.h"
#include "proxy/proxy_layout.h"

namespace vestige {
namespace {

/// The blocks that own some of the domain.
std::vector<int> marchedBlocks(const StepFrame& frame) {
  std::vector<int> indices;
  for (const auto& [index, block] : frame.blocks->blocks()) {
    if (block.grid.empty()) continue;
    const auto size = frame.blocks->owned(index).size();
    if (size.x > 0.0 && size.y > 0.0 && size.z > 0.0) indices.push_back(index);
  }
  if (indices.empty()) {
    throw AdaptorError(VESTIGE_ERROR_GRID, "no block has a volume: nothing to show");
  }
  return indices;
}

/// The smallest spacing of any block, the same for all of them, so that they sample alike; but no
/// more than kMostSteps along the diagonal, for the sake of grids that are very fine somewhere.
double defaultStep(const StepFrame& frame, const Box& domain) {
  constexpr double kMostSteps = 8192.0;
  return std::max(frame.blocks->smallestSpacing(), domain.diagonal() / kMostSteps);
}

ProxyHeader headerFor(const Config& config, const StepFrame& frame, const StepField& field,
                      const View& view) {
  ProxyHeader header;
  header.field = field.plan.name;
  header.units = field.plan.units;
  header.time = frame.time;
  header.cycle = long(frame.cycle);
  header.view = view.name;
  header.camera = view.camera;
  header.size = config.size;
  header.domain = frame.blocks->domain();
  header.partition = field.classification.partition;
  header.base = field.classification.base;
  header.statistics = field.statistics;
  header.provenance = frame.provenance;
  header.note = config.note;
  header.owner = config.owner;
  return header;
}

std::vector<EncodedProxy> pack(const Config& config, const ProxyHeader& header,
                               const RayImage& rays, const Classification& classification,
                               int threads) {
  std::vector<EncodedProxy> proxies;
  const PreviewStyle style{config.background, config.transparentBackground, threads};
  std::vector<Raster> pictures;
  const auto add = [&](const ProxyImage& image) {
    if (config.previews) {
      pictures.push_back(preview(image.header.kind, rays, classification, style));
    }
    proxies.push_back(encodeProxy(image));
  };
  if (config.attenuation) {
    add(attenuationImage(header, rays.attenuation, rays.transmittance));
  }
  if (config.length) {
    add(lengthImage(header, rays.length, rays.moment, rays.runs, rays.first, rays.last));
  }
  if (config.depth && !classification.isovalues.empty()) {
    auto layered = header;
    layered.isovalues = classification.isovalues;
    add(depthImage(layered, rays.depth, rays.normal));
  }
  if (config.mip) add(mipImage(header, rays.mip));
  if (config.reference) add(referenceImage(header, rays.reference, rays.transmittance));
  forEachOnExrThreads(int(pictures.size()), [&](int i) {
    proxies[std::size_t(i)].png = encodePng(pictures[std::size_t(i)]);
  });
  return proxies;
}

}  // namespace

StepMarcher::StepMarcher(const Config& config, std::shared_ptr<gl::Device> device)
    : config_(config), marcher_(std::move(device)) {}

std::vector<EncodedProxy> StepMarcher::march(const StepFrame& frame, const StepField& field,
                                             int threads, StepTimes& times) {
  uploaded_ = -1;
  std::vector<EncodedProxy> proxies;
  for (const auto& view : frame.views) {
    const RayImage rays = marchView(frame, field, view, threads, times);
    const Stopwatch watch;
    auto made =
        pack(config_, headerFor(config_, frame, field, view), rays, field.classification, threads);
    std::move(made.begin(), made.end(), std::back_inserter(proxies));
    times.encode += watch.seconds();
  }
  return proxies;
}

void StepMarcher::upload(const StepFrame& frame, const StepField& field, int block, int threads,
                         StepTimes& times) {
  if (uploaded_ == block) return;
  uploaded_ = -1;
  const auto reader = readerOf(field.plan, frame.blocks->at(block));
  const auto& partition = field.classification.partition;
  marcher_.upload(
      frame.blocks->marchGrid(block, field.plan.location),
      [&](int z0, int z1, float* out) {
        fillNormalised(reader, partition.low(), partition.high(), z0, z1, out, threads);
      },
      threads);
  uploaded_ = block;
  times.ingest += marcher_.times().fill;
  times.upload += marcher_.times().upload;
}

RayImage StepMarcher::marchView(const StepFrame& frame, const StepField& field, const View& view,
                                int threads, StepTimes& times) {
  const auto indices = marchedBlocks(frame);
  std::vector<Box> boxes;
  for (const int index : indices) boxes.push_back(frame.blocks->owned(index));
  const auto request = requestFor(frame, field, view);

  // Front to back, so that no more than two images are ever held.
  std::optional<RayImage> all;
  for (const auto position : visibilityOrder(boxes, view.camera)) {
    upload(frame, field, indices[std::size_t(position)], threads, times);
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

MarchRequest StepMarcher::requestFor(const StepFrame& frame, const StepField& field,
                                     const View& view) const {
  const auto& [partition, base, isovalues] = field.classification;
  const Box domain = frame.blocks->domain();
  return {.camera = view.camera,
          .size = config_.size,
          .partition = partition,
          .base = base,
          .domain = domain,
          .stepLength = config_.stepLength > 0.0 ? config_.stepLength : defaultStep(frame, domain),
          .attenuation = config_.attenuation,
          .length = config_.length,
          .mip = config_.mip,
          .reference = config_.reference,
          .phong = config_.phong,
          .isovalues = config_.depth ? isovalues : std::vector<double>{}};
}

}  // namespace vestige
