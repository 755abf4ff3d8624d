// SPDX-License-Identifier: BSD-3-Clause
#include "explorer/renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "explorer/annotate.h"
#include "explorer/stack_pieces.h"
#include "explorer/stack_source.h"
#include "explorer/view_data.h"
#include "proxy/error.h"

namespace vestige {
namespace {

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : text;
}

std::string numberOf(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

std::string chosen(const std::string& wanted, const std::vector<std::string>& there,
                   const Archive& archive, const char* what) {
  const std::string name = "archive " + archive.directory().string();
  if (there.empty()) throw Error(ErrorCode::NotFound, name + " holds no step yet");
  if (wanted.empty()) return there.front();
  const auto found = std::find(there.begin(), there.end(), wanted);
  if (found == there.end()) {
    throw Error(ErrorCode::NotFound,
                name + " has no " + what + " '" + wanted + "'; there are: " + listed(there));
  }
  return *found;
}

/// The run's base transfer function with what the look changes.
TransferFunction functionOf(const Look& look, const ProxyHeader& header,
                            const IntervalPartition* partition) {
  const double low = partition ? partition->low() : header.statistics.low;
  const double high = partition ? partition->high() : header.statistics.high;
  TransferFunction function =
      header.base
          ? *header.base
          : TransferFunction::ramp(low, high, std::max(header.domain.diagonal(), 1e-300) / 100.0);
  if (look.referenceLength) {
    function = TransferFunction(function.opacityPoints(), *look.referenceLength,
                                function.colormap(), function.colorLow(), function.colorHigh());
  }
  if (look.opacity) function.setOpacity(*look.opacity);
  if (!look.colormap.empty()) function.setColormap(Colormap::named(look.colormap));
  if (look.colorRange) function.setColorRange(look.colorRange->first, look.colorRange->second);
  if (!look.factors.empty()) {
    if (!partition || look.factors.size() != std::size_t(partition->intervals())) {
      throw Error(ErrorCode::Config,
                  "look key 'factors' holds " + std::to_string(look.factors.size()) +
                      " numbers, field '" + header.field + "' has " +
                      std::to_string(partition ? partition->intervals() : 0) + " intervals");
    }
    function.setFactors(look.factors);
  }
  return function;
}

Picture mipPicture(const ProxyImage& image, const TransferFunction& function) {
  const Channel& channel = image.channel("mip", "value");
  Picture picture = Picture::blank(image.header.size);
  for (std::size_t i = 0; i < channel.values.size(); ++i) {
    if (!std::isfinite(channel.values[i])) continue;
    const glm::dvec3 color = function.color(channel.values[i]);
    for (int c = 0; c < 3; ++c) picture.rgba[4 * i + std::size_t(c)] = float(color[c]);
    picture.rgba[4 * i + 3] = 1.0f;
  }
  return picture;
}

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

/// The camera whose picture of `to` shows all that it showed in a picture of `from`.
Camera fittedCamera(Camera camera, ImageSize from, ImageSize to) {
  const double grow = std::max(1.0, from.aspect() / to.aspect());
  camera.viewHeight *= grow;
  if (grow > 1.0) camera.fieldOfView = 2.0 * std::atan(grow * std::tan(0.5 * camera.fieldOfView));
  return camera;
}

double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }

}  // namespace

long cycleOf(const Look& look, const Archive& archive) {
  const std::vector<long> cycles = archive.cycles();
  if (cycles.empty()) {
    throw Error(ErrorCode::NotFound, "archive " + archive.directory().string() + " holds no step");
  }
  if (look.time) {
    return *std::min_element(cycles.begin(), cycles.end(), [&](long a, long b) {
      return std::abs(archive.timeOf(a) - *look.time) < std::abs(archive.timeOf(b) - *look.time);
    });
  }
  if (!look.cycle) return cycles.back();
  if (std::find(cycles.begin(), cycles.end(), *look.cycle) != cycles.end()) return *look.cycle;
  std::string there;
  const std::size_t shown = std::min<std::size_t>(cycles.size(), 12);
  for (std::size_t i = 0; i < shown; ++i) there += (i ? ", " : "") + std::to_string(cycles[i]);
  if (shown < cycles.size()) there += ", ... " + std::to_string(cycles.back());
  throw Error(ErrorCode::NotFound, "archive " + archive.directory().string() + " has no cycle " +
                                       std::to_string(*look.cycle) + "; there are: " + there);
}

struct Renderer::Impl {
  std::shared_ptr<gl::Device> device;
  std::shared_ptr<const Archive> archive;
  std::unique_ptr<ViewCache> views;
  std::unique_ptr<EditPass> edit;
  std::unique_ptr<LayerPass> layer;
  std::unique_ptr<LayeredPass> layered;
  std::unique_ptr<StackSource> stacks;  ///< those that were asked for last

  /// The view that answers: the stored one that looks most nearly along the target's direction.
  ViewData& sourceFor(const Look& look, long cycle, const std::string& field, ViewData& base,
                      const Camera& target, Rendered& out);
  void drawVolume(const Look& look, ViewData& view, const TransferFunction& function, Via via,
                  Rendered& out);
  void drawLayers(const Look& look, ViewData& view, const TransferFunction& function,
                  Rendered& out);
  void drawLayered(const Look& look, ViewData& view, Rendered& out);
  /// Whether a grid answers instead of the view's own proxies.
  bool fieldAnswers(const Look& look, long cycle, const std::string& field, const ViewData& base,
                    const Camera& target) const;
  void drawField(const Look& look, ViewData& stored, ImageSize viewSize, Rendered& out);
  /// What stacks of the step have to do with a look: nothing, the one of the view is recomposed, or
  /// they are drawn as a grid.
  enum class Stacks { None, Pieces, Grid };
  Stacks stacksAnswer(const Look& look, long cycle, const std::string& field, const ViewData& base,
                      const Camera& target, Rendered& out) const;
  StackSource& stacksOf(long cycle, const std::string& field);
  void drawStackPieces(const Look& look, ViewData& view, const TransferFunction& function,
                       Rendered& out);
  void drawStackGrid(const Look& look, StackSource& source, const TransferFunction& function,
                     ImageSize viewSize, Rendered& out);
  /// The light of the view's depth layers, if the look wants any.
  std::optional<gl::Texture> lightOf(const Look& look, ViewData& view, const Rendered& out);
  void draw(const Look& look, ViewData& view, const TransferFunction& function, Rendered& out);
  ChannelTable tableOf(Via via, ViewData& view, const TransferFunction& function) const;
  Via viaOf(const Look& look, ViewData& view, Rendered& out) const;
};

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

std::optional<gl::Texture> Renderer::Impl::lightOf(const Look& look, ViewData& view,
                                                   const Rendered& out) {
  if (look.shading != Shading::Phong && !look.ao.on) return std::nullopt;
  const ProxyHeader& header = view.header();
  return layer->light(view.layers(),
                      lightSetup(look, header.camera, out.camera, header.domain.diagonal()));
}

void Renderer::Impl::drawVolume(const Look& look, ViewData& view, const TransferFunction& function,
                                Via via, Rendered& out) {
  const PieceTextures& pieces = view.pieces(via, look.order);
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
    enhancement = edit->enhancement(pieces, table, look.enhance.lambda, look.enhance.gamma);
    extras.enhancement = &*enhancement;
  }
  out.picture = edit->render(pieces, table, extras);
  if (look.trust) out.trust = trustFromDoubt(edit->doubt(pieces, table));
}

void Renderer::Impl::drawLayers(const Look& look, ViewData& view, const TransferFunction& function,
                                Rendered& out) {
  const ProxyHeader& header = view.header();
  const LayerTextures& layers = view.layers();
  const gl::Texture colors = gpu::textureArray(GL_RGBA32F, layers.size, layers.count);
  if (view.has(kind::kLength) || view.has(kind::kAttenuation)) {
    const Via via = viaOf(look, view, out);
    const ChannelTable table = tableOf(via, view, function);
    const PieceTextures& pieces = view.pieces(via, look.order);
    std::optional<gl::Texture> enhancement;
    if (look.enhance.on) {
      enhancement = edit->enhancement(pieces, table, look.enhance.lambda, look.enhance.gamma);
    }
    for (int m = 0; m < layers.count; ++m) {
      EditExtras extras;
      extras.layerOf = &view.layerOf();
      extras.oneLayer = m;
      if (enhancement) extras.enhancement = &*enhancement;
      edit->draw(pieces, table, extras, colors, m);
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
  if (look.shading == Shading::Phong || look.ao.on) {
    light =
        layer->light(layers, lightSetup(look, header.camera, out.camera, header.domain.diagonal()));
  }
  const ImageSize size = look.size.value_or(layers.size);
  WarpedView warped = layer->warp(layers, colors, light ? &*light : nullptr,
                                  fittedCamera(out.camera, layers.size, size), size, look.trust);
  out.picture = std::move(warped.picture);
  out.depth = std::move(warped.depth);
  if (look.trust) out.trust = trustFromStretch(warped.guess, out.picture);
}

void Renderer::Impl::drawLayered(const Look& look, ViewData& view, Rendered& out) {
  const LayeredTextures& layers = view.layered();
  const ImageSize size = look.size.value_or(layers.size);
  LayeredView drawn =
      layered->render(layers, fittedCamera(out.camera, layers.size, size), size, look.trust);
  out.picture = std::move(drawn.picture);
  out.notes.push_back("layered answers: " + std::to_string(layers.layers) +
                      " piecewise-analytic layers; opacity, colour and light (" + layers.shading +
                      ") are baked in");
  if (!look.trust) return;
  if (out.camera == view.header().camera) {
    out.trust.assign(size.pixels(), Trust::Data);
  } else {
    out.trust = trustFromStretch(drawn.guess, out.picture);
  }
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

void Renderer::Impl::drawField(const Look& look, ViewData& stored, ImageSize viewSize,
                               Rendered& out) {
  const ProxyHeader& header = stored.header();
  const IntervalPartition* partition = stored.partition();
  const ImageSize size = look.size.value_or(viewSize);
  FieldSource& source = stored.field();
  VolumeView view = source.draw(look, functionOf(look, header, partition),
                                fittedCamera(out.camera, viewSize, size), size);
  out.picture = std::move(view.picture);
  out.depth = std::move(view.depth);
  if (look.trust) out.trust = trustFromStretch(view.guess, out.picture);
  out.notes.push_back(source.note());
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

StackSource& Renderer::Impl::stacksOf(long cycle, const std::string& field) {
  if (!stacks || !stacks->is(cycle, field)) {
    stacks.reset();  // before the next takes its memory
    stacks = std::make_unique<StackSource>(*archive, cycle, field);
  }
  return *stacks;
}

void Renderer::Impl::drawStackPieces(const Look& look, ViewData& view,
                                     const TransferFunction& function, Rendered& out) {
  const SlicedStack& stack = view.stack();
  const FineChannels channels(*stack.header.partition);
  const PieceTextures& pieces = view.stackPieces(channels.parts(), Uncertain::Likely);
  const ChannelTable table = channels.table(function);
  out.notes.push_back("sliced answers: " + errorOfStack(stack.header, stack.levels));
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
    enhancement = edit->enhancement(view.stackPieces(1, Uncertain::Likely), whole.table(function),
                                    look.enhance.lambda, look.enhance.gamma);
    extras.enhancement = &*enhancement;
  }
  out.picture = edit->render(pieces, table, extras);
  if (!look.trust) return;
  // What hangs on an order that is not stored changes when it is turned round.
  const Picture other =
      edit->render(view.stackPieces(channels.parts(), Uncertain::Reversed), table, extras);
  std::vector<float> doubt(out.picture.size.pixels(), 0.0f);
  for (std::size_t i = 0; i < doubt.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      doubt[i] = std::max(doubt[i], std::abs(out.picture.rgba[4 * i + c] - other.rgba[4 * i + c]));
    }
  }
  out.trust = trustFromDoubt(doubt);
}

void Renderer::Impl::drawStackGrid(const Look& look, StackSource& source,
                                   const TransferFunction& function, ImageSize viewSize,
                                   Rendered& out) {
  const ImageSize size = look.size.value_or(viewSize);
  VolumeView view = source.draw(look, function, fittedCamera(out.camera, viewSize, size), size);
  out.picture = std::move(view.picture);
  out.depth = std::move(view.depth);
  if (look.trust) out.trust = trustFromStretch(view.guess, out.picture);
  out.notes.push_back(source.note(out.camera));
}

void Renderer::Impl::draw(const Look& look, ViewData& view, const TransferFunction& function,
                          Rendered& out) {
  const bool volume = view.has(kind::kLength) || view.has(kind::kAttenuation);
  const bool layers = view.has(kind::kDepth) || view.has(kind::kLength);
  const bool stored = out.camera == view.header().camera;
  Source source = look.source;
  if (source == Source::Auto) {
    const bool onlyLayered = view.has(kind::kLayered) && !layers;
    source = !stored                      ? onlyLayered ? Source::Layered : Source::Layers
             : volume                     ? Source::Volume
             : layers                     ? Source::Layers
             : view.has(kind::kReference) ? Source::Reference
             : onlyLayered                ? Source::Layered
                                          : Source::Mip;
  }
  if (!stored && source != Source::Layers && source != Source::Layered) {
    throw Error(ErrorCode::Config,
                "look key 'source' must be auto, layers or layered for a rotated view: only layers "
                "can be seen from elsewhere");
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
    case Source::Layered:
      drawLayered(look, view, out);
      return;
    case Source::Mip:
      out.picture = mipPicture(view.image(kind::kMip), function);
      out.notes.push_back("mip answers: the largest value along each ray, opacity plays no part");
      return;
    default:
      out.picture = referencePicture(view.image(kind::kReference));
      out.notes.push_back(
          "reference answers: the run's own rendering; opacity and colour are baked in");
      return;
  }
}

Renderer::Renderer(std::shared_ptr<gl::Device> device, std::shared_ptr<const Archive> archive)
    : impl_(std::make_unique<Impl>()) {
  impl_->device = std::move(device);
  impl_->archive = std::move(archive);
  impl_->device->run([&] {
    impl_->views = std::make_unique<ViewCache>(*impl_->archive);
    impl_->edit = std::make_unique<EditPass>();
    impl_->layer = std::make_unique<LayerPass>();
    impl_->layered = std::make_unique<LayeredPass>();
  });
}

Renderer::~Renderer() {
  impl_->device->run([&] {
    impl_->stacks.reset();
    impl_->layered.reset();
    impl_->layer.reset();
    impl_->edit.reset();
    impl_->views.reset();
  });
}

Rendered Renderer::render(const Look& look) {
  look.validate();
  Impl& self = *impl_;
  const Archive& archive = *self.archive;
  Rendered out;
  const long cycle = cycleOf(look, archive);
  const std::string field = chosen(look.field, archive.fields(), archive, "field");
  const std::string viewName = chosen(look.view, archive.views(), archive, "view");
  self.device->run([&] {
    ViewData& base = self.views->get(cycle, viewName, field);
    const Camera stored = base.header().camera;
    out.camera = look.rotate.isZero()
                     ? stored
                     : stored.orbited(base.header().domain.center(), radians(look.rotate.azimuth),
                                      radians(look.rotate.elevation), radians(look.rotate.roll));
    const Impl::Stacks stacks = self.stacksAnswer(look, cycle, field, base, out.camera, out);
    const bool fromField =
        stacks == Impl::Stacks::None && self.fieldAnswers(look, cycle, field, base, out.camera);
    ViewData& view = fromField ? self.views->get(cycle, kFieldView, field)
                     : stacks != Impl::Stacks::None
                         ? base
                         : self.sourceFor(look, cycle, field, base, out.camera, out);
    StackSource* grid = stacks == Impl::Stacks::Grid ? &self.stacksOf(cycle, field) : nullptr;
    const ProxyHeader& header = grid ? grid->header() : view.header();
    const TransferFunction function =
        functionOf(look, header, grid ? &*header.partition : view.partition());
    const ImageSize viewSize = (fromField ? base : view).header().size;
    if (grid) {
      self.drawStackGrid(look, *grid, function, viewSize, out);
    } else if (stacks == Impl::Stacks::Pieces) {
      self.drawStackPieces(look, view, function, out);
    } else if (fromField) {
      self.drawField(look, view, viewSize, out);
    } else {
      self.draw(look, view, function, out);
    }
    if (!out.trust.empty()) {
      out.shares = sharesOf(out.trust, out.picture);
      overlayTrust(out.picture, out.trust);
    } else if (look.trust) {
      out.trust.assign(out.picture.size.pixels(), Trust::Data);
    }
    const ImageSize size = look.size.value_or(out.picture.size);
    out.picture = fitted(out.picture, size);
    out.camera = fittedCamera(out.camera, viewSize, size);
    const AnnotationSubject subject{out.camera,   header.domain, &function,   header.field,
                                    header.units, header.time,   header.cycle};
    if (look.annotations.box) {
      Picture behind = Picture::blank(size);
      drawBoxEdges(behind, subject, true, inkOn(look.background));
      placeOver(out.picture, behind);
      drawBoxEdges(out.picture, subject, false, inkOn(look.background));
    }
    if (look.background) placeOver(out.picture, linearFromSrgb(*look.background));
    annotate(out.picture, look.annotations, subject, look.background);
  });
  return out;
}

std::optional<Renderer::OwnLook> Renderer::ownLook(const Look& look) {
  Impl& self = *impl_;
  const Archive& archive = *self.archive;
  const long cycle = cycleOf(look, archive);
  const std::string field = chosen(look.field, archive.fields(), archive, "field");
  OwnLook own{chosen(look.view, archive.views(), archive, "view"), {}, {}};
  bool both = false;
  self.device->run([&] {
    ViewData& view = self.views->get(cycle, own.view, field);
    if (!view.has(kind::kSliced) || !view.has(kind::kReference)) return;
    const ProxyImage reference = view.image(kind::kReference);
    const ProxyHeader& header = view.stack().header;
    if (!reference.header.shading.empty() || !header.base ||
        reference.header.camera != header.camera || reference.header.size != header.size) {
      return;
    }
    const FineChannels channels(*header.partition);
    own.stored = referencePicture(reference);
    own.made = self.edit->render(view.stackPieces(channels.parts(), Uncertain::Likely),
                                 channels.table(*header.base));
    both = true;
  });
  return both ? std::optional(std::move(own)) : std::nullopt;
}

}  // namespace vestige
