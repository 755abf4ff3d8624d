// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>

#include "explorer/renderer/renderer_impl.h"
#include "explorer/stacks/stack_segments.h"
#include "proxy/base/error.h"

namespace vestige {
namespace {

Picture mipPicture(const ProxyImage& image, const TransferFunction& function) {
  const Channel& channel = image.channel("mip", "value");
  const ProxyPart& part = image.part("mip");
  Picture picture = Picture::blank(image.header.size);
  for (std::size_t i = 0; i < channel.values.size(); ++i) {
    if (!std::isfinite(channel.values[i])) continue;
    const glm::dvec3 color = function.color(double(channel.values[i]) * part.unit + part.zero);
    for (int c = 0; c < 3; ++c) picture.rgba[4 * i + std::size_t(c)] = float(color[c]);
    picture.rgba[4 * i + 3] = 1.0f;
  }
  return picture;
}

void noteCustomized(const ViewData& view, std::string_view proxy, Rendered& out) {
  if (!view.isCustomized(proxy)) return;
  out.notes.push_back(
      "the run customised it by position: opacity, gamma or colour depend on the place");
}

}  // namespace

Picture referencePicture(const ProxyImage& image) {
  Picture picture = Picture::blank(image.header.size);
  const std::array<const char*, 4> names{"R", "G", "B", "A"};
  for (std::size_t c = 0; c < 4; ++c) {
    const Channel& channel = image.channel("reference", names[c]);
    for (std::size_t i = 0; i < channel.values.size(); ++i) {
      picture.rgba[4 * i + c] = channel.values[i];
    }
  }
  return picture;
}

ChannelTable Renderer::Impl::tableOf(Via via, ViewData& view,
                                     const TransferFunction& function) const {
  const IntervalPartition& partition = *view.partition();
  const IntervalLook look = function.onIntervals(partition);
  if (via == Via::Length) return tableForLength(look);
  if (!view.header().base) {
    throw Error(ErrorCode::Format,
                "the attenuation proxy does not say under which transfer function it was made");
  }
  return tableForAttenuation(look, view.header().base->onIntervals(partition));
}

std::shared_ptr<const CustomTextures> Renderer::Impl::customOf(const Look& look,
                                                               const ProxyHeader& header,
                                                               Rendered& out) {
  if (!look.isCustomized()) return nullptr;
  if (!custom || !custom->is(*look.customization, header.domain))
    custom = std::make_shared<CustomTextures>(*look.customization, header.domain);
  if (custom->hasValues()) {
    out.notes.push_back(
        "customisation: values are baked into layers, so gamma and functions have no part; factors "
        "of opacity and shifts of colour do");
  }
  return custom;
}

std::optional<gl::Texture> Renderer::Impl::lightOf(const Look& look, ViewData& view,
                                                   const Rendered& out) {
  if (!look.isLit() && !look.ao.on) return std::nullopt;
  const ProxyHeader& header = view.header();
  return layer->light(view.layers(), lightSetup(look, header.camera, out.camera, header.domain));
}

void Renderer::Impl::drawVolume(const Look& look, ViewData& view, const TransferFunction& function,
                                Via via, Rendered& out) {
  out.answer = via == Via::Length ? Answer::Lengths : Answer::Attenuation;
  const SegmentTextures& segments = view.segments(via, look.order);
  const ChannelTable table = tableOf(via, view, function);
  EditExtras extras;
  std::optional<gl::Texture> enhancement;
  const std::optional<gl::Texture> light = lightOf(look, view, out);
  if (light) {
    extras.light = &*light;
    extras.layerOf = &view.layerOf();
    out.notes.push_back(view.has(kind::kDepth)
                            ? "each interval is lit by the normals of its own depth layer"
                            : "no depth layers are stored: normals are derived from mean depths");
  }
  if (look.enhance.on) {
    enhancement = edit->enhancement(segments, table, look.enhance.lambda, look.enhance.gamma);
    extras.enhancement = &*enhancement;
  }
  out.picture = edit->render(segments, table, extras);
  if (look.trust) out.trust = trustFromDoubt(edit->doubt(segments, table));
}

void Renderer::Impl::drawLearned(const Look& look, ViewData& view, const TransferFunction& function,
                                 Rendered& out) {
  const ProxyHeader& source = view.header();
  if (!view.has(kind::kLearned)) {
    throw Error(ErrorCode::NotFound, "look key 'color' is learned, but cycle " +
                                         std::to_string(source.cycle) + ", view '" + source.view +
                                         "', field '" + source.field +
                                         "' has no table of learned colours: see "
                                         "vestige-explorer train");
  }
  const ProxyImage image = view.image(kind::kLearned);
  const LearnedTable table = learnedTable(image);
  const ProxyHeader& header = image.header;
  if (!view.partition() || *view.partition() != *header.partition ||
      header.learned->size != source.size || header.camera != source.camera) {
    throw Error(ErrorCode::Format,
                "the table of learned colours is of other intervals, another "
                "size or another camera than view '" +
                    source.view + "': train again");
  }
  const gl::Texture attenuation = attenuationFrom(*edit, view, header.learned->from, function);
  std::optional<gl::Texture> enhancement;
  if (look.enhance.on) {
    enhancement = edit->enhancement(attenuation, source.size, table.channels, look.enhance.lambda,
                                    look.enhance.gamma);
  }
  out.picture =
      learned->render(attenuation, source.size, table, enhancement ? &*enhancement : nullptr);
  out.answer = Answer::Learned;
  out.notes.push_back("uses learned: " + learnedNote(header));
  // A model's word is not what is stored.
  if (look.trust) {
    out.trust = trustFromStretch(std::vector<float>(source.size.pixels(), 1.0f), out.picture);
  }
}

void Renderer::Impl::drawLayers(const Look& look, ViewData& view, const TransferFunction& function,
                                Rendered& out) {
  const ProxyHeader& header = view.header();
  const LayerTextures& layers = view.layers();
  const gl::Texture colors = gpu::textureArray(GL_RGBA32F, layers.size, layers.count);
  out.answer = view.recomposes() ? Answer::Layers : Answer::PlainLayers;
  if (view.recomposes()) {
    const Via via = viaOf(look, view, out);
    const ChannelTable table = tableOf(via, view, function);
    const SegmentTextures& segments = view.segments(via, look.order);
    std::optional<gl::Texture> enhancement;
    if (look.enhance.on) {
      enhancement = edit->enhancement(segments, table, look.enhance.lambda, look.enhance.gamma);
    }
    for (int m = 0; m < layers.count; ++m) {
      EditExtras extras;
      extras.layerOf = &view.layerOf();
      extras.oneLayer = m;
      if (enhancement) extras.enhancement = &*enhancement;
      edit->draw(segments, table, extras, colors, m);
    }
    out.notes.push_back("depth layers are warped; each carries the opacity of its intervals");
  } else {
    for (int m = 0; m < layers.count; ++m) {
      const double value = view.isovalues()[std::size_t(m)];
      const float alpha = float(function.opacity(value));
      const glm::vec3 color(function.color(value));
      std::vector<float> flat(4 * layers.size.pixels());
      for (std::size_t i = 0; i < flat.size(); i += 4) {
        for (int c = 0; c < 3; ++c) flat[i + std::size_t(c)] = alpha * color[c];
        flat[i + 3] = alpha;
      }
      gpu::uploadLayer(colors, layers.size, m, GL_RGBA, GL_FLOAT, flat.data());
    }
    out.notes.push_back(
        "depth layers are warped; without lengths or attenuation each has the opacity of its "
        "value");
  }
  std::optional<gl::Texture> light;
  if (look.isLit() || look.ao.on) {
    light = layer->light(layers, lightSetup(look, header.camera, out.camera, header.domain));
  }
  const std::shared_ptr<const CustomTextures> customizing = customOf(look, header, out);
  std::optional<gl::Texture> customized;
  if (customizing) customized = layer->customized(layers, colors, *customizing);
  const ImageSize size = look.size.value_or(layers.size);
  WarpedView warped = layer->warp(layers, customized ? *customized : colors,
                                  light ? &*light : nullptr, castCamera(layers.size, size, out),
                                  size, look.trust, Stretch(look.scale, header.domain));
  out.picture = std::move(warped.picture);
  out.depth = std::move(warped.depth);
  if (look.trust) out.trust = trustFromStretch(warped.guess, out.picture);
}

void Renderer::Impl::drawLayered(const Look& look, ViewData& view, Rendered& out) {
  const AnalyticLayerTextures& layers = view.layered();
  const ImageSize size = look.size.value_or(layers.size);
  const ProxyHeader& header = view.header();
  const bool stored = out.camera == header.camera;
  const std::shared_ptr<const CustomTextures> customizing = customOf(look, header, out);
  AnalyticLayerView drawn =
      layered->render(layers, castCamera(layers.size, size, out), size, look.trust,
                      customizing.get(), Stretch(look.scale, header.domain));
  out.picture = std::move(drawn.picture);
  out.answer = Answer::Layered;
  out.notes.push_back("uses layered: " + std::to_string(layers.layers) +
                      " piecewise-analytic layers; opacity, colour and light (" + layers.shading +
                      ") are baked in");
  noteCustomized(view, kind::kLayered, out);
  if (!look.trust) return;
  if (stored) {
    out.trust.assign(size.pixels(), Trust::Data);
  } else {
    out.trust = trustFromStretch(drawn.guess, out.picture);
  }
}

void Renderer::Impl::drawVirtual(const Look& look, ViewData& view, const TransferFunction& function,
                                 Rendered& out) {
  const char* const other = look.isLit()                   ? "shading"
                            : look.ao.on                   ? "ao"
                            : look.enhance.on              ? "enhance"
                            : look.via == Via::Attenuation ? "via"
                                                           : nullptr;
  if (other) {
    throw Error(ErrorCode::Config, std::string("look key '") + other +
                                       "' is not for source virtual, which recomposes lengths "
                                       "without light: take layers");
  }
  if (!view.has(kind::kLength)) {
    throw Error(ErrorCode::NotFound, "look key 'source' is virtual, but view '" +
                                         view.header().view + "' stores no lengths");
  }
  const ImageSize size = look.size.value_or(view.header().size);
  VirtualView drawn = virtualRays->render(view.sheets(), tableOf(Via::Length, view, function),
                                          castCamera(view.header().size, size, out), size,
                                          VirtualPass::Lookup::Distorted,
                                          Stretch(look.scale, view.header().domain));
  out.picture = std::move(drawn.picture);
  out.depth = std::move(drawn.depth);
  if (look.trust) out.trust = trustFromStretch(drawn.guess, out.picture);
  out.answer = Answer::Virtual;
  out.notes.push_back(
      "uses virtual: rays are cast through the multi-perspective view '" + view.header().view +
      "'; each interval is added, once a ray, where it starts in the pixel that saw it");
}

void Renderer::Impl::drawField(const Look& look, ViewData& stored, ImageSize viewSize,
                               Rendered& out) {
  const ProxyHeader& header = stored.header();
  const IntervalPartition* partition = stored.partition();
  const ImageSize size = look.size.value_or(viewSize);
  FieldSource& source = stored.field();
  VolumeView view =
      source.draw(look, functionOf(look, header, partition), castCamera(viewSize, size, out), size);
  out.picture = std::move(view.picture);
  out.depth = std::move(view.depth);
  if (look.trust) {
    out.trust = view.doubt.empty() ? trustFromStretch(view.guess, out.picture)
                                   : trustFromDoubt(view.doubt, view.guess);
  }
  out.answer = Answer::Grid;
  out.notes.push_back(source.note());
}

std::shared_ptr<StackSource> Renderer::Impl::stacksOf(long cycle, const std::string& field) {
  if (!stacks || !stacks->is(cycle, field)) {
    stacks.reset();  // before the next takes its memory
    stacks = std::make_shared<StackSource>(*archive, cycle, field);
  }
  return stacks;
}

void Renderer::Impl::drawStackSegments(const Look& look, ViewData& view,
                                       const TransferFunction& function, Rendered& out) {
  const SlicedStack& stack = view.stack();
  const FineChannels channels(*stack.header.partition);
  const SegmentTextures& segments = view.stackSegments(channels.parts(), Uncertain::Likely);
  const ChannelTable table = channels.table(function);
  out.answer = Answer::Stack;
  out.notes.push_back("uses sliced: " + errorOfStack(stack.header, stack.levels));
  EditExtras extras;
  std::vector<int> layerOf;
  const std::optional<gl::Texture> light = lightOf(look, view, out);
  if (light) {
    for (int k = 0; k < channels.count(); ++k) {
      const auto parent = std::size_t(channels.parent(k));
      layerOf.push_back(parent < view.layerOf().size() ? view.layerOf()[parent] : -1);
    }
    extras.light = &*light;
    extras.layerOf = &layerOf;
    out.notes.push_back("each interval is lit by the normals of its own depth layer");
  }
  std::optional<gl::Texture> enhancement;
  if (look.enhance.on) {
    const FineChannels whole(*stack.header.partition, 1);
    enhancement = edit->enhancement(view.stackSegments(1, Uncertain::Likely), whole.table(function),
                                    look.enhance.lambda, look.enhance.gamma);
    extras.enhancement = &*enhancement;
  }
  out.picture = edit->render(segments, table, extras);
  if (!look.trust) return;
  // What hangs on an order that is not stored changes when it is turned round.
  const Picture other =
      edit->render(view.stackSegments(channels.parts(), Uncertain::Reversed), table, extras);
  std::vector<float> doubt(out.picture.size.pixels(), 0.0f);
  raiseDoubt(doubt, out.picture, other);
  out.trust = trustFromDoubt(doubt);
}

void Renderer::Impl::drawStackGrid(const Look& look, StackSource& source,
                                   const TransferFunction& function, ImageSize viewSize,
                                   Rendered& out) {
  const ImageSize size = look.size.value_or(viewSize);
  VolumeView view = source.draw(look, function, castCamera(viewSize, size, out), size);
  out.picture = std::move(view.picture);
  out.depth = std::move(view.depth);
  if (look.trust) out.trust = trustFromDoubt(view.doubt, view.guess);
  out.answer = Answer::Grid;
  out.notes.push_back(source.note(out.camera));
}

void Renderer::Impl::draw(const Look& look, ViewData& view, const TransferFunction& function,
                          Rendered& out) {
  // Who asks for what customised attenuation cannot do hears why.
  const bool volume =
      view.recomposes() || (view.has(kind::kAttenuation) &&
                            (look.source == Source::Volume || look.via == Via::Attenuation));
  const bool layers = view.has(kind::kDepth) || view.has(kind::kLength);
  const bool stored = isStored(look, view.header(), out.camera);
  Source source = look.source;
  if (source == Source::Auto) {
    const bool onlyLayered = view.has(kind::kLayered) && !layers;
    // Where depth is stored, undistorted layers are truer. Virtual rays have no surfaces to be lit.
    const bool rays = view.header().camera.projection == Projection::MultiPerspective &&
                      view.has(kind::kLength) && !view.has(kind::kDepth) &&
                      look.via != Via::Attenuation && !look.isLit() && !look.ao.on &&
                      !look.enhance.on;
    const bool places = look.isCustomized() && (layers || onlyLayered);
    source = places                       ? layers ? Source::Layers : Source::Layered
             : !stored                    ? onlyLayered ? Source::Layered
                                            : rays      ? Source::Virtual
                                                        : Source::Layers
             : volume                     ? Source::Volume
             : layers                     ? Source::Layers
             : view.has(kind::kReference) ? Source::Reference
             : onlyLayered                ? Source::Layered
                                          : Source::Mip;
  }
  if (look.isCustomized() && source != Source::Layers && source != Source::Layered) {
    throw Error(ErrorCode::Config,
                "look key 'customization' needs a source whose samples have places: field, sliced, "
                "layered or layers; view '" +
                    view.header().view + "' would be answered by another");
  }
  if (!stored && source != Source::Layers && source != Source::Layered &&
      source != Source::Virtual) {
    throw Error(ErrorCode::Config,
                std::string("look key 'source' must be auto, field, sliced, layers, layered or "
                            "virtual for a ") +
                    (look.isStretched() && look.rotate.isZero() ? "stretched" : "rotated") +
                    " view: only these can be seen from elsewhere");
  }
  if ((source == Source::Volume && !volume) || (source == Source::Layers && !layers)) {
    throw Error(ErrorCode::NotFound,
                "view '" + view.header().view + "' stores no " +
                    (source == Source::Volume ? "lengths or attenuation to recompose"
                                              : "depth layers or lengths to warp"));
  }
  switch (source) {
    case Source::Volume:
      drawVolume(look, view, function, viaOf(look, view, out), out);
      return;
    case Source::Layers:
      drawLayers(look, view, function, out);
      return;
    case Source::Virtual:
      drawVirtual(look, view, function, out);
      return;
    case Source::Layered:
      drawLayered(look, view, out);
      return;
    case Source::Mip:
      out.picture = mipPicture(view.image(kind::kMip), function);
      out.answer = Answer::Mip;
      out.notes.push_back("uses mip: the largest value along each ray, opacity plays no part");
      noteCustomized(view, kind::kMip, out);
      return;
    default:
      drawReference(view, out);
      return;
  }
}

void Renderer::Impl::drawReference(const ViewData& view, Rendered& out) {
  const ProxyImage image = view.image(kind::kReference);
  out.answer = Answer::Reference;
  out.picture = referencePicture(image);
  out.camera.pixelAspect = image.header.camera.pixelAspect;
  out.notes.push_back("uses reference: the run's own rendering; opacity and colour are baked in");
  noteCustomized(view, kind::kReference, out);
}

}  // namespace vestige
