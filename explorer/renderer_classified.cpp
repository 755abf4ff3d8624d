// SPDX-License-Identifier: BSD-3-Clause
// Looks with a classifier: fields classified anew.
#include <nlohmann/json.hpp>

#include "explorer/renderer_impl.h"
#include "proxy/error.h"

namespace vestige {
namespace {

/// The transfer function that colours a maximum, whose opacity nobody asks for.
TransferFunction functionOfMaximum(const MaximumLook& maximum, double referenceLength) {
  TransferFunction function = TransferFunction::ramp(maximum.low, maximum.high, referenceLength);
  function.setColormap(maximum.colormap);
  function.setColorRange(maximum.low, maximum.high);
  return function;
}

/// Keys that a picture of classified fields cannot follow.
void refuseOtherKeys(const Look& look) {
  const std::pair<const char*, bool> keys[] = {
      {"opacity", look.opacity.has_value()},       {"factors", !look.factors.empty()},
      {"colormap", !look.colormap.empty()},        {"colorRange", look.colorRange.has_value()},
      {"color", look.color != Coloring::Function}, {"via", look.via != Via::Auto},
      {"order", look.order != Order::Auto},        {"enhance", look.enhance.on}};
  for (const auto& [key, given] : keys) {
    if (!given) continue;
    throw Error(ErrorCode::Config,
                std::string("look key '") + key +
                    "' does not go with a classifier: its features have opacities and colours");
  }
}

}  // namespace

ClassifiedSource& Renderer::Impl::classifiedOf(long cycle, const std::vector<std::string>& fields) {
  if (!classified || !classified->is(cycle, fields)) {
    classified.reset();  // before the next takes its memory
    classified = std::make_unique<ClassifiedSource>(*archive, cycle, fields);
  }
  return *classified;
}

void Renderer::Impl::drawClassified(const Look& look, const Classifier& classifier, long cycle,
                                    ViewData& base, Rendered& out) {
  refuseOtherKeys(look);
  const ProxyHeader& header = base.header();
  const ImageSize viewSize = squarePixels(header.size, header.camera.pixelAspect);
  const ImageSize size = look.size.value_or(viewSize);
  const double referenceLength = look.referenceLength.value_or(
      header.base ? header.base->referenceLength() : header.domain.diagonal() / 100.0);
  out.camera.pixelAspect = 1.0;
  const Camera camera = fittedCamera(out.camera, viewSize, size);
  VolumeView view;
  ClassifiedSource& source = classifiedOf(cycle, classifier.fields());
  const auto resolved = source.resolved(classifier, referenceLength);
  if (const MaximumLook* maximum = resolved->maximum()) {
    view = source.drawMaximum(look, functionOfMaximum(*maximum, referenceLength), camera, size);
  } else {
    resolved->edit(look.features);
    view = source.draw(look, *resolved, referenceLength, camera, size);
  }
  out.picture = std::move(view.picture);
  out.depth = std::move(view.depth);
  if (look.trust) out.trust = trustFromStretch(view.guess, out.picture);
  out.notes.push_back(source.note());
  finish(look, header, viewSize, nullptr, out);
}

}  // namespace vestige
