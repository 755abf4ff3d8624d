// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <numbers>

#include "explorer/renderer_impl.h"
#include "proxy/error.h"

namespace vestige {
namespace {

std::string numberOf(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

}  // namespace

ViewData& Renderer::Impl::sourceFor(const Look& look, long cycle, const std::string& field,
                                    ViewData& base, const Camera& target, Rendered& out) {
  if (look.rotate.isZero()) return base;
  ViewData* best = &base;
  double alignment = glm::dot(base.header().camera.forward, target.forward);
  for (const std::string& name : archive->views()) {
    const auto stores = [&](std::string_view proxy) {
      return archive->find(cycle, name, field, proxy) != nullptr;
    };
    const bool layers = stores(kind::kDepth) || stores(kind::kLength);
    if (look.source == Source::Layered ? !stores(kind::kLayered)
                                       : !layers && !stores(kind::kLayered)) {
      continue;
    }
    ViewData& view = views->get(cycle, name, field);
    const double dot = glm::dot(view.header().camera.forward, target.forward);
    if (dot <= alignment + 1e-9) continue;
    alignment = dot;
    best = &view;
  }
  out.notes.push_back(
      "view '" + best->header().view + "' answers: it looks within " +
      numberOf(std::acos(std::clamp(alignment, -1.0, 1.0)) * 180.0 / std::numbers::pi) +
      " degrees of the direction asked for");
  return *best;
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
  if (look.via == Via::Attenuation || (look.via == Via::Auto && !length && attenuation)) {
    out.notes.push_back(
        "attenuation answers: " +
        std::string(length ? "the look asks for it" : "no opacity lengths are stored") +
        "; one global order of nested intervals is assumed, and what was transparent in situ stays "
        "so");
    return Via::Attenuation;
  }
  out.notes.push_back(
      std::string("length answers: any opacity is exact for each interval; order ") +
      (resolvedOrder(look.order, view.header().size) == Order::Mean ? "by mean depth"
                                                                    : "along reconstructed runs"));
  return Via::Length;
}

bool Renderer::Impl::fieldAnswers(const Look& look, long cycle, const std::string& field,
                                  const ViewData& base, const Camera& target) const {
  const bool there = archive->find(cycle, kFieldView, field, kind::kField) != nullptr;
  const auto missing = [&](const std::string& key) {
    throw Error(ErrorCode::NotFound, "look key '" + key + "' needs a stored field, cycle " +
                                         std::to_string(cycle) + " has none of '" + field + "'");
  };
  if (look.source == Source::Field && !there) missing("source");
  if (look.needsGrid()) {
    const char* key = look.clip ? "clip" : "draw";
    if (!there) missing(key);
    if (look.source != Source::Auto && look.source != Source::Field) {
      throw Error(ErrorCode::Config,
                  std::string("look key '") + key + "' needs source auto or field");
    }
    return true;
  }
  if (look.source != Source::Auto || !there) return look.source == Source::Field;
  const bool stored = target == base.header().camera;
  const bool layers = base.has(kind::kDepth) || base.has(kind::kLength);
  const bool baked = base.has(kind::kLayered);
  const bool pictures = layers || baked || base.has(kind::kAttenuation) ||
                        base.has(kind::kReference) || base.has(kind::kMip);
  return stored ? !pictures : !layers && !baked;
}

Renderer::Impl::Stacks Renderer::Impl::stacksAnswer(const Look& look, long cycle,
                                                    const std::string& field, const ViewData& base,
                                                    const Camera& target, Rendered& out) const {
  const bool wanted = look.source == Source::Sliced;
  if (!wanted && look.source != Source::Auto) return Stacks::None;
  if (StackSource::viewsOf(*archive, cycle, field).empty()) {
    if (!wanted) return Stacks::None;
    throw Error(ErrorCode::NotFound, "look key 'source' is sliced, but cycle " +
                                         std::to_string(cycle) + " has no sliced proxy of '" +
                                         field + "'");
  }
  const bool flat = base.has(kind::kLength) || base.has(kind::kAttenuation);
  const bool stored = target == base.header().camera;
  const bool lit = look.shading == Shading::Phong || look.ao.on;
  if (look.needsGrid()) {
    const bool exact = archive->find(cycle, kFieldView, field, kind::kField) != nullptr;
    return wanted || !exact ? Stacks::Grid : Stacks::None;
  }
  if (stored && base.has(kind::kSliced)) {
    // Who asks for a way of recomposing lengths shall have it.
    const bool otherwise = look.via != Via::Auto || look.order != Order::Auto;
    if (!wanted && flat && otherwise) return Stacks::None;
    if (!lit || base.has(kind::kDepth)) return Stacks::Pieces;
  } else if (stored && !wanted) {
    // A view of pictures only cannot be edited; stacks can.
    const bool edited = look.opacity || look.referenceLength || !look.colormap.empty() ||
                        look.colorRange || !look.factors.empty() || lit;
    if (flat || base.has(kind::kDepth) || !edited) return Stacks::None;
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
