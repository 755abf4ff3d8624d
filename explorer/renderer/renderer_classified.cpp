// SPDX-License-Identifier: BSD-3-Clause
// Looks with a classifier: features as the run integrated them, or fields classified anew.
#include <nlohmann/json.hpp>

#include "explorer/renderer/renderer_impl.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

/// The transfer function that colours a maximum, whose opacity nobody asks for.
TransferFunction functionOfMaximum(const MaximumLook& maximum, double referenceLength) {
  TransferFunction function = TransferFunction::ramp(maximum.low, maximum.high, referenceLength);
  function.setColormap(maximum.colormap);
  function.setColorRange(maximum.low, maximum.high);
  return function;
}

/// Keys of classified fields and features that have no intervals.
void refuseIntervals(const Look& look) {
  const std::pair<const char*, bool> keys[] = {{"via", look.via != Via::Auto},
                                               {"order", look.order != Order::Auto},
                                               {"enhance", look.enhance.on}};
  for (const auto& [key, given] : keys) {
    if (!given) continue;
    throw Error(ErrorCode::Config, std::string("look key '") + key +
                                       "' is for intervals of one field: this classifier has none");
  }
}

}  // namespace

void refuseOtherClassification(const Look& look) {
  const std::pair<const char*, bool> keys[] = {{"opacity", look.opacity.has_value()},
                                               {"factors", !look.factors.empty()},
                                               {"colormap", !look.colormap.empty()},
                                               {"colorRange", look.colorRange.has_value()},
                                               {"color", look.color != Coloring::Function}};
  for (const auto& [key, given] : keys) {
    if (!given) continue;
    throw Error(ErrorCode::Config,
                std::string("look key '") + key +
                    "' does not go with a classifier: its features have opacities and colours");
  }
}

std::shared_ptr<ClassifiedSource> Renderer::Impl::classifiedOf(
    long cycle, const std::vector<std::string>& fields) {
  if (!classified || !classified->is(cycle, fields)) {
    classified.reset();  // before the next takes its memory
    classified = std::make_shared<ClassifiedSource>(*archive, cycle, fields);
  }
  return classified;
}

std::shared_ptr<FeatureSource> Renderer::Impl::featuresOf(const Look& look,
                                                          const Classifier* classifier,
                                                          long cycle) {
  const auto take = [&](const std::string& name) {
    if (!features || !features->is(cycle, name)) {
      features.reset();
      features = std::make_shared<FeatureSource>(*archive, cycle, name);
    }
    return features;
  };
  const std::vector<std::string> fields = archive->fields();
  const std::string field = look.field.empty() && !fields.empty() ? fields.front() : look.field;
  if (!classifier) return FeatureSource::has(*archive, cycle, field) ? take(field) : nullptr;
  if (look.source != Source::Auto && look.source != Source::Features) return nullptr;
  for (const std::string& name : fields) {
    if (!FeatureSource::has(*archive, cycle, name)) continue;
    std::shared_ptr<FeatureSource> source = take(name);
    const FeatureOrigin& origin = source->origin();
    if (classifier->fields() == origin.classifier->fields() &&
        source->finds(*classifier->resolved(origin.domains, origin.referenceLength))) {
      return source;
    }
  }
  if (look.source != Source::Features) return nullptr;
  throw Error(ErrorCode::NotFound,
              "look key 'source' is features, but cycle " + std::to_string(cycle) +
                  " has none that this classifier finds: centres and widths are those of the run");
}

void Renderer::Impl::drawFeatures(const Look& turnedLook, FeatureSource& source,
                                  const Classifier* classifier, long cycle, Rendered& out) {
  refuseOtherClassification(turnedLook);
  refuseIntervals(turnedLook);
  const std::string name = source.header().field;
  std::string viewName = turnedLook.view;
  for (const std::string& view : archive->views()) {
    if (!viewName.empty()) break;
    if (archive->find(cycle, view, name, kind::kFeatures) ||
        archive->find(cycle, view, name, kind::kSlicedFeatures)) {
      viewName = view;
    }
  }
  std::shared_ptr<ViewData> base = views->get(cycle, viewName, name);
  out.camera = cameraOf(turnedLook, *base);
  const Look look = withoutTurn(turnedLook, cycle, name, base, out.camera, out);
  const ProxyHeader& header = base->header();
  viewName = header.view;
  const bool stored = isStored(look, header, out.camera);
  const FeatureOrigin& origin = source.origin();
  const double referenceLength = look.referenceLength.value_or(origin.referenceLength);
  const auto own = (classifier ? *classifier : *origin.classifier)
                       .resolved(origin.domains, origin.referenceLength);
  own->edit(look.features);
  const ImageSize viewSize = squarePixels(header.size, header.camera.pixelAspect);
  const ImageSize size = look.size.value_or(viewSize);
  Camera camera = out.camera;
  camera.pixelAspect = 1.0;
  FeatureSource::Drawn drawn = source.draw(look, viewName, stored, own->optics(referenceLength),
                                           fittedCamera(camera, viewSize, size), size);
  if (!drawn.stored) castCamera(viewSize, size, out);
  out.picture = std::move(drawn.picture);
  out.depth = std::move(drawn.depth);
  if (look.trust) {
    out.trust =
        drawn.stored ? trustFromDoubt(drawn.doubt) : trustFromDoubt(drawn.doubt, drawn.guess);
  }
  out.answer = Answer::Features;
  out.notes.push_back(std::move(drawn.note));
  finish(look, header, viewSize, nullptr, out, own->features());
}

void Renderer::Impl::drawClassified(const Look& look, const Classifier& classifier, long cycle,
                                    ViewData& base, Rendered& out) {
  refuseOtherClassification(look);
  refuseIntervals(look);
  const ProxyHeader& header = base.header();
  const ImageSize viewSize = squarePixels(header.size, header.camera.pixelAspect);
  const ImageSize size = look.size.value_or(viewSize);
  const double referenceLength = look.referenceLength.value_or(
      header.base ? header.base->referenceLength() : header.domain.diagonal() / 100.0);
  const Camera camera = castCamera(viewSize, size, out);
  VolumeView view;
  std::optional<TransferFunction> function;
  const std::shared_ptr<ClassifiedSource> held = classifiedOf(cycle, classifier.fields());
  ClassifiedSource& source = *held;
  const auto resolved = source.resolved(classifier, referenceLength);
  if (const MaximumLook* maximum = resolved->maximum()) {
    function = functionOfMaximum(*maximum, referenceLength);
    view = source.drawMaximum(look, *function, camera, size);
  } else {
    resolved->edit(look.features);
    view = source.draw(look, *resolved, referenceLength, camera, size);
  }
  out.picture = std::move(view.picture);
  out.depth = std::move(view.depth);
  if (look.trust) {
    out.trust = view.doubt.empty() ? trustFromStretch(view.guess, out.picture)
                                   : trustFromDoubt(view.doubt, view.guess);
  }
  out.answer = Answer::Classified;
  out.notes.push_back(source.note());
  finish(look, header, viewSize, function ? &*function : nullptr, out, resolved->features());
}

}  // namespace vestige
