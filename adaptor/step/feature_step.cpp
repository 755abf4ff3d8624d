// SPDX-License-Identifier: BSD-3-Clause
#include "adaptor/step/feature_step.h"

#include <limits>
#include <optional>
#include <utility>

#include "adaptor/common/stopwatch.h"
#include "adaptor/compositing/ray_sorter.h"
#include "adaptor/step/preview.h"

namespace vestige {

/// What all views of a classifier in a step have in common.
struct FeatureStep::Job {
  const StepFrame& frame;
  const StepClassifier& classifier;
  std::unique_ptr<Classifier> normalised;
  std::vector<ChannelOptics> optics;
  double stepLength;
  int threads;
  StepTimes& times;

  FeatureRequest request(const View& view, ImageSize size) const {
    return {view.camera, size, frame.blocks->domain(), stepLength, normalised.get(), optics};
  }
  ProxyHeader header(const Config& config, const View& view) const {
    ProxyHeader header = commonHeader(config, frame, view);
    header.field = classifier.plan.config.name;
    header.features = classifier.origin;
    return header;
  }
};

FeatureStep::FeatureStep(const Config& config, std::shared_ptr<gl::Device> device)
    : config_(config), marcher_(std::move(device)) {}

void FeatureStep::upload(const Job& job, const BlockPart& part) {
  if (uploaded_ == part) return;
  uploaded_.reset();
  const auto& [plan, origin] = job.classifier;
  const Block& from = job.frame.blocks->at(part.block);
  struct Source {
    FieldReader reader;
    double low, high;
    double most = kFarBeyondRange;
  };
  std::vector<Source> sources;
  std::vector<double> ranges;
  for (std::size_t f = 0; f < plan.fields.size(); ++f) {
    const FieldDomain& domain = origin.domains[f];
    sources.push_back({readerOf(plan.fields[f], from), domain.low, domain.high});
    ranges.push_back(domain.range());
  }
  if (job.normalised->needsGradient()) {
    sources.push_back({gradientReaderOf(plan.fields, std::move(ranges), from), 0.0, 1.0,
                       double(std::numeric_limits<float>::max())});
  }
  const Location location = plan.fields.front().location;
  const SampleRange window = samplesOf(*job.frame.blocks, part, location);
  std::vector<FillSlab> fills;
  for (const Source& source : sources) {
    fills.push_back([&source, &window, threads = job.threads](int z0, int z1, float* out) {
      fillNormalised(source.reader, source.low, source.high, window, z0, z1, out, threads,
                     source.most);
    });
  }
  marcher_.upload(marchGrid(*job.frame.blocks, part, location), fills, job.threads);
  uploaded_ = part;
  job.times.ingest += marcher_.times().fill;
  job.times.upload += marcher_.times().upload;
}

EncodedProxy FeatureStep::flat(const Job& job, const View& view) {
  const FeatureRequest request = job.request(view, config_.size);
  const bool distorted = view.camera.projection == Projection::MultiPerspective;
  std::optional<RayImage> all;
  RaySorter sorter;
  for (const BlockPart& part :
       distorted ? marchedParts(job.frame) : partsInOrder(job.frame, view.camera)) {
    upload(job, part);
    RayImage rays = marcher_.march(request);
    job.times.march += marcher_.times().march;
    job.times.readBack += marcher_.times().readBack;
    const Stopwatch watch;
    if (distorted) {
      sorter.add(std::move(rays));
    } else if (all) {
      compositeUnder(*all, rays);
    } else {
      all = std::move(rays);
    }
    job.times.march += watch.seconds();
  }
  const Stopwatch watch;
  if (distorted) all = sorter.take();
  const ProxyImage image = featureProxy(job.header(config_, view), all->attenuation,
                                        all->transmittance, all->length, all->moment);
  std::optional<Raster> picture;
  if (config_.previews) {
    picture = preview(featureImage(image),
                      {config_.background, config_.transparentBackground, job.threads});
  }
  EncodedProxy proxy = encodeProxy(image, picture ? &*picture : nullptr);
  job.times.encode += watch.seconds();
  return proxy;
}

EncodedProxy FeatureStep::sliced(const Job& job, const StackView& stack) {
  const FeatureRequest request = job.request(stack.view, stack.size);
  FeatureStack made{job.header(config_, stack.view), {}};
  made.header.size = stack.size;
  made.header.slabDepths = stack.depths;
  for (const BlockPart& part : marchedParts(job.frame)) {
    upload(job, part);
    auto slabs = marcher_.marchSlabs(request, stack.depths);
    job.times.march += marcher_.times().march;
    job.times.readBack += marcher_.times().readBack;
    const Stopwatch watch;
    if (made.slabs.empty()) {
      made.slabs = std::move(slabs);
      continue;
    }
    for (std::size_t s = 0; s < slabs.size(); ++s)
      for (std::size_t i = 0; i < slabs[s].size(); ++i) made.slabs[s][i] += slabs[s][i];
    job.times.march += watch.seconds();
  }
  const Stopwatch watch;
  std::optional<Raster> picture;
  if (config_.previews) {
    picture = preview(made, {config_.background, config_.transparentBackground, job.threads,
                             stack.view.camera.pixelAspect});
  }
  EncodedProxy proxy = encodeProxy(made, picture ? &*picture : nullptr);
  job.times.encode += watch.seconds();
  return proxy;
}

std::vector<EncodedProxy> FeatureStep::march(const StepFrame& frame,
                                             const StepClassifier& classifier, int threads,
                                             StepTimes& times) {
  uploaded_.reset();
  const FeatureOrigin& origin = classifier.origin;
  const Job job{frame,
                classifier,
                origin.classifier->normalised(origin.domains),
                origin.classifier->optics(origin.referenceLength),
                stepLengthOf(config_, frame),
                threads,
                times};
  std::vector<EncodedProxy> proxies;
  if (config_.features) {
    for (const View& view : frame.views) proxies.push_back(flat(job, view));
  }
  if (config_.slicedFeatures) {
    for (const StackView& stack :
         stackViews(*config_.slicedFeatures, config_.size, frame.views, *frame.blocks,
                    classifier.plan.fields.front().location)) {
      proxies.push_back(sliced(job, stack));
    }
  }
  return proxies;
}

}  // namespace vestige
