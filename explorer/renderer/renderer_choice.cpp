// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "explorer/renderer/renderer_impl.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

std::string numberOf(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

std::string degreesBetween(glm::dvec3 a, glm::dvec3 b) {
  return numberOf(std::acos(std::clamp(glm::dot(a, b), -1.0, 1.0)) * 180.0 / std::numbers::pi);
}

}  // namespace

bool isEdited(const Look& look, const ViewData& view) {
  if (!look.classifier.empty() || look.isCustomized() || look.isLit() || look.ao.on ||
      look.enhance.on) {
    return true;
  }
  if (!look.opacity && !look.referenceLength && look.colormap.empty() && !look.colorRange &&
      look.factors.empty()) {
    return false;
  }
  const ProxyHeader& header = view.header();
  if (!header.base) return true;
  TransferFunction function = functionOf(look, header, view.partition());
  const auto& factors = function.factors();
  if (std::all_of(factors.begin(), factors.end(), [](double factor) { return factor == 1.0; }))
    function.setFactors({});
  return toJson(function) != toJson(*header.base);
}

Camera Renderer::Impl::cameraOf(const Look& look, const ViewData& base) const {
  const ProxyHeader& header = base.header();
  const bool picture = look.color == Coloring::Learned || look.source == Source::Volume ||
                       look.source == Source::Mip || look.source == Source::Reference ||
                       (look.source == Source::Auto && !base.has(kind::kDepth) &&
                        !base.has(kind::kLength) && !base.has(kind::kField));
  const bool asStored = look.rotate.isZero() && !look.needsGrid() && !look.isStretched() && picture;
  const bool distorted = header.camera.projection == Projection::MultiPerspective;
  if (asStored && distorted) {
    if (look.frame == Frame::Fit || look.frame == Frame::Orbit || look.zoom != 1.0 ||
        look.pan != glm::dvec2(0.0) || look.center) {
      throw Error(ErrorCode::Config,
                  "look keys 'frame', 'zoom', 'pan' and 'center' are not for the distorted picture "
                  "that multi-perspective view '" +
                      header.view + "' stores: take source layers, which undistorts it");
    }
    return header.camera;
  }
  const Camera camera =
      asStored ? header.camera : undistorted(header.camera, header.domain, header.size.aspect());
  return framedCamera(look, camera, squarePixels(header.size, header.camera.pixelAspect),
                      header.domain);
}

Look Renderer::Impl::withoutTurn(const Look& look, long cycle, const std::string& field,
                                 std::shared_ptr<ViewData>& base, Camera& target, Rendered& out) {
  if (look.rotate.isZero() || !look.frameFor.empty() || look.isStretched()) return look;
  const ProxyHeader& own = base->header();
  const ImageSize viewSize = squarePixels(own.size, own.camera.pixelAspect);
  const ImageSize size = look.size.value_or(viewSize);
  const glm::dvec3 forward = target.forward;
  const auto at = [&](const std::string& view, const Camera& camera) {
    Look still = look;
    still.rotate = {};
    still.view = view;
    still.size = size;
    target = camera;
    out.notes.push_back("uses view '" + view + "': it looks within " +
                        degreesBetween(forward, target.forward) +
                        " degrees of the direction asked for, which moves nothing by half a pixel");
    return still;
  };
  const auto onto = [&](const Camera& stored) {
    return ontoStored(stored, target, viewSize, size, own.domain);
  };
  if (const auto camera = onto(own.camera)) return at(own.view, *camera);
  for (const ViewSummary& view : *views->summaries(cycle, field)) {
    const auto camera = onto(view.camera);
    if (!camera) continue;
    base = views->get(cycle, view.name, field);
    return at(view.name, *camera);
  }
  return look;
}

bool Renderer::Impl::isStored(const Look& look, const ProxyHeader& header, const Camera& camera) {
  if (camera == header.camera) return true;
  return look.rotate.isZero() && !look.isStretched() &&
         windowOf(header.camera, header.size, camera, header.size).has_value();
}

Camera Renderer::Impl::castCamera(ImageSize viewSize, ImageSize size, Rendered& out) {
  out.camera.pixelAspect = 1.0;
  out.camera = fittedCamera(out.camera, viewSize, size);
  out.cast = true;
  return out.camera;
}

bool Renderer::Impl::ownPictureAnswers(const Look& look, long cycle, const std::string& field,
                                       const ViewData& base, const Camera& target) const {
  if (look.source != Source::Auto || look.color == Coloring::Learned || look.needsGrid() ||
      look.via != Via::Auto || look.order != Order::Auto) {
    return false;
  }
  if (!isStored(look, base.header(), target) || !base.has(kind::kReference) ||
      base.isCustomized(kind::kReference) || isEdited(look, base)) {
    return false;
  }
  // A field is sharper where more pixels are asked for than the run drew.
  const ImageSize stored = squarePixels(base.header().size, base.header().camera.pixelAspect);
  const bool larger =
      target != base.header().camera ||
      (look.size && look.size->width > stored.width && look.size->height > stored.height);
  return !larger || !archive->find(cycle, kFieldView, field, kind::kField);
}

std::shared_ptr<ViewData> Renderer::Impl::sourceFor(const Look& look, long cycle,
                                                    const std::string& field,
                                                    const std::shared_ptr<ViewData>& base,
                                                    const Camera& target, Rendered& out) {
  if (look.rotate.isZero()) return base;
  const auto answers = [&](const ViewSummary& view) {
    const bool distorted = view.camera.projection == Projection::MultiPerspective;
    return look.source == Source::Layered   ? view.layered
           : look.source == Source::Virtual ? view.length && distorted
                                            : view.depth || view.length || view.layered;
  };
  const auto summaries = views->summaries(cycle, field);
  const ViewSummary* best = nullptr;
  double alignment = -2.0;
  for (const ViewSummary& view : *summaries) {
    if (!answers(view)) continue;
    const double dot = glm::dot(view.camera.forward, target.forward);
    // Of views that look the same way the look's own.
    const bool own = view.name == base->header().view;
    if (best && dot <= alignment + (own ? -1e-9 : 1e-9)) continue;
    alignment = dot;
    best = &view;
  }
  if (!best) return base;
  out.notes.push_back("uses view '" + best->name + "': it looks within " +
                      degreesBetween(best->camera.forward, target.forward) +
                      " degrees of the direction asked for");
  return best->name == base->header().view ? base : views->get(cycle, best->name, field);
}

Via Renderer::Impl::viaOf(const Look& look, ViewData& view, Rendered& out) const {
  const bool length = view.has(kind::kLength), attenuation = view.has(kind::kAttenuation);
  if (look.via == Via::Length && !length) {
    throw Error(ErrorCode::NotFound,
                "look key 'via' asks for lengths, view '" + view.header().view + "' stores none");
  }
  if (look.via == Via::Attenuation && !attenuation) {
    throw Error(ErrorCode::NotFound, "look key 'via' asks for attenuation, view '" +
                                         view.header().view + "' stores none");
  }
  if (attenuation && !(look.via == Via::Length) && view.isCustomized(kind::kAttenuation)) {
    if (look.via == Via::Attenuation || !length) {
      throw Error(ErrorCode::NotFound, "the run customised the attenuation of view '" +
                                           view.header().view +
                                           "' by position, which its intervals do not know: " +
                                           (length ? "take lengths" : "no lengths are stored") +
                                           ", or the run's own picture (source reference)");
    }
    out.notes.push_back(
        "the run customised its own pictures and the attenuation by position; lengths are free of "
        "that, and so is this picture");
  }
  if (look.via == Via::Attenuation || (look.via == Via::Auto && !length && attenuation)) {
    out.notes.push_back(
        "uses attenuation: " +
        std::string(length ? "the look asks for it" : "no opacity lengths are stored") +
        "; one global order of nested intervals is assumed, and what was transparent in situ stays "
        "so");
    return Via::Attenuation;
  }
  out.notes.push_back(std::string("uses length: any opacity is exact for each interval; order ") +
                      (resolvedOrder(look.order, view.header().size) == Order::Mean
                           ? "by mean depth"
                           : "along reconstructed runs"));
  return Via::Length;
}

std::optional<StatedError> Renderer::Impl::errorOf(std::string_view proxy, long cycle,
                                                   const std::string& view,
                                                   const std::string& field,
                                                   const Asked& asked) const {
  const ArchiveRow* row = archive->find(cycle, view, field, proxy);
  if (!row) return std::nullopt;
  return statedError(archive->open(*row).header(), asked);
}

/// What would answer without a field: of the view's own proxies the one that draw() takes, or the
/// stack.
std::optional<Renderer::Impl::Candidate> Renderer::Impl::otherThanField(
    const Look& look, long cycle, const std::string& field, const ViewData& base, Stacks sliced,
    const Asked& asked) const {
  const std::string& view = base.header().view;
  if (sliced != Stacks::None) {
    const bool own = base.has(kind::kSliced);
    const std::string from = own ? view : StackSource::viewsOf(*archive, cycle, field).front();
    return Candidate{kind::kSliced, *errorOf(kind::kSliced, cycle, from, field, asked)};
  }
  if (look.needsGrid()) return std::nullopt;
  for (const std::string_view proxy : {kind::kLength, kind::kAttenuation, kind::kDepth,
                                       kind::kReference, kind::kLayered, kind::kMip}) {
    const bool picture = proxy == kind::kReference || proxy == kind::kMip;
    if (asked.turned && (picture || proxy == kind::kAttenuation)) continue;
    if (proxy == kind::kAttenuation && base.isCustomized(proxy)) continue;
    if (const auto error = errorOf(proxy, cycle, view, field, asked))
      return Candidate{proxy, *error};
  }
  return std::nullopt;
}

bool Renderer::Impl::fieldAnswers(const Look& look, long cycle, const std::string& field,
                                  const ViewData& base, const Camera& target, Stacks sliced,
                                  std::string& stated) const {
  const bool there = archive->find(cycle, kFieldView, field, kind::kField) != nullptr;
  const auto missing = [&](const std::string& key) {
    const bool one = key == "source";  // which names the field
    throw Error(ErrorCode::NotFound,
                "look key '" + key + "' needs a stored field" + (one ? "" : " or stacks") +
                    ", cycle " + std::to_string(cycle) + " has none of '" + field +
                    "': a run stores " +
                    (one ? "it with \"field\"" : "them with \"field\" or \"sliced\"") +
                    " among its [image] proxies");
  };
  const bool grid = look.needsGrid();
  const char* key = look.clip ? "clip" : "draw";
  if (look.source == Source::Field) {
    if (!there) missing("source");
    return true;
  }
  if (grid && look.source != Source::Auto && look.source != Source::Sliced) {
    throw Error(ErrorCode::Config,
                std::string("look key '") + key + "' needs source auto, field or sliced");
  }
  if (look.source != Source::Auto) return false;
  if (target.projection == Projection::MultiPerspective) return false;  // as stored, or not at all
  const Asked asked{!isStored(look, base.header(), target), isEdited(look, base)};
  const auto other = otherThanField(look, cycle, field, base, sliced, asked);
  if (grid && !there && !other) missing(key);
  if (!other) return there;
  stated = std::string(other->proxy) + " states: " + other->error.text();
  const auto stored = StackSource::viewsOf(*archive, cycle, field);
  if (sliced == Stacks::None && !stored.empty()) {
    const StatedError ofStacks = *errorOf(kind::kSliced, cycle, stored.front(), field, asked);
    stated += "; stacks of other views, as a grid (source sliced), state: " + ofStacks.text();
  }
  // The run's own picture of its own look, which nothing else makes to the last bit.
  const auto picture = errorOf(kind::kReference, cycle, base.header().view, field, asked);
  if (picture && picture->sum() == 0.0 && other->proxy != kind::kReference) {
    stated += base.isCustomized(kind::kReference)
                  ? "; the run's own picture (source reference) is customised by position"
                  : "; the run's own picture (source reference) is exact";
  }
  if (!there) return false;
  const StatedError own = *errorOf(kind::kField, cycle, kFieldView, field, asked);
  stated = "field states: " + own.text() + "; " + stated;
  // The view's own proxies know no places but those of layers.
  if (look.isCustomized() && sliced == Stacks::None) return true;
  if (!own.truerThan(other->error)) return false;
  // Who asks for what only other proxies can do shall have it, and hear what is truer.
  const char* only = look.enhance.on             ? "enhance"
                     : look.via != Via::Auto     ? "via"
                     : look.order != Order::Auto ? "order"
                                                 : nullptr;
  if (!only) return true;
  stated += std::string("; look key '") + only + "' is not for the field, which is truer";
  return false;
}

Renderer::Impl::Stacks Renderer::Impl::stacksAnswer(const Look& look, long cycle,
                                                    const std::string& field, const ViewData& base,
                                                    const Camera& target, Rendered& out) const {
  if (target.projection == Projection::MultiPerspective) return Stacks::None;
  const bool wanted = look.source == Source::Sliced;
  if (!wanted && look.source != Source::Auto) return Stacks::None;
  if (StackSource::viewsOf(*archive, cycle, field).empty()) {
    if (!wanted) return Stacks::None;
    throw Error(ErrorCode::NotFound, "look key 'source' is sliced, but cycle " +
                                         std::to_string(cycle) + " has no sliced proxy of '" +
                                         field + "'");
  }
  const bool flat = base.recomposes();
  const bool stored = isStored(look, base.header(), target);
  const bool lit = look.isLit() || look.ao.on;
  if (look.needsGrid() || look.isCustomized()) return Stacks::Grid;
  if (stored && base.has(kind::kSliced)) {
    // Who asks for a way of recomposing lengths shall have it.
    const bool otherwise = look.via != Via::Auto || look.order != Order::Auto;
    if (!wanted && flat && otherwise) return Stacks::None;
    if (!lit || base.has(kind::kDepth)) return Stacks::Segments;
  } else if (stored && !wanted) {
    // A view of pictures only cannot be edited; stacks can.
    if (flat || base.has(kind::kDepth) || !isEdited(look, base)) return Stacks::None;
  }
  if (look.enhance.on) {
    if (!wanted && (flat || base.has(kind::kDepth))) return Stacks::None;
    throw Error(ErrorCode::Config,
                "look key 'enhance' needs the stored view of a stack, neither rotated nor lit by "
                "its own grid");
  }
  if (stored && lit && base.has(kind::kSliced)) {
    out.notes.push_back("no depth layers are stored: the stack is lit by gradients of its grid");
  }
  return Stacks::Grid;
}

}  // namespace vestige
